"""How well two long pictures of the same caustics agree, and what pictures say of their error, by photons and by paths.

Time on two cores: an estimated 10 minutes.

Five scenes of small emitters, mirrors and glass before a small square lens array. Halves: the PSNR between two pictures
by ``full`` with 256 samples and other seeds each. Stated: pictures of 16 samples of eight seeds, ``full`` and
``pooled``; how far the PSNR that they state lies from the one that they have, against the mean of the long ones by
photons (product of the differences to either).

python benchmarks/hard_caustics.py
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from caustic_scenes import CAUSTIC_SCENES
from harness import save

LONG, FEW = 256, 16
SEEDS = range(1, 9)


def main() -> None:
    from lippmann.runtime import engine

    engine.start("cpu", 2)
    results = {}
    for name in CAUSTIC_SCENES:
        results[name] = measure(name)
        print(name, results[name], flush=True)
        save("hard_caustics", {"long_spp": LONG, "few_spp": FEW, "seeds": len(SEEDS), "scenes": results})


def measure(name: str) -> dict[str, Any]:
    from lippmann.api import load_scene

    scene = load_scene(CAUSTIC_SCENES[name]())
    found: dict[str, Any] = {}
    references = []
    for way in ("paths", "photons"):
        started = time.process_time()
        long = [codes(rendered(scene, way, "full", LONG, seed)) for seed in (1001, 2002)]
        found[way] = {"halves": psnr(np.square(long[0] - long[1]).mean()), "seconds": time.process_time() - started}
        references = long
    for method in ("full", "pooled"):
        stated, true, held, promised = [], [], [], []
        for seed in SEEDS:
            picture = rendered(scene, "photons", method, FEW, seed)
            told, pixels = picture.provenance.estimate, codes(picture)
            error = float(((pixels - references[0]) * (pixels - references[1])).mean())
            stated.append(told["psnr"])
            true.append(psnr(error))
            held.append(told["psnr_low"] <= true[-1] <= told["psnr_high"])
            promised.append(true[-1] >= told["psnr_low"])
        found[f"{method}_stated"] = {
            "stated": float(np.mean(stated)),
            "true": float(np.mean(true)),
            "held": float(np.mean(held)),
            "not_worse": float(np.mean(promised)),
        }
    return found


def rendered(scene: Any, way: Any, method: Any, spp: int, seed: int) -> Any:
    import lippmann

    return lippmann.render(
        scene,
        small_array(),
        integrator="path",
        caustics=way,
        method=method,
        spp=spp,
        seed=seed,
        exposure=0,
        tone_map="none",
        placement=turned(),
    )


def small_array() -> Any:
    """12 x 12 lenses of 8 pixels."""
    from lippmann.display import Display, LensArray, Panel

    return Display("small", Panel(96, 96, 2 / 96 * 8), LensArray("square", 2 / 96 * 8 * 8), 6.8, "", 500.0, 16.0)


def turned() -> Any:
    """How the display is placed in the scenes."""
    from lippmann.options.placement import PlacementOptions

    return PlacementOptions(place="fit", turn=(0.0, 30.0, 0.0))


def codes(picture: Any) -> Any:
    from lippmann.color.transfer import encode_srgb

    return encode_srgb(picture.pixels.astype(np.float64))


def psnr(error: float) -> float:
    return float(-10 * np.log10(max(error, 1e-12)))


if __name__ == "__main__":
    main()
