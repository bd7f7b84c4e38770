"""Error against time: full, full denoised, pooled; and the time that each takes to the same error.

Time on two cores: an estimated 3 hours, most of them for references.

Eight scenes with path light of the default depth (the bundled six, and two glTF scenes where they are at hand) on three
displays: the paper's 64 lenses of 8 pixels, 64 lenses of 48 pixels, and 34 x 34 lenses of 15 x 15. A band of rows is
rendered, about the middle: references would take hours otherwise.

A picture p is judged by two independent references a, b of the full renderer: the mean of (p - a)(p - b), in codes,
is its squared error, free of the references' own noise. Caustics come by photons where there are any, in references
and pictures alike; photons and the look at seen light are in the pictures' time. Time is that of the processors over
their number, so that what else runs on the machine does not count; medians of three, warm. Denoised pictures are made
with either effort of Open Image Denoise, guides included, and every way counts with the better one. Where full
rendering does not come to a PSNR, its time is drawn out by the law of its noise, error times time being constant, and
the scene is named.

python benchmarks/equal_error.py [DISPLAY ...] [--scenes NAME,...] [--references FOLDER] [--reference-samples N]

References are kept in FOLDER, where one is given: they take most of the time.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from harness import kept, save, saved

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
    "array-15": ("mla-square", {"size": (510, 510)}, 150),
}
#: Samples per pixel of either reference, and of the pictures that are judged.
REFERENCE = 256
SAMPLES = (1, 4, 16, 64)
#: Runs of which the median counts, where they are shorter than this many seconds; longer ones are run once.
RUNS, SHORT = 3, 1.0
TARGETS = (35.0, 40.0)
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

T = TypeVar("T")
Point = dict[str, Any]


@dataclass
class Stage:
    """A scene before a display, ready to be traced."""

    session: Any
    integrator: Any
    source: Any
    display: Any
    display_from_world: NDArray[np.float64]

    @property
    def built(self) -> Any:
        return self.session.built


def main() -> None:
    results = saved("equal_error").get("results", {})
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--references", type=Path)
    words.add_argument("--reference-samples", type=int, default=REFERENCE)
    given, scenes = asked(words)
    for name, displays in scenes:
        for display in displays:
            samples = given.reference_samples
            file = given.references and given.references / f"{display}-{name}-{samples}.npz"
            measured = _measure(prepare(name, display, "auto"), file, samples)
            results.setdefault(display, {})[name] = {"reference_samples": samples, **measured}
            summary = {kind: _summary(measured) for kind, measured in results.items()}
            save("equal_error", {"reference_spp": 2 * REFERENCE, "results": results, "summary": summary})


def asked(words: argparse.ArgumentParser) -> tuple[argparse.Namespace, list[tuple[str, list[str]]]]:
    """The command line; and the scenes that it names, or all that are at hand, each with the displays to measure on."""
    words.add_argument("displays", nargs="*", default=list(DISPLAYS))
    words.add_argument("--scenes", default="")
    given = words.parse_args()
    from lippmann.scene import bundled

    known = [*bundled.names(), *(name for name, path in GLTF.items() if path.exists())]
    return given, [(name, given.displays) for name in (given.scenes.split(",") if given.scenes else known)]


def prepare(name: str, display_name: str, caustics: str = "paths") -> Stage:
    """The scene on the device, with the display placed in it."""
    import lippmann
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.session import open_session
    from lippmann.scene.placement import place

    optics, options, rows = DISPLAYS[display_name]
    whole = lippmann.load_display(optics)
    if "finer" in options:
        pitch = whole.panel.pixel_pitch / options["finer"]
        whole = replace(whole, panel=replace(whole.panel, pixel_pitch=pitch))
    whole = whole.resized(*options["size"])
    scene = lippmann.load_scene(GLTF.get(name, name))
    at = place(scene.bounds, whole, cameras=scene.cameras, home_camera=scene.home_camera, bounds_in=scene.bounds_in)
    display = whole if rows is None else whole.resized(whole.panel.width, rows)
    request = RenderRequest(integrator="path", caustics=caustics, pixel_filter="box")
    session = open_session(scene, request, memory=4 << 30)

    from lippmann.rendering.transport.ray_source import DisplayRays

    source = DisplayRays(display, at.world_from_display)
    integrator = session.integrator(source, at.display_from_world)
    return Stage(session, integrator, source, display, at.display_from_world)


def _measure(stage: Stage, references: Path | None, reference_samples: int) -> dict[str, Any]:
    pictures = kept(references, lambda: {"pictures": reference_pair(stage, reference_samples)})["pictures"]
    judge = Judge(stage, pictures)
    curves: dict[str, list[Point]] = {"full": [], "full + oidn": [], "pooled": []}
    for samples in SAMPLES:
        traced, picture = timed(lambda samples=samples: trace_lit(stage, samples, 3))
        curves["full"].append({"spp": samples, "seconds": traced, **judge(picture)})
        traced_for_pooled, batches = timed(lambda samples=samples: pooled_batches(stage, samples))
        for effort in ("fast", "high"):
            times = {"full + oidn": traced, "pooled": traced_for_pooled}
            _denoised(stage, judge, curves, (samples, effort), times, picture, batches)
    return {"judge_psnr": judge.own_psnr, "curves": curves, "to": _costs(curves)}


def pooled_batches(stage: Stage, samples: int) -> Any:
    """The samples of a pooled picture, as the program traces them."""
    from lippmann.rendering.film.sample_batches import BatchedRender

    request = replace(stage.session.request, method="pooled", denoise="oidn", spp=samples, seed=3)
    light_up(stage, request)
    batches = BatchedRender(stage.integrator, stage.source, seed=3, memory=4 << 30, for_denoiser=True)
    batches.add(samples)
    return batches


def _denoised(
    stage: Stage,
    judge: Judge,
    curves: dict[str, list[Point]],
    how: tuple[int, Any],
    traced: dict[str, float],
    picture: Picture,
    batches: Any,
) -> None:
    """One picture's noise taken out; and pooled light, as the program makes it: by halves, shared, beside samples."""
    from lippmann.rendering.denoise.dual_buffer import DenoisedPicture

    samples, effort = how

    def guided(shares: bool) -> Any:
        # Anew each time: a denoiser traces its guides once.
        denoiser = guided_denoiser(stage, f"oidn-{effort}", shares)
        denoiser.coverage()
        return denoiser

    looked, plain = timed(lambda: guided(False))
    sharing = guided(True)

    def pooled() -> Picture:
        return DenoisedPicture(batches, sharing, "srgb", CORES, sharing.coverage).picture()

    for way, call in (
        ("full + oidn", lambda: plain(picture, samples)),
        ("pooled", pooled),
    ):
        seconds, result = timed(call)
        parts = {"trace": traced[way], "guides": looked, "clean": seconds}
        found = {"spp": samples, "effort": effort, "seconds": sum(parts.values()), "parts": parts}
        curves[way].append({**found, **judge(result)})


def guided_denoiser(stage: Stage, kind: str, shares: bool = True) -> Any:
    """The denoiser of a pooled picture."""
    from lippmann.rendering.denoise.guided_denoiser import GuidedDenoiser

    return GuidedDenoiser(
        stage.built,
        stage.source,
        stage.display_from_world,
        box_filter=True,
        memory=4 << 30,
        threads=CORES,
        kind=kind,
        shares=shares,
    )


def timed(call: Callable[[], T]) -> tuple[float, T]:
    """Seconds of the processors over their number, by the median of warm runs, and the result."""
    seconds, result = once(call)
    if seconds > 3 * SHORT:
        return seconds, result
    runs = [once(call)[0] for _ in range(RUNS if seconds < SHORT else 1)]
    return statistics.median(runs), result


def once(call: Callable[[], T]) -> tuple[float, T]:
    started = time.process_time()
    result = call()
    return (time.process_time() - started) / CORES, result


def reference_pair(stage: Stage, samples: int) -> NDArray[np.float32]:
    """Two long pictures that know nothing of each other."""
    return np.stack([trace_lit(stage, samples, seed) for seed in (1001, 2002)])


class Judge:
    """Squared errors by two long pictures that know nothing of each other."""

    def __init__(self, stage: Stage, pictures: NDArray[np.float32]) -> None:
        from lippmann.metrics.mse_psnr import micro_image_means

        self._display, self._means = stage.display, micro_image_means
        self._references = [coded(picture) for picture in pictures]
        own = ((self._references[0] - self._references[1]) ** 2).mean() / 2
        #: PSNR of a single reference.
        self.own_psnr = _psnr(own)
        #: What the noise of both leaves in the mean of a picture's products, two deviations.
        self._least = 2 * own / math.sqrt(self._references[0][..., 0].size)

    def __call__(self, picture: Picture) -> dict[str, float]:
        errors = [coded(picture) - reference for reference in self._references]
        product = (errors[0] * errors[1]).mean(axis=2)
        lenses, _ = self._means(product, self._display)
        return {"psnr": _psnr(max(float(product.mean()), self._least)), "worst_psnr": _psnr(float(np.nanmax(lenses)))}


def coded(picture: Picture) -> NDArray[np.float64]:
    from lippmann.color.transfer import encode_srgb

    return np.asarray(encode_srgb(picture.astype(np.float64)))


def _psnr(error: float) -> float:
    return -10 * math.log10(max(error, 1e-9))


def light_up(stage: Any, request: Any, memory: int = 4 << 30) -> None:
    """What the program gives the integrator for a picture: photons of its own, where there are caustics, and chains.

    ``stage`` has the session, the integrator and the source of a :class:`Stage`.
    """
    from lippmann.rendering.preparation.prepare import prepare_light
    from lippmann.rendering.session import read_choices

    # All pictures of a stage are exposed alike.
    request = replace(request, exposure=read_choices(stage.integrator).get("exposure", 0.0))
    light = prepare_light(stage.integrator, request, stage.source, memory)
    stage.integrator = stage.integrator.lit_by(light)


def trace_lit(stage: Stage, samples: int, seed: int) -> Picture:
    """A picture of so many samples as the program makes it, caustics included."""
    light_up(stage, replace(stage.session.request, method="full", denoise="none", spp=samples, seed=seed))
    return trace_paths(stage, samples, seed)


def trace_paths(stage: Stage, samples: int, seed: int) -> Picture:
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame

    plan = cut_wavefronts(stage.source.width, stage.source.height, samples, memory=4 << 30)
    return trace_frame(stage.integrator, stage.source, plan, seed=seed).pixels


def cost_to(curve: list[Point], psnr: float, cost: str = "seconds", *, drawn_out: bool = False) -> float | None:
    """What a PSNR costs, by a straight line between points in dB and the logarithm of the cost; None if too much.

    Where even the first point is better, its own cost: less cannot be spent. ``drawn_out`` goes on from the last point
    as noise does.
    """
    best = -math.inf
    before: Point | None = None
    for point in curve:
        if point["psnr"] >= psnr:
            if before is None:
                return float(point[cost])
            along = (psnr - before["psnr"]) / (point["psnr"] - before["psnr"])
            return math.exp((1 - along) * math.log(before[cost]) + along * math.log(point[cost]))
        if point["psnr"] > best:
            best, before = point["psnr"], point
    if drawn_out and before is not None:
        return float(before[cost]) * 10 ** ((psnr - before["psnr"]) / 10)
    return None


def _costs(curves: dict[str, list[Point]]) -> dict[str, Any]:
    """Per goal and way: seconds and samples to it."""
    goals = {f"{psnr:g}": psnr for psnr in TARGETS}
    goals["best of full + oidn"] = max(point["psnr"] for point in curves["full + oidn"])
    return {goal: {way: _cheapest(way, curve, psnr) for way, curve in curves.items()} for goal, psnr in goals.items()}


def _cheapest(way: str, curve: list[Point], psnr: float) -> dict[str, Any] | None:
    """With the better of the efforts."""
    found = []
    for effort in dict.fromkeys(point.get("effort") for point in curve):
        points = [point for point in curve if point.get("effort") == effort]
        seconds, samples = (cost_to(points, psnr, cost, drawn_out=way == "full") for cost in ("seconds", "spp"))
        if seconds is not None:
            reached = max(point["psnr"] for point in points) >= psnr
            found.append({"seconds": seconds, "spp": samples, "effort": effort, "drawn_out": not reached})
    return min(found, key=lambda cost: cost["seconds"]) if found else None


def _summary(scenes: dict[str, Any]) -> dict[str, Any]:
    """Geometric means over the scenes: how many times faster pooled light is, and its share of the paths."""
    summary: dict[str, Any] = {}
    for goal in next(iter(scenes.values()))["to"]:
        for rival in ("full", "full + oidn"):
            both = {
                name: (costs[rival], costs["pooled"])
                for name, scene in scenes.items()
                if (costs := scene["to"][goal])[rival] and costs["pooled"]
            }
            if both:
                times = [theirs["seconds"] / own["seconds"] for theirs, own in both.values()]
                summary[f"pooled against {rival} to {goal}"] = {
                    "times_faster": statistics.geometric_mean(times),
                    "least": min(times),
                    "share_of_paths": statistics.geometric_mean(own["spp"] / t["spp"] for t, own in both.values()),
                    "scenes": len(both),
                    "drawn_out": [name for name, (theirs, _) in both.items() if theirs["drawn_out"]],
                    "never": [name for name, scene in scenes.items() if not scene["to"][goal]["pooled"]],
                }
    return summary


if __name__ == "__main__":
    main()
