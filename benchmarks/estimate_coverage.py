"""Whether a picture's own estimate of its error is honest: counted over scenes chosen to make it hard.

Time on two cores: an estimated 3 hours, most of them for references.

Each case is a scene, a display, a way of making the picture (plain, denoised, pooled), a number of samples and a seed;
the truth is a long render. Counted are the cases in which the stated 95 % interval holds the true PSNR, of the picture
and of its worst micro-image (wanted: 90 %), and in which a quality asked for is kept by the true worst micro-image to
within 1 dB (wanted: 95 %). How far off the estimates of very few plain samples are, is why goals wait for more.
Ways and scenes that are not rendered anew keep the results that they have.

A reference has noise of its own. It is made in parts that know nothing of each other, and the true squared error is
taken as the mean product of the picture's differences to two of them, from which their noise cancels.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from caustic_scenes import CAUSTIC_SCENES
from equal_error import light_up
from hard_scenes import HARD_SCENES
from harness import kept, save, saved

PIXEL = 0.25
PANEL = 64
#: Few, so that each is long: what the curve of the codes makes of a part's noise does not cancel.
REFERENCE_PARTS = 2
SAMPLES = (8, 32, 128)
SEEDS = (1, 2)
#: So few samples that no goal trusts plain pictures of them, and their seeds.
FEW_SAMPLES = (4, 8)
FEW_SEEDS = range(301, 309)
#: Ways of making pictures, each as a method and what takes the noise out.
WAYS = {"plain": ("full", "none"), "denoised": ("full", "oidn"), "pooled": ("pooled", "oidn")}
#: What is asked for, in dB: so little that the first look may do, then more; within reach of plain samples, and 8 dB or
#: more below what the references know.
QUALITIES = {
    "mixed": (18, 22, 26),
    "mirrors": (14, 18, 22),
    "crack": (18, 22, 28),
    "water": (14, 18, 22),
    "stripes": (28, 32, 40),
    "canopy": (26, 30, 38),
    "hidden_lamp": (11, 15, 20),
    "curved_mirrors": (20, 26, 32),
    "mirror_balls": (18, 24, 28),
    "jewel": (22, 28, 34),
    "sunlit_water": (24, 30, 36),
    "chrome_ring": (24, 30, 36),
}
SCENES = HARD_SCENES | CAUSTIC_SCENES
#: Samples per pixel at which a quality is given up.
MOST = 1024
#: Degrees by which caustic scenes are seen from above.
LOOKED_DOWN = 30.0
DEPTH = 8
MEMORY = 2**31
THREADS = 2


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
    """A scene before a display, with its long render, which a file in ``folder`` keeps for the next time."""

    def __init__(self, scene: str, display: Any, seconds: float, folder: Path | None) -> None:
        from lippmann.api import load_scene
        from lippmann.rendering.request.render_request import RenderRequest
        from lippmann.rendering.session import open_session
        from lippmann.scene.matrices import rotation

        request = RenderRequest(integrator="path", depth=DEPTH, threads=THREADS, pixel_filter="box")
        self.session = open_session(load_scene(SCENES[scene]()), request, memory=MEMORY)

        from lippmann.rendering.transport.ray_source import DisplayRays

        self.world_from_display = np.diag([2 / display.size_mm[0]] * 3 + [1.0])
        if scene in CAUSTIC_SCENES:
            # Looked at from above, so that the floors are seen on which light is thrown.
            self.world_from_display = np.linalg.inv(rotation((0.0, LOOKED_DOWN, 0.0))) @ self.world_from_display
        self.display = display
        self.source = DisplayRays(display, self.world_from_display)
        self.display_from_world = np.linalg.inv(self.world_from_display)
        self.integrator = self.session.integrator(self.source, self.display_from_world)
        file = folder and folder / f"{scene}-{display.name}.npz"
        found = kept(file, lambda: dict(zip(("parts", "samples"), self._long(seconds), strict=True)))
        self.reference, self.reference_samples = found["parts"], int(found["samples"])

    def _long(self, seconds: float) -> tuple[NDArray[np.float64], int]:
        from lippmann.rendering.film.memory_model import cut_wavefronts
        from lippmann.rendering.film.wavefront import trace_frame

        plan = cut_wavefronts(self.source.width, self.source.height, 128, memory=MEMORY)
        parts = np.zeros((REFERENCE_PARTS, self.source.height, self.source.width, 3))
        start, rounds = time.process_time(), 0
        while rounds == 0 or time.process_time() - start < seconds:
            for part in range(REFERENCE_PARTS):
                seed = 1_000_000 + rounds * REFERENCE_PARTS + part
                # References and pictures must not share any photons.
                light_up(self, replace(self.session.request, method="full", denoise="none", seed=seed, spp=128), MEMORY)
                parts[part] += trace_frame(self.integrator, self.source, plan, seed=seed).pixels
            rounds += 1
        return parts / rounds, 128 * rounds * REFERENCE_PARTS

    def trace(self, way: str, seed: int, **asked: Any) -> Any:
        """A picture made that way, as the whole program makes it."""
        from lippmann.rendering.methods import Job, trace

        method, denoise = WAYS[way]
        request = replace(self.session.request, method=method, denoise=denoise, seed=seed, pixel_filter="box", **asked)
        session = replace(self.session, request=request)
        light_up(self, request, MEMORY)
        return trace(Job(session, self.integrator, self.source, self.display_from_world))

    def truth(self, picture: NDArray[np.float32]) -> tuple[float, float]:
        """True PSNR of a picture and of its worst micro-image."""
        from lippmann.color.transfer import encode_srgb
        from lippmann.metrics.mse_psnr import micro_image_means

        difference = encode_srgb(picture.astype(np.float64)) - encode_srgb(self.reference)
        # Products of different parts: the square of the sum less the squares.
        products = np.square(difference.sum(axis=0)) - np.square(difference).sum(axis=0)
        errors = (products / (REFERENCE_PARTS * (REFERENCE_PARTS - 1))).mean(axis=2)
        worst = np.nanmax(micro_image_means(errors, self.display)[0])
        return tuple(float(-10 * np.log10(max(value, 1e-12))) for value in (errors.mean(), worst))

    def beside_the_truth(self, traced: Any) -> dict[str, Any]:
        """What a picture says of itself, and what is true."""
        from lippmann.rendering.provenance import describe_estimate
        from lippmann.rendering.session import read_choices

        psnr, worst = self.truth(traced.frame.pixels)
        told: Any = describe_estimate(traced.estimate, read_choices(self.integrator))
        return {
            "samples": traced.samples,
            "psnr": psnr,
            "worst": worst,
            "stated": told,
            "psnr_inside": told["psnr_low"] <= psnr <= told["psnr_high"],
            "worst_inside": told["worst_low"] <= worst <= told["worst_high"],
        }


def stated(case: Case, way: str) -> Iterator[dict[str, Any]]:
    """What pictures of given samples say of themselves, beside the truth."""
    for samples in SAMPLES:
        for seed in SEEDS:
            yield {"seed": seed} | case.beside_the_truth(case.trace(way, seed, spp=samples))


def promised(case: Case, way: str, qualities: tuple[int, ...]) -> Iterator[dict[str, Any]]:
    """What comes of asking for a quality."""
    from lippmann.rendering.adaptive.tuning import TUNING

    for quality in qualities:
        for seed in SEEDS:
            found = case.beside_the_truth(case.trace(way, 100 + seed, quality_worst=quality, spp=MOST))
            end = "samples" if found["samples"] >= MOST else "quality"
            kept = end == "quality" and found["worst"] >= quality - TUNING.tolerance
            yield {"quality": quality, "seed": seed, "end": end} | found | {"kept": kept}


def few(case: Case) -> Iterator[dict[str, Any]]:
    """What plain pictures of very few samples say of themselves, beside the truth."""
    for samples in FEW_SAMPLES:
        for seed in FEW_SEEDS:
            yield {"seed": seed} | case.beside_the_truth(case.trace("plain", seed, spp=samples))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seconds", type=float, default=60.0, help="of the processors, for each reference")
    options.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    options.add_argument("--displays", type=int, default=2, choices=range(1, 5), help="for each scene")
    options.add_argument("--ways", nargs="+", default=list(WAYS), choices=list(WAYS))
    options.add_argument("--references", type=Path, help="a folder that keeps the references")
    chosen = options.parse_args()

    from lippmann.runtime import engine

    engine.start("cpu", THREADS)
    kinds = displays()
    before = saved("estimate_coverage")
    found: dict[str, list[dict[str, Any]]] = {
        part: [
            one for one in before.get(part, []) if one["way"] not in chosen.ways or one["scene"] not in chosen.scenes
        ]
        for part in ("cases", "promises")
    }
    of_few: list[dict[str, Any]] = [
        one
        for one in before.get("few", {}).get("cases", [])
        if "plain" not in chosen.ways or one["scene"] not in chosen.scenes
    ]
    for place in range(chosen.displays):
        for scene in chosen.scenes:
            # By the scene alone: its cases are the same whichever others are named.
            name = list(kinds)[(list(SCENES).index(scene) + place) % len(kinds)]
            case = Case(scene, kinds[name], chosen.seconds, chosen.references)
            told = {"scene": scene, "display": name, "reference_samples": case.reference_samples}
            for way in chosen.ways:
                head = {"way": way, **told}
                found["cases"] += [head | one for one in stated(case, way)]
                found["promises"] += [head | one for one in promised(case, way, QUALITIES[scene])]
            if "plain" in chosen.ways:
                of_few += [told | one for one in few(case)]
            # After every case: it takes long, and what is known stands by itself.
            about_few = {"summary": summary_of_few(of_few), "cases": of_few}
            save("estimate_coverage", {"summary": summaries(**found), **found, "few": about_few})


def summaries(cases: list[dict[str, Any]], promises: list[dict[str, Any]]) -> dict[str, Any]:
    """The summary of each way that has results."""
    of = {way: [[one for one in part if one["way"] == way] for part in (cases, promises)] for way in WAYS}
    return {way: summary(*parts) for way, parts in of.items() if all(parts)}


def summary_of_few(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """By the number of samples: the most by which estimates were too good, in dB."""
    found: dict[str, Any] = {}
    for samples in FEW_SAMPLES:
        some = [one for one in cases if one["samples"] == samples]
        too_good = {key: max(one["stated"][key] - one[key] for one in some) for key in ("psnr", "worst")}
        found[str(samples)] = too_good | {"pictures": len(some)}
    return found


def summary(cases: list[dict[str, Any]], promises: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares of the cases, and how far off the estimates were."""

    def share(found: list[dict[str, Any]], key: str) -> float:
        return round(float(np.mean([entry[key] for entry in found])), 3)

    def median_error(found: list[dict[str, Any]], key: str) -> float:
        return round(float(np.median([entry["stated"][key] - entry[key] for entry in found])), 2)

    def flattered(found: list[dict[str, Any]], key: str) -> float:
        return round(float(np.mean([entry[key] < entry["stated"][f"{key}_low"] for entry in found])), 3)

    reached = [entry for entry in promises if entry["end"] == "quality"]
    return {
        "cases": len(cases),
        "psnr_inside": share(cases, "psnr_inside"),
        "worst_inside": share(cases, "worst_inside"),
        "psnr_flattered": flattered(cases, "psnr"),
        "worst_flattered": flattered(cases, "worst"),
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
