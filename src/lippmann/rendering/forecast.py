"""What a picture will take and show, told beforehand: depth, blur, rays, memory and time, by rendering a few pixels.

The pixels of the probe are drawn at random in short runs, so that neighbouring rays stay neighbours, and traced with
the picture's own settings in ever larger wavefronts for about two seconds. What they took is carried over to all.
"""

from __future__ import annotations

import itertools
import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.estimate.psnr import why_no_estimate
from lippmann.rendering.film.wavefront_plan import BYTES_PER_LANE, BYTES_PER_PIXEL, make_plan
from lippmann.rendering.picture import (
    Stopwatch,
    build_for,
    default_memory,
    make_integrator,
    scene_notes,
    traced_window,
    transfer_of,
)
from lippmann.rendering.request.resolve import decide
from lippmann.rendering.request.settings import RenderSettings
from lippmann.runtime import engine as engines
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.placement import Placement, PlacementOptions, place
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic
    from lippmann.rendering.transport.ray_source import DisplayRays, WindowRays

#: Seconds that the probe traces for, compiling aside.
PROBE_SECONDS = 2.0

#: Pixels of the probe, and how many lie side by side in a run.
_PIXELS, _RUN = 1 << 14, 16
#: Samples per pixel after which each takes as many rays as the one before: the first of either stream sample more light.
_STEADY_SAMPLES = 16
#: Lanes beyond which a wavefront gets no faster.
_ENOUGH_LANES = 1 << 20
#: Bytes per pixel that Open Image Denoise and its guides take, up to the most that the library lets itself have.
_DENOISE_BYTES, _DENOISE_MOST = 600, 3 << 30


@dataclass(frozen=True)
class Forecast:
    """What rendering a scene for a display will take.

    Attributes
    ----------
    size:
        Width and height in pixels.
    spp:
        Samples per pixel, or per sub-pixel where these have rays of their own.
    depth_range, resolvable_range:
        Lowest and highest z of the scene and of what the display resolves, in mm of the display frame.
    blur:
        Over how many lens pitches one pixel's light spreads at either end of the depth range; up to 1 is resolved.
    blurred_share:
        Share of the pixels that see a surface beyond what the display resolves.
    rays:
        By kind: ``primary`` are counted, ``shadow`` and ``secondary`` carried over from the probe.
    memory:
        Bytes: ``expected`` at the peak, program and scene included, and the ``limit`` that the picture keeps to.
    seconds:
        By stage: ``load`` and ``build`` as they were, ``trace`` and ``denoise`` as foreseen, ``total``; writing the
        file is not in it.
    probe:
        ``samples`` that were traced, and ``seconds`` that they took.
    notes:
        One line each: what will be blurred, cut or outside, and what reader and builder had to say.
    """

    display: str
    size: tuple[int, int]
    subpixels: bool
    spp: int
    placement: str
    depth_range: tuple[float, float]
    resolvable_range: tuple[float, float]
    blur: tuple[float, float]
    blurred_share: float
    rays: dict[str, int]
    memory: dict[str, int]
    seconds: dict[str, float]
    probe: dict[str, float]
    device: str
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """All of it as plain values for JSON."""
        return {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(self).items()}


@exclusive()
def forecast(
    scene: Scene,
    display: Display,
    settings: RenderSettings,
    placement_options: PlacementOptions,
    progress: ProgressCallback = silent,
) -> Forecast:
    """Foresee what ``full`` with ``settings`` will take; nothing but the probe is rendered.

    Raises
    ------
    UsageError, SceneError, MemoryLimitError, EngineError
        Those that rendering would raise before its first ray.
    """
    watch = Stopwatch(progress)
    settings = decide(settings).settings
    limit = settings.memory or default_memory()
    width, height = display.panel.width, display.panel.height
    channels = 3 if settings.subpixels else 1
    make_plan(width, height, 1, channels=channels, memory=limit)
    engine = watch.stage("load", lambda: engines.start(settings.device, settings.threads))
    built = watch.stage("build", lambda: build_for(scene, settings))
    at = place(
        scene.bounds,
        display,
        cameras=scene.cameras,
        options=placement_options,
        home_camera=scene.home_camera,
        bounds_in=scene.bounds_in,
    )

    from lippmann.rendering.transport.ray_source import DisplayRays, WindowRays

    whole = DisplayRays(display, at.world_from_display, settings.subpixels)
    window = traced_window(built, display, settings, at)
    source = whole if window is None else WindowRays(whole, window)
    probe = _Probe(source, settings.seed)
    samples = source.width * source.height * channels * settings.samples
    integrator = watch.stage("build", lambda: make_integrator(built, settings, at.display_from_world, whole))
    found = probe.trace(integrator, settings, limit, progress)
    seconds = {
        "load": watch.seconds["load"],
        "build": watch.seconds["build"],
        "trace": found.compile + samples * found.seconds_per_sample,
    }
    if settings.denoises:
        seconds["denoise"] = _denoise_seconds(built, source, at, settings, engine.threads, found, limit)
    seconds["total"] = sum(seconds.values())
    per_pixel = display.panel.pixel_pitch / display.gap / display.lens_array.pitch
    return Forecast(
        display=display.name,
        size=(width, height),
        subpixels=settings.subpixels,
        spp=settings.samples,
        placement=at.mode,
        depth_range=at.depth_range,
        resolvable_range=at.resolvable_range,
        blur=(abs(at.depth_range[0]) * per_pixel, abs(at.depth_range[1]) * per_pixel),
        blurred_share=probe.share_beyond(built, at, limit) * source.width * source.height / (width * height),
        rays={"primary": samples, **{kind: round(samples * share) for kind, share in found.rays.items()}},
        memory={
            "expected": _resident() + width * height * BYTES_PER_PIXEL + _working_bytes(source, settings, limit),
            "limit": limit,
        },
        seconds=seconds,
        probe={"samples": found.samples, "seconds": found.seconds},
        device=engine.gpu_name or f"cpu, {engine.threads} threads",
        notes=(*scene_notes(scene, built), *at.warnings),
    )


@dataclass(frozen=True)
class _Found:
    """What the probe took; ``rays`` per sample, by kind."""

    samples: int
    seconds: float
    compile: float
    seconds_per_sample: float
    rays: dict[str, float]


class _Probe:
    """Runs of pixels of a source, as a picture of their own."""

    channels: int

    def __init__(self, source: DisplayRays | WindowRays, seed: int) -> None:
        import mitsuba as mi

        self._source = source
        self.channels = source.channels
        run = min(_RUN, source.width)
        count = max(1, min(_PIXELS, source.width * source.height) // run)
        random = np.random.default_rng(seed)
        first = random.integers(0, source.width - run + 1, count)
        columns = first[:, None] + np.arange(run)
        rows = np.repeat(random.integers(0, source.height, count), run)
        self.width, self.height = run, count
        self._columns, self._rows = mi.UInt32(columns.ravel()), mi.UInt32(rows)

    def rays(self, column: Any, row: Any, channel: Any, jitter: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        place = row * self.width + column
        column, row = (dr.gather(mi.UInt32, values, place) for values in (self._columns, self._rows))
        return self._source.rays(column, row, channel, jitter)

    def trace(self, integrator: Any, settings: RenderSettings, memory: int, progress: ProgressCallback) -> _Found:
        """Sample the pixels again and again, each time with twice as many samples, until the time is up."""
        from lippmann.rendering.film.sample_batches import STREAMS, FullInBatches

        batches = FullInBatches(
            integrator,
            self,
            seed=settings.seed,
            box_filter=settings.pixel_filter == "box",
            transfer=transfer_of(settings),
            memory=memory,
        )
        pixels = self.width * self.height * self.channels
        # Twice the same: the first compiles.
        batches.add(STREAMS)
        compiled, samples, spent, last = batches.seconds_compile, STREAMS, 0.0, 0.0
        count, done = STREAMS, 0
        rays = {kind: [(0, 0)] for kind in ("shadow", "secondary")}

        def count_rays() -> None:
            for kind, counts in rays.items():
                counts.append((samples, getattr(batches.rays, kind)))

        count_rays()
        while spent < PROBE_SECONDS or samples < min(settings.samples, _STEADY_SAMPLES):
            started = time.perf_counter()
            batches.add(count)
            last = (time.perf_counter() - started) / (count * pixels)
            spent += last * count * pixels
            samples += count
            done += count
            count_rays()
            progress(Progress("probe", min(spent, PROBE_SECONDS), PROBE_SECONDS))
            if 2 * count * pixels <= _ENOUGH_LANES:
                count *= 2
        number = settings.samples * pixels
        shares = {kind: _count_at(settings.samples, counts) / number for kind, counts in rays.items()}
        return _Found(done * pixels, spent, compiled, last, shares)

    def share_beyond(self, built: BuiltScene | BuiltClassic, at: Placement, memory: int) -> float:
        """Share of the pixels whose middle sees a surface that the display does not resolve."""
        from lippmann.rendering.film.aov import plan_layers, trace_layers

        depth = trace_layers(built, self, plan_layers(self, memory), at.display_from_world)["depth"]
        far, near = at.resolvable_range
        seen: NDArray[np.bool_] = np.isfinite(depth) & ((depth < far) | (depth > near))
        return float(seen.mean())


def _count_at(samples: int, counts: list[tuple[int, int]]) -> float:
    """A running count at ``samples``, linear between the ``(samples, count)`` given and beyond the last two."""
    for (low, below), (high, above) in itertools.pairwise(counts):
        if samples <= high:
            break
    return below + (samples - low) * (above - below) / (high - low)


def _denoise_seconds(
    built: BuiltScene | BuiltClassic,
    source: DisplayRays | WindowRays,
    at: Placement,
    settings: RenderSettings,
    threads: int,
    found: _Found,
    memory: int,
) -> float:
    from lippmann.rendering.denoise.cost_model import effort_of, traced_work
    from lippmann.rendering.denoise.guided_denoiser import GuidedDenoiser
    from lippmann.rendering.denoise.oidn import load_denoiser
    from lippmann.rendering.transport.ray_source import SubpixelRays

    load_denoiser()
    traced = SubpixelRays(source) if settings.keeps_colors(source.display) else source
    rays_per_pixel = traced.channels * settings.samples * traced_work(1, found.rays["shadow"], found.rays["secondary"])
    denoiser = GuidedDenoiser(
        built,
        traced,
        at.display_from_world,
        seed=settings.seed,
        box_filter=settings.pixel_filter == "box",
        memory=memory,
        threads=threads,
        effort=lambda: effort_of(settings.denoise, rays_per_pixel),
    )
    return denoiser.probe()


def _working_bytes(source: DisplayRays | WindowRays, settings: RenderSettings, limit: int) -> int:
    """What batches, wavefront and denoiser take at the peak, see :mod:`~lippmann.rendering.film.sample_batches`."""
    from lippmann.rendering.film.sample_batches import MOST_BATCHES, bytes_per_pixel

    pixels = source.width * source.height * (3 if settings.keeps_colors(source.display) else 1)
    lanes = make_plan(source.width, source.height, settings.samples, channels=source.channels, memory=limit).lanes
    wave = lanes * BYTES_PER_LANE
    if why_no_estimate(settings) is not None:
        kept = 0
    elif settings.denoises:
        kept = pixels * bytes_per_pixel(MOST_BATCHES)
    else:
        # Batches are kept for a band of rows only, of half of what the picture leaves.
        left = limit - pixels * (BYTES_PER_PIXEL + 8)
        kept = min(pixels * bytes_per_pixel(MOST_BATCHES), max(0, left) // 2)
    if settings.denoises:
        kept += min(pixels * _DENOISE_BYTES, _DENOISE_MOST)
    return min(kept + wave, limit)


def _resident() -> int:
    """Bytes of memory that this process holds now."""
    import psutil

    return int(psutil.Process().memory_info().rss)
