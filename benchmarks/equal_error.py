"""Error against time: full, full denoised, pooled, pooled denoised; and the time that each takes to the same error.

Eight scenes with path light of the default depth (the bundled six, and two glTF scenes where they are at hand) on three
displays: the paper's 64 lenses of 8 pixels, 64 lenses of 48 pixels, and 34 x 34 lenses of 15 x 15. Of the lenticular
displays a band of rows is rendered, about the middle: references would take hours otherwise.

A picture p is judged by two independent references a, b of the full renderer: the mean of (p - a)(p - b), in codes,
is its squared error, free of the references' own noise; what noise remains in that mean is stated. Methods that gather
samples are asked again and again for more, and each picture on the way counts with the seconds spent so far, denoising
and guides added where they belong. Kernels are warm.

python benchmarks/equal_error.py [DISPLAY ...] [--scenes NAME,...]
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness import save, saved

Picture = NDArray[np.float32]

SHARED = Path(__file__).resolve().parents[2] / "shared" / "scenes" / "gltf"
GLTF = {
    "fancy-teapot": SHARED / "fancy_teapot" / "scene.gltf",
    "clearcoat": SHARED / "clearcoat_test" / "ClearCoatTest.gltf",
}
#: Panel (width, height), its optics, and the rows that are rendered (None: all).
DISPLAYS: dict[str, tuple[str, dict[str, Any], int | None]] = {
    "lenticular-8": ("seed-lenticular", {"size": (512, 512)}, 160),
    "lenticular-48": ("seed-lenticular", {"size": (3072, 384), "finer": 6}, 48),
    "array-15": ("mla-square", {"size": (510, 510)}, None),
}
#: Samples per pixel of either reference, and on which the others are stopped.
REFERENCE = 256
FULL = (1, 4, 16, 64)
DENOISED = (1, 4, 16, 64)
POOLED = (1, 4, 16)
#: No method spends more than this on one picture, in seconds.
MOST_SECONDS = 60.0
TARGETS = (35.0, 40.0)


@dataclass
class Stage:
    """A scene before a display, ready to be traced."""

    built: Any
    integrator: Any
    source: Any
    display: Any
    display_from_world: NDArray[np.float64]
    settings: Any


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("displays", nargs="*", default=list(DISPLAYS))
    words.add_argument("--scenes", default="")
    given = words.parse_args()
    from lippmann.scene import library

    known = [*library.names(), *(name for name, path in GLTF.items() if path.exists())]
    names = given.scenes.split(",") if given.scenes else known
    results = saved("equal_error").get("results", {})
    for display in given.displays:
        for name in names:
            results.setdefault(display, {})[name] = _measure(prepare(name, display))
            summary = {kind: _summary(scenes) for kind, scenes in results.items()}
            save("equal_error", {"reference_spp": 2 * REFERENCE, "results": results, "summary": summary})


def prepare(name: str, display_name: str) -> Stage:
    """The scene on the device, before the display."""
    from dataclasses import replace

    import lippmann
    from lippmann import engine
    from lippmann.render.pipeline import build_for, make_integrator
    from lippmann.render.rays import DisplayRays
    from lippmann.render.settings import RenderSettings
    from lippmann.scene.placement import place

    engine.start("auto")
    optics, options, rows = DISPLAYS[display_name]
    whole = lippmann.load_display(optics)
    if "finer" in options:
        pitch = whole.panel.pixel_pitch / options["finer"]
        whole = replace(whole, panel=replace(whole.panel, pixel_pitch=pitch))
    whole = whole.resized(*options["size"])
    scene = lippmann.load_scene(GLTF.get(name, name))
    at = place(scene.bounds, whole, cameras=scene.cameras, home_camera=scene.home_camera, bounds_in=scene.bounds_in)
    display = whole if rows is None else whole.resized(whole.panel.width, rows)
    settings = RenderSettings(integrator="path")
    built = build_for(scene, settings)
    integrator = make_integrator(built, settings, at.display_from_world)
    source = DisplayRays(display, at.world_from_display)
    return Stage(built, integrator, source, display, at.display_from_world, settings)


def _measure(stage: Stage) -> dict[str, Any]:
    judge = Judge(stage)
    curves = {name: list(_limited(curve(stage), judge)) for name, curve in CURVES.items()}
    return {"judge_psnr": judge.own_psnr, "curves": curves, "seconds_to": _times(curves)}


class Judge:
    """Squared errors by two references that know nothing of each other."""

    def __init__(self, stage: Stage) -> None:
        from lippmann.quality.metrics import micro_image_means

        self._display, self._means = stage.display, micro_image_means
        self._references = [coded(_reference(stage, seed)) for seed in (1001, 2002)]
        own = ((self._references[0] - self._references[1]) ** 2).mean() / 2
        #: PSNR of a single reference.
        self.own_psnr = _psnr(own)

    def __call__(self, picture: Picture) -> dict[str, float]:
        errors = [coded(picture) - reference for reference in self._references]
        product = (errors[0] * errors[1]).mean(axis=2)
        lenses, _ = self._means(product, self._display)
        return {"psnr": _psnr(float(product.mean())), "worst_psnr": _psnr(float(np.nanmax(lenses)))}


def coded(picture: Picture) -> NDArray[np.float64]:
    from lippmann.image.color import encode_srgb

    return np.asarray(encode_srgb(picture.astype(np.float64)))


def _psnr(error: float) -> float:
    return -10 * math.log10(max(error, 1e-9))


def _reference(stage: Stage, seed: int) -> Picture:
    return _trace(stage, REFERENCE, seed)


def _trace(stage: Stage, samples: int, seed: int) -> Picture:
    from lippmann.render.full import trace_frame
    from lippmann.render.plan import make_plan

    plan = make_plan(stage.source.width, stage.source.height, samples, memory=4 << 30)
    return trace_frame(stage.integrator, stage.source, plan, seed=seed).pixels


def _full(stage: Stage) -> Iterator[tuple[int, float, float, Picture]]:
    """Samples, seconds, share of paths traced, picture."""
    _trace(stage, FULL[0], 0)
    for samples in FULL:
        _trace(stage, samples, 7)  # a new length of run has a kernel of its own
        started = time.perf_counter()
        picture = _trace(stage, samples, 3)
        yield samples, time.perf_counter() - started, 1.0, picture


def _full_denoised(stage: Stage) -> Iterator[tuple[int, float, float, Picture]]:
    """The better form of the two is the rival: raw, unless views are asked for and better."""
    denoise = _denoiser(stage)
    for samples, seconds, share, picture in _full(stage):
        if samples in DENOISED:
            started = time.perf_counter()
            cleaned = denoise(picture, samples)
            yield samples, seconds + time.perf_counter() - started, share, cleaned


def _denoiser(stage: Stage) -> Callable[[Picture, int], Picture]:
    from lippmann.render.denoise_views import denoise_views
    from lippmann.render.guides import plan_guides, trace_guides

    def clean(picture: Picture, samples: int) -> Picture:
        plan = plan_guides(stage.source, samples, 4 << 30)
        guides = trace_guides(stage.built, stage.source, plan, stage.display_from_world)
        return np.maximum(denoise_views(picture, stage.display, guides), 0)

    clean(np.zeros((stage.source.height, stage.source.width, 3), np.float32), 1)
    return clean


def _limited(curve: Iterator[tuple[int, float, float, Picture]], judge: Judge) -> Iterator[dict[str, float]]:
    for samples, seconds, share, picture in curve:
        yield {"spp": samples, "seconds": seconds, "traced": share, **judge(picture)}
        if seconds > MOST_SECONDS:
            return


def _pooled(stage: Stage, denoised: bool = False) -> Iterator[tuple[int, float, float, Picture]]:
    from lippmann.render.denoise_views import denoise_views
    from lippmann.render.guides import Guides
    from lippmann.render.pooled.renderer import Pooled

    def clean(color: Picture, albedo: Picture, normal: Picture) -> Picture:
        return np.maximum(denoise_views(color, stage.display, Guides(albedo, normal), effort="fast"), 0)

    def made(samples: int) -> tuple[float, Picture]:
        started = time.perf_counter()
        path = stage.integrator
        denoiser = clean if denoised else None
        pooled = Pooled(path.scene, path.traits, path.depth, stage.source, seed=3, denoiser=denoiser)
        pooled.add(samples)
        picture = pooled.picture()
        return time.perf_counter() - started, picture

    made(1)
    for samples in POOLED:
        seconds, picture = made(samples)
        yield samples, seconds, 1.0, picture


def _pooled_denoised(stage: Stage) -> Iterator[tuple[int, float, float, Picture]]:
    yield from _pooled(stage, denoised=True)


CURVES: dict[str, Callable[[Stage], Iterator[tuple[int, float, float, Picture]]]] = {
    "full": _full,
    "full + oidn": _full_denoised,
    "pooled": _pooled,
    "pooled + oidn": _pooled_denoised,
}


def seconds_to(curve: list[dict[str, float]], psnr: float) -> float | None:
    """Seconds to a PSNR, by a straight line between points in dB and log seconds; None if it is not reached.

    Where even the first point is better, its own seconds: fewer cannot be spent.
    """
    best = -math.inf
    before = None
    for point in curve:
        if point["psnr"] >= psnr:
            if before is None:
                return point["seconds"]
            along = (psnr - before["psnr"]) / (point["psnr"] - before["psnr"])
            return math.exp((1 - along) * math.log(before["seconds"]) + along * math.log(point["seconds"]))
        if point["psnr"] > best:
            best, before = point["psnr"], point
    return None


def _times(curves: dict[str, list[dict[str, float]]]) -> dict[str, dict[str, float | None]]:
    found = {f"{psnr:g}": {name: seconds_to(curve, psnr) for name, curve in curves.items()} for psnr in TARGETS}
    best = max(point["psnr"] for point in curves["full + oidn"])
    found["best of full + oidn"] = {name: seconds_to(curve, best) for name, curve in curves.items()}
    return found


def _summary(scenes: dict[str, Any]) -> dict[str, Any]:
    """Geometric means over the scenes of how many times faster the pooled ways are."""
    summary: dict[str, Any] = {}
    for goal in next(iter(scenes.values()))["seconds_to"]:
        for rival in ("full", "full + oidn"):
            for ours in ("pooled", "pooled + oidn"):
                ratios = []
                for scene in scenes.values():
                    times = scene["seconds_to"][goal]
                    if times.get(ours) and times.get(rival):
                        ratios.append(times[rival] / times[ours])
                if ratios:
                    summary[f"{ours} against {rival} to {goal}"] = {
                        "times_faster": statistics.geometric_mean(ratios),
                        "least": min(ratios),
                        "scenes": len(ratios),
                    }
    return summary


if __name__ == "__main__":
    main()
