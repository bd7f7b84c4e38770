"""What photons and chains take of a picture's time, and what they bring: the default beside ``caustics="paths"``.

Time on two cores: an estimated 10 minutes, most of them for references.

Made scenes whose mirrors and glass are small in a large world, bundled ones, and a public one where it lies beside this
repository; 256 x 256 pixels, ``full``, one thread. Each way and number of samples is a process of its own, the ways in
turn. Time is that of the processor for a whole ``render``, the lesser of two after one that compiles. The PSNR is that
of the mean of (p - a)(p - b) in codes over both seeds, a and b being two long pictures with photons that know nothing
of each other.

python benchmarks/photon_share.py [SCENE ...] [--references FOLDER]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from harness import save, saved
from world_scenes import WORLD_SCENES

BUNDLED = ("primitives", "small-balls", "gears")
PUBLIC = Path(__file__).parents[2] / "shared" / "scenes" / "tachyon" / "lscapes.dat"
WAYS = {"default": "auto", "paths": "paths"}
SAMPLES = (4, 16)
REFERENCE = 32
SEEDS = (1, 2)


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("scenes", nargs="*")
    words.add_argument("--references", type=Path)
    words.add_argument("--worker", help=argparse.SUPPRESS)
    given = words.parse_args()
    if given.worker is not None:
        _work(**json.loads(given.worker))
        return
    scenes = given.scenes or [*WORLD_SCENES, *BUNDLED, *([PUBLIC.stem] if PUBLIC.exists() else [])]
    results = saved("photon_share").get("scenes", {}) if given.scenes else {}
    with tempfile.TemporaryDirectory() as folder:
        for name in scenes:
            results[name] = _measure(name, given.references or Path(folder))
            save("photon_share", {"reference_spp": REFERENCE, "scenes": results})


def _measure(name: str, folder: Path) -> list[dict[str, Any]]:
    folder.mkdir(parents=True, exist_ok=True)
    reference = folder / f"{name.replace(' ', '-')}.npy"
    if not reference.exists():
        _process(name, way="photons", samples=REFERENCE, long=str(reference))
    rows = []
    for samples in SAMPLES:
        row: dict[str, Any] = {"spp": samples}
        for way, caustics in WAYS.items():
            row[way] = _process(name, way=caustics, samples=samples, reference=str(reference))
        row["share"] = 1 - row["paths"]["seconds"] / row["default"]["seconds"]
        print(name, json.dumps(row), flush=True)
        rows.append(row)
    return rows


def _process(name: str, **asked: object) -> dict[str, Any]:
    words = [sys.executable, __file__, "--worker", json.dumps({"name": name, **asked})]
    said = subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout
    answer: dict[str, Any] = json.loads(said.splitlines()[-1])
    return answer


def _work(name: str, way: str, samples: int, reference: str | None = None, long: str | None = None) -> None:
    import lippmann
    from lippmann.color.transfer import encode_srgb
    from lippmann.display import Display, LensArray, Panel
    from lippmann.options.placement import PlacementOptions

    display = Display("square", Panel(256, 256, 0.5), LensArray("lenticular", 4.0), 6.8, "", 400.0, 390.0)
    made = name in WORLD_SCENES
    scene = lippmann.load_scene(WORLD_SCENES[name]() if made else str(PUBLIC) if name == PUBLIC.stem else name)
    placement = PlacementOptions(place="camera") if made else None

    def picture(seed: int) -> tuple[float, Any, dict[str, Any]]:
        began = time.process_time()
        image = lippmann.render(
            scene,
            display,
            integrator="path",
            caustics=way,  # type: ignore[arg-type]
            method="full",
            spp=samples,
            seed=seed,
            exposure=0,
            tone_map="none",
            placement=placement,
            threads=1,
        )
        seconds = time.process_time() - began
        return seconds, encode_srgb(image.pixels.astype(np.float64)), image.provenance.options

    if long is not None:
        np.save(long, np.stack([picture(seed)[1] for seed in (1001, 2002)]).astype(np.float32))
        print("{}")
        return
    assert reference is not None
    picture(0)
    made_pictures = [picture(seed) for seed in SEEDS]
    a, b = np.load(reference)
    error = np.mean([((codes - a) * (codes - b)).mean() for _, codes, _ in made_pictures])
    told = made_pictures[-1][2]
    answer = {
        "seconds": min(seconds for seconds, _, _ in made_pictures),
        "psnr": float(-10 * np.log10(max(error, 1e-12))),
        "caustics": told.get("caustics", "left to paths"),
        "chains": told.get("seen_chains", 0),
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
