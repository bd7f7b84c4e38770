"""Where the time of a path goes, per scene: rays, emitters, surfaces, photons; and how full the processor's lanes are.

Time on two cores: an estimated quarter of an hour.

Paths of the default depth, four samples of each pixel of 160 rows of the paper's display, as the program traces them.
Each part is left out in turn from the kernel, and what that saves is its share: shadow rays (every sampled emitter is
taken to be visible), evaluating surfaces for sampled emitters, sampling emitters at all, look-ups of photons. Rays to
the next surface are timed by themselves, along random walks of as many surfaces. What remains is sampling of surfaces,
random numbers and bookkeeping. Parts overlap in a processor, so that shares are good to some hundredths.

*Lanes at work*: a vector unit goes on until the longest of its 16 paths has ended; the share of its lanes that have
still something to do.

*Before*: pixels in the order of rows (:mod:`lippmann.rendering.film.wavefront`), look-ups of all photons about a
point by every sample (``photons_of_cell`` of :mod:`lippmann.rendering.transport.tuning`), and photons in NumPy's
memory, whose rows cannot be fetched at once (:mod:`lippmann.device.kernel_ops`).

python benchmarks/kernel_profile.py [--scenes NAME,...]

Nanoseconds of a processor per path, medians of interleaved runs.
"""

from __future__ import annotations

import argparse
import copy
import statistics
from contextlib import nullcontext
from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np

from equal_error import CORES, Stage, asked, once, prepare
from harness import save, saved

SAMPLES, RUNS, LANES = 4, 7, 16
DISPLAY = "lenticular-8"


def main() -> None:
    _, scenes = asked(
        argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    )
    results = saved("kernel_profile").get("scenes", {})
    for name, _ in scenes:
        results[name] = profile(prepare(name, DISPLAY, caustics="auto"))
        ratios = [found["before"] / found["nanoseconds"] for found in results.values()]
        mean = statistics.geometric_mean(ratios)
        save("kernel_profile", {"samples": SAMPLES, "scenes": results, "times_faster": mean})


def profile(stage: Stage) -> dict[str, Any]:
    kernels = _kernels(stage)
    seconds: dict[str, list[float]] = {name: [] for name in kernels}
    for run in range(RUNS + 1):
        for name, call in kernels.items():
            spent, lanes = once(lambda c=call, r=run: c(r))
            if run:  # the first compiles
                seconds[name].append(spent * CORES * 1e9 / len(lanes))
    median = {name: statistics.median(found) for name, found in seconds.items()}
    whole = median["whole"]
    surfaces = np.asarray(kernels["whole"](0)) + 1
    packets = surfaces[: len(surfaces) // LANES * LANES].reshape(-1, LANES)
    saved_by = {part: whole - median[part] for part in median if part not in ("whole", "before", "walks")}
    rays_of_walk = 1 + float(np.asarray(kernels["walks"](0)).mean())
    parts = {
        "shadow rays": saved_by["shadow rays"],
        "surfaces evaluated": saved_by["evaluation"] - saved_by["shadow rays"],
        "emitters sampled": saved_by["emitters"] - saved_by["evaluation"],
        "rays to surfaces": median["walks"] / rays_of_walk * float(surfaces.mean()),
    }
    if "photons" in saved_by:
        parts["photons looked up"] = saved_by["photons"]
    parts["rest"] = whole - sum(parts.values())
    return {
        "nanoseconds": whole,
        "before": statistics.median(b / w for b, w in zip(seconds["before"], seconds["whole"], strict=True)) * whole,
        "parts": {part: max(0.0, value) for part, value in parts.items()},
        "surfaces_per_path": float(surfaces.mean()),
        "lanes_at_work": float(surfaces.mean() / packets.max(axis=1).mean()),
    }


def _kernels(stage: Stage) -> dict[str, Any]:
    """By name, what traces all paths with a seed, and gives the surfaces behind the first of each."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.film import wavefront
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import lay_out_wavefront
    from lippmann.rendering.transport import path, path_techniques

    source, paths = stage.source, stage.integrator
    plan = cut_wavefronts(source.width, source.height, SAMPLES, memory=4 << 30)
    tile, run = next(iter(plan))

    class Unshadowed(path.PathIntegrator):
        def visibility(self, si: Any, ds: Any, active: Any) -> Any:
            return dr.select(active, mi.Spectrum(1), 0), dr.select(active, mi.UInt32(1), 0)

    class Unevaluated(Unshadowed):
        def direct_light(self, si: Any, bsdf: Any, point: Any, active: Any, *_: Any) -> Any:
            ds, light = self.light_sampler.sample_direction(si, point, active)
            return dr.select(active, light * 1e-3, 0), ds, mi.UInt32(0)

    class Unlit(path.PathIntegrator):
        def direct_light(self, si: Any, bsdf: Any, point: Any, active: Any, *_: Any) -> Any:
            return mi.Spectrum(0), dr.zeros(mi.DirectionSample3f), mi.UInt32(0)

    def alike(kind: type[path.PathIntegrator]) -> path.PathIntegrator:
        return kind(paths.scene, paths.features, paths.depth, light=paths.light)

    tuning = path_techniques.TUNING
    usual = tuning.photons_of_cell

    def traced(integrator: path.PathIntegrator, most: int = usual, in_rows: bool = False, is_dark: bool = False) -> Any:
        def call(seed: int) -> Any:
            path_techniques.TUNING = replace(tuning, photons_of_cell=most)
            with mock.patch.object(wavefront, "in_strips", return_value=0) if in_rows else nullcontext():
                pixels, stream = lay_out_wavefront(source, plan, tile, run, seed, True)
            with (
                mock.patch.object(path_techniques.PhotonGathering, "arrive", path_techniques.Technique.arrive)
                if is_dark
                else nullcontext()
            ):
                radiance, counts = integrator.sample(pixels.ray(stream), stream, mi.Bool(True))
            dr.eval(radiance, counts.secondary, counts.shadow)
            return np.array(counts.secondary)

        return call

    def step(ray: Any, stream: Any, active: Any, steps: Any, way: Any, pi: Any) -> Any:
        si = pi.compute_surface_interaction(ray)
        wo = mi.warp.square_to_cosine_hemisphere(stream.next_2d(steps))
        ray = si.spawn_ray(si.to_world(mi.Vector3f(wo.x, wo.y, wo.z * dr.sign(si.wi.z))))
        steps += 1
        active &= si.is_valid() & (steps <= dr.opaque(mi.UInt32, paths.depth))
        pi = paths.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        return ray, stream, active, steps, way + si.t, pi

    def walk(ray: Any, stream: Any) -> Any:
        pi = paths.scene.ray_intersect_preliminary(ray, coherent=True, active=mi.Bool(True))
        state = (ray, stream, mi.Bool(True), mi.UInt32(0), mi.Float(0), pi)
        *_, steps, way, _ = dr.while_loop(state, lambda *now: now[2], step, label="walk")
        return way, steps

    def walks(seed: int) -> Any:
        pixels, stream = lay_out_wavefront(source, plan, tile, run, seed, True)
        way, steps = walk(pixels.ray(stream), stream)
        dr.eval(way, steps)
        return np.array(steps) - 1

    light = paths.light
    if light.photons is not None:
        light = replace(light, photons=_unaligned(light.photons))
    before = path.PathIntegrator(paths.scene, paths.features, paths.depth, light=light)
    kernels = {
        "whole": traced(paths),
        "before": traced(before, most=1 << 31, in_rows=True),
        "shadow rays": traced(alike(Unshadowed)),
        "evaluation": traced(alike(Unevaluated)),
        "emitters": traced(alike(Unlit)),
        "walks": walks,
    }
    if paths.light.photons is not None:
        kernels["photons"] = traced(paths, is_dark=True)
    return kernels


def _unaligned(photons: Any) -> Any:
    """The same photons in tables that lie in NumPy's memory, one number off."""
    other = copy.copy(photons)
    for name in ("_start", "_position", "_normal", "_toward", "_power_and_surfaces"):
        table = getattr(photons, name)
        values = np.array(table)
        moved = np.empty(len(values) + 1, values.dtype)[1:]
        moved[:] = values
        setattr(other, name, type(table)(moved))
    return other


if __name__ == "__main__":
    main()
