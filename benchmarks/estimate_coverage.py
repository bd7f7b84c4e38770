"""Whether a picture's own estimate of its error is honest: counted over scenes chosen to make it hard.

Each case is a scene, a display, a number of samples and a seed; the truth is a long render. Counted are the cases in
which the stated 95 % interval holds the true PSNR, of the picture and of its worst micro-image (wanted: 90 %), and in
which a quality asked for is kept by the true worst micro-image to within 1 dB (wanted: 95 %).

A reference has noise of its own. It is made in parts that know nothing of each other, and the true squared error is
taken as the mean product of the picture's differences to two of them, from which their noise cancels.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hard_scenes import HARD_SCENES
from harness import save

PIXEL = 0.25
PANEL = 64
REFERENCE_PARTS = 4
SAMPLES = (8, 32, 128)
SEEDS = (1, 2)
#: What is asked for, in dB: within reach of the scene, and 8 dB or more below what the references know.
QUALITIES = {
    "mixed": (22, 26),
    "mirrors": (18, 22),
    "crack": (22, 28),
    "water": (18, 22),
    "stripes": (32, 40),
    "canopy": (30, 38),
    "hidden_lamp": (15, 20),
}
MEMORY = 2**31


def displays() -> dict[str, Any]:
    """One of each kind, small."""
    from lippmann.display import Display
    from lippmann.display.lens_array import LensArray
    from lippmann.display.panel import Panel

    arrays = {
        "lenticular": LensArray("lenticular", 4 * PIXEL),
        "slanted": LensArray("lenticular", 5.3 * PIXEL, slant=9.46),
        "square": LensArray("square", 8 * PIXEL),
        "hexagonal": LensArray("hexagonal", 7 * PIXEL),
    }
    return {
        name: Display(name, Panel(PANEL, PANEL, PIXEL), array, gap=6.8, aperture_distance=10.0)
        for name, array in arrays.items()
    }


class Case:
    """A scene before a display, with its long render."""

    def __init__(self, scene: str, display: Any, seconds: float) -> None:
        import mitsuba as mi

        from lippmann.render.estimate import PictureEstimator
        from lippmann.render.integrators.path import PathIntegrator
        from lippmann.render.rays import DisplayRays
        from lippmann.render.traits import make_traits

        built = mi.load_dict(HARD_SCENES[scene]())
        world_from_display = np.diag([2 / display.size_mm[0]] * 3 + [1.0])
        self.display = display
        self.integrator = PathIntegrator(built, make_traits(built, has_null=False), 8)
        self.source = DisplayRays(display, world_from_display)
        self.estimator = PictureEstimator(display)
        self.reference, self.reference_samples = self._long(seconds)

    def _long(self, seconds: float) -> tuple[NDArray[np.float64], int]:
        from lippmann.render.full import trace_frame
        from lippmann.render.plan import make_plan

        plan = make_plan(self.source.width, self.source.height, 128, memory=MEMORY)
        parts = np.zeros((REFERENCE_PARTS, self.source.height, self.source.width, 3))
        start, rounds = time.perf_counter(), 0
        while rounds == 0 or time.perf_counter() - start < seconds:
            for part in range(REFERENCE_PARTS):
                seed = 1_000_000 + rounds * REFERENCE_PARTS + part
                parts[part] += trace_frame(self.integrator, self.source, plan, seed=seed).pixels
            rounds += 1
        return parts / rounds, 128 * rounds * REFERENCE_PARTS

    def renderer(self, seed: int) -> Any:
        from lippmann.render.batches import FullInBatches

        return FullInBatches(self.integrator, self.source, seed=seed, memory=MEMORY)

    def truth(self, picture: NDArray[np.float32]) -> tuple[float, float]:
        """True PSNR of a picture and of its worst micro-image."""
        from lippmann.image.color import encode_srgb
        from lippmann.quality.metrics import micro_image_means

        difference = encode_srgb(picture.astype(np.float64)) - encode_srgb(self.reference)
        # Products of different parts: the square of the sum less the squares.
        products = np.square(difference.sum(axis=0)) - np.square(difference).sum(axis=0)
        errors = (products / (REFERENCE_PARTS * (REFERENCE_PARTS - 1))).mean(axis=2)
        worst = np.nanmax(micro_image_means(errors, self.display)[0])
        return tuple(float(-10 * np.log10(max(value, 1e-12))) for value in (errors.mean(), worst))


def stated(case: Case) -> Iterator[dict[str, Any]]:
    """What pictures of given samples say of themselves, beside the truth."""
    for samples in SAMPLES:
        for seed in SEEDS:
            renderer = case.renderer(seed)
            renderer.add(samples)
            estimate = case.estimator.estimate(renderer.squared_error())
            psnr, worst = case.truth(renderer.picture())
            yield {
                "samples": samples,
                "seed": seed,
                "psnr": psnr,
                "worst": worst,
                "stated": estimate.to_dict(),
                "psnr_inside": estimate.psnr_low <= psnr <= estimate.psnr_high,
                "worst_inside": estimate.worst_low <= worst <= estimate.worst_high,
            }


def promised(case: Case, qualities: tuple[int, ...]) -> Iterator[dict[str, Any]]:
    """What comes of asking for a quality."""
    from lippmann.render.goal import TOLERANCE, Goal, reach

    for quality in qualities:
        for seed in SEEDS:
            renderer = case.renderer(100 + seed)
            outcome = reach(Goal(quality=quality, max_time=120), renderer, case.estimator)
            psnr, worst = case.truth(renderer.picture())
            estimate = outcome.estimate
            yield {
                "quality": quality,
                "seed": seed,
                "end": outcome.end,
                "samples": outcome.samples,
                "psnr": psnr,
                "worst": worst,
                "stated": estimate.to_dict(),
                "psnr_inside": estimate.psnr_low <= psnr <= estimate.psnr_high,
                "worst_inside": estimate.worst_low <= worst <= estimate.worst_high,
                "kept": outcome.end == "quality" and worst >= quality - TOLERANCE,
            }


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seconds", type=float, default=60.0, help="for each reference")
    options.add_argument("--scenes", nargs="+", default=list(HARD_SCENES), choices=list(HARD_SCENES))
    options.add_argument("--displays", type=int, default=2, choices=range(1, 5), help="for each scene")
    chosen = options.parse_args()

    from lippmann import engine

    engine.start("cpu")
    kinds = displays()
    cases: list[dict[str, Any]] = []
    promises: list[dict[str, Any]] = []
    for number, scene in enumerate(chosen.scenes):
        for place in range(chosen.displays):
            name = list(kinds)[(number + place) % len(kinds)]
            case = Case(scene, kinds[name], chosen.seconds)
            head = {"scene": scene, "display": name, "reference_samples": case.reference_samples}
            cases += [head | found for found in stated(case)]
            promises += [head | found for found in promised(case, QUALITIES[scene])]
    save("estimate_coverage", {"summary": summary(cases, promises), "cases": cases, "promises": promises})


def summary(cases: list[dict[str, Any]], promises: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares of the cases, and how far off the estimates were."""

    def share(found: list[dict[str, Any]], key: str) -> float:
        return round(float(np.mean([entry[key] for entry in found])), 3)

    def median_error(found: list[dict[str, Any]], key: str) -> float:
        return round(float(np.median([entry["stated"][key] - entry[key] for entry in found])), 2)

    reached = [entry for entry in promises if entry["end"] == "quality"]
    return {
        "cases": len(cases),
        "psnr_inside": share(cases, "psnr_inside"),
        "worst_inside": share(cases, "worst_inside"),
        "psnr_stated_minus_true": median_error(cases, "psnr"),
        "worst_stated_minus_true": median_error(cases, "worst"),
        "promises": len(promises),
        "promises_reached": len(reached),
        "promises_kept": share(reached, "kept"),
        "kept_psnr_inside": share(reached, "psnr_inside"),
        "kept_worst_inside": share(reached, "worst_inside"),
        "targets": {"psnr_inside": 0.9, "worst_inside": 0.9, "promises_kept": 0.95},
    }


if __name__ == "__main__":
    main()
