"""What respecting gloss is worth where light is sampled: reuse of points with path and direct light of 16 samples.

Time on two cores: an estimated 10 minutes.

Reused points carry their noise along, and whatever of their colour depends on direction is falsified; the careful mode
(``respect_gloss``) traces such pixels anew. Each way is held against a long full rendering: PSNR of the picture and of
its worst micro-image, the share of rays traced, and seconds as a ratio to ``full`` in the same turn. Seconds are those
of the processor, medians of turns after one to warm up.

python benchmarks/careful.py [SCENE ...]
"""

from __future__ import annotations

import statistics
import sys
import time
from typing import Any

import numpy as np

from harness import median_ratio, save, saved

SCENES = ("teapot", "room", "primitives", "small-balls", "gears", "tree")
#: A display's preset, and the size to which it is cut.
DISPLAYS = {"lenticular": ("seed-lenticular", (512, 64)), "square": ("mla-square", (240, 90))}
LIGHTS = ("path", "direct")
SPP, REFERENCE_SPP, TURNS = 16, 256, 3
WAYS: dict[str, dict[str, Any]] = {
    "full": {"method": "full"},
    **{
        f"{method}{', careful' if careful else ''}": {"method": method, "respect_gloss": careful}
        for method in ("lens-view", "interpolated")
        for careful in (False, True)
    },
}


def main(scenes: list[str]) -> None:
    import lippmann

    results = saved("careful").get("results", {})
    for scene in scenes:
        loaded = lippmann.load_scene(scene)
        for name, (preset, size) in DISPLAYS.items():
            display = lippmann.load_display(preset).resized(*size)
            for light in LIGHTS:
                results.setdefault(scene, {}).setdefault(name, {})[light] = _measured(loaded, display, light)
                save("careful", {"spp": SPP, "reference_spp": REFERENCE_SPP, "results": results})


def _measured(scene: Any, display: Any, light: str) -> dict[str, Any]:
    import lippmann
    from lippmann.metrics.mse_psnr import micro_image_means, psnr, squared_errors

    def rendered(seed: int, **options: Any) -> tuple[Any, float]:
        started = time.process_time()
        options = {"tone_map": "none", "integrator": light, "denoise": "none", "spp": SPP, **options}
        image = lippmann.render(scene, display, seed=seed, **options)
        return image, time.process_time() - started

    reference, _ = rendered(1_000, method="full", spp=REFERENCE_SPP)
    seconds: dict[str, list[float]] = {way: [] for way in WAYS}
    found: dict[str, list[Any]] = {way: [] for way in WAYS}
    for turn in range(TURNS + 1):
        for way, options in WAYS.items():
            image, spent = rendered(turn, **options)
            if turn:
                seconds[way].append(spent)
                errors = squared_errors(reference, image)
                worst = float(np.nanmax(micro_image_means(errors, display)[0]))
                found[way].append((psnr(float(errors.mean())), psnr(worst), image.stats["traced_fraction"]))
    return {
        way: {
            "psnr": statistics.median(each[0] for each in found[way]),
            "worst": statistics.median(each[1] for each in found[way]),
            "traced": statistics.median(each[2] for each in found[way]),
            "seconds_to_full": median_ratio(seconds[way], seconds["full"]),
        }
        for way in WAYS
    }


if __name__ == "__main__":
    main(sys.argv[1:] or list(SCENES))
