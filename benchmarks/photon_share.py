"""What photons and chains take of a picture's time, and what they bring: the default beside ``caustics="paths"``.

Time on two cores: an estimated 10 minutes, most of them for references.

Made scenes whose mirrors and glass are small in a large world, bundled ones, and a public one where it lies beside this
repository; 256 x 256 pixels, ``full``, one thread. Time is that of the processor for a whole ``render``, both ways in
turn in one process: the median of three after one that compiles. The PSNR is that of the mean of (p - a)(p - b) in
codes over two seeds, a and b being two long pictures with photons that know nothing of each other.

python benchmarks/photon_share.py [SCENE ...] [--references FOLDER | --times]
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
    words.add_argument("--times", action="store_true", help="measure the times of scenes alone whose PSNR is saved")
    words.add_argument("--worker", help=argparse.SUPPRESS)
    given = words.parse_args()
    if given.worker is not None:
        _work(**json.loads(given.worker))
        return
    scenes = given.scenes or [*WORLD_SCENES, *BUNDLED, *([PUBLIC.stem] if PUBLIC.exists() else [])]
    results = saved("photon_share").get("scenes", {}) if given.scenes else {}
    with tempfile.TemporaryDirectory() as folder:
        for name in scenes:
            rows = results[name] if given.times else _measure(name, given.references or Path(folder))
            results[name] = [_timed(name, row) for row in rows]
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
        rows.append(row)
    return rows


def _timed(name: str, row: dict[str, Any]) -> dict[str, Any]:
    """A row with the seconds of both ways."""
    for way, seconds in _process(name, way="", samples=row["spp"]).items():
        row[way]["seconds"] = seconds
    row["share"] = 1 - row["paths"]["seconds"] / row["default"]["seconds"]
    print(name, json.dumps(row), flush=True)
    return row


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

    def picture(seed: int, way: str = way) -> tuple[float, Any, dict[str, Any]]:
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
    if reference is None:
        rounds = [{name: picture(seed, caustics)[0] for name, caustics in WAYS.items()} for seed in range(4)]
        print(json.dumps({name: float(np.median([each[name] for each in rounds[1:]])) for name in WAYS}))
        return
    made_pictures = [picture(seed) for seed in SEEDS]
    a, b = np.load(reference)
    error = np.mean([((codes - a) * (codes - b)).mean() for _, codes, _ in made_pictures])
    told = made_pictures[-1][2]
    answer = {
        "psnr": float(-10 * np.log10(max(error, 1e-12))),
        "caustics": told.get("caustics", "left to paths"),
        "chains": told.get("seen_chains", 0),
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
