"""Forecast of a picture: its depth, blur, rays, memory and time, from a few rendered pixels.

The pixels of the probe are drawn at random in short runs, so that neighbouring rays stay neighbours, and traced with
the picture's own settings in ever larger wavefronts for about two seconds. Their cost is extrapolated to all pixels.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.view_cone import cone_in_words, depth_gain_of_fused_cone, view_cone
from lippmann.optics.proof import Proof, prove
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.film import memory_model
from lippmann.rendering.film.memory_model import cut_wavefronts
from lippmann.rendering.picture import describe_lens_gap, find_window
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.preconditions import explain_missing_estimate
from lippmann.rendering.request.render_request import RenderRequest, format_value
from lippmann.rendering.session import Session, open_session, read_choices
from lippmann.runtime.engine_lock import exclusive
from lippmann.runtime.machine import amount_in_words, resident_memory
from lippmann.scene.placement import Placement, comfort_in_words
from lippmann.scene.scene import Scene
from lippmann.wording import depths_in_words, duration_in_words, html_table, samples_in_words

if TYPE_CHECKING:
    from lippmann.display.panel import PixelWindow
    from lippmann.rendering.transport.integrator import Integrator
    from lippmann.rendering.transport.ray_source import DisplayRays

#: Seconds that the probe traces for, compiling aside.
PROBE_SECONDS = 2.0


@dataclass(frozen=True)
class Forecast:
    """What rendering a scene for a display will take.

    Attributes
    ----------
    scene, display:
        Their names.
    size:
        Width and height in pixels.
    frames:
        Number of frames; ``rays`` and ``seconds`` are of all of them, the rest is of each.
    spp:
        Samples per pixel, or per sub-pixel where these have rays of their own.
    depth_range, depth_budget:
        Lowest and highest z of the scene and of what the display records and resolves, in mm of the display frame.
    view_cone, fused_gain:
        Degrees over which an eye sees the display's own views; how many times as much depth the same panel would
        resolve in :data:`lippmann.display.view_cone.FUSED_CONE`.
    comfort:
        Disparity at either end of the depth range from the viewing distance, in words; empty if that is infinite.
    blur:
        Over how many lens pitches one pixel's light spreads at either end of the depth range; up to 1 is resolved.
    blurred_share:
        Share of the pixels that see a surface beyond what the display resolves.
    rays:
        By kind: ``primary`` are counted, ``shadow`` and ``secondary`` extrapolated from the probe.
    memory:
        Bytes: ``expected`` at the peak, program and scene included, and the ``limit`` that the picture keeps to.
    seconds:
        By stage: ``load`` and ``build`` as they were, ``trace`` and ``denoise`` as foreseen, ``total``; writing the
        file is not in it.
    plan:
        Value and reason of all that is decided before the first sample, by name; ``window`` is what is traced of the
        picture, ``wavefronts`` how many there are.
    probe:
        ``samples`` that were traced, and ``seconds`` that they took.
    proof:
        What the display's lenses will show, see :func:`lippmann.optics.proof.prove`; None where it gives none.
    notes:
        One line each: what will be blurred, cut or outside, and what reader and builder had to say.
    """

    scene: str
    display: str
    size: tuple[int, int]
    frames: int
    subpixels: bool
    spp: int
    placement: str
    depth_range: tuple[float, float]
    depth_budget: tuple[float, float]
    view_cone: float
    fused_gain: float
    comfort: str
    blur: tuple[float, float]
    blurred_share: float
    rays: dict[str, int]
    memory: dict[str, int]
    seconds: dict[str, float]
    plan: dict[str, dict[str, object]]
    probe: dict[str, float]
    device: str
    proof: Proof | None
    notes: tuple[str, ...]

    def in_words(self) -> dict[str, str]:
        """The rows of a table for people: names and texts."""
        width, height = self.size
        of_frames = f", {self.frames} frames" if self.frames > 1 else ""
        of_subpixels = ", a ray for every sub-pixel" if self.subpixels else ""
        stages = ", ".join(f"{stage} {duration_in_words(s)}" for stage, s in self.seconds.items() if stage != "total")
        proof = {} if self.proof is None else self.proof.in_words()
        return {
            "picture": f"{self.scene} for {self.display}, {width}x{height} pixels{of_frames}{of_subpixels}",
            "scene": depths_in_words(*self.depth_range),
            "resolved": f"{depths_in_words(*self.depth_budget)}, {cone_in_words(self.view_cone, self.fused_gain)}",
            **({"comfort": self.comfort} if self.comfort else {}),
            "blur": f"{100 * self.blurred_share:.0f} % of the pixels see what lies beyond; "
            f"a pixel's light spreads over {self.blur[0]:.1f} lenses at the back, {self.blur[1]:.1f} at the front",
            **{name: proof[name] for name in ("crosstalk", "advice") if name in proof},
            "rays": f"{self.rays['primary'] / 1e6:.1f} M from pixels ({samples_in_words(self.spp, 'each')}), "
            f"about {(self.rays['shadow'] + self.rays['secondary']) / 1e6:.1f} M more",
            "memory": f"about {amount_in_words(self.memory['expected'])}, "
            f"with a limit of {amount_in_words(self.memory['limit'])} for the picture",
            "time": f"about {duration_in_words(self.seconds['total'])} on {self.device} ({stages})",
            **{name: f"{format_value(each['value'])} ({each['reason']})" for name, each in self.plan.items()},
        }

    def _repr_html_(self) -> str:
        """The table of :meth:`in_words` for notebooks, with the notes below."""
        notes = {f"note {number}": note for number, note in enumerate(self.notes, start=1)}
        return html_table("Forecast", {**self.in_words(), **notes})

    def to_dict(self) -> dict[str, object]:
        """All of it as plain values for JSON."""
        values = asdict(replace(self, proof=None))
        proof = None if self.proof is None else self.proof.to_dict()
        return {**{name: list(v) if isinstance(v, tuple) else v for name, v in values.items()}, "proof": proof}


@exclusive()
def forecast(
    scene: Scene,
    display: Display,
    request: RenderRequest,
    progress: ProgressCallback = silent,
    *,
    frames: int = 1,
    size: tuple[int, int] | None = None,
) -> Forecast:
    """Estimate the cost of rendering ``scene`` for ``display``; only the probe is rendered.

    Several similar ``frames``, such as those of a turntable, compile their kernels once and take all other costs each.
    ``size`` is that of an eye-tracked monitor's pair, by default its own.

    Raises
    ------
    UsageError, SceneError, MemoryLimitError, EngineError
        Those that rendering would raise before its first ray.
    """
    width, height = display.panel.width, display.panel.height
    if size is None:
        size = (width if display.stereo is None else display.stereo.panels * width, height)
    request = resolve(request, scene, display, "forecast", size=size)
    session = open_session(scene, request, (width, height), progress=progress)
    placement = session.place(display)

    from lippmann.rendering.methods import Job

    whole = session.rays(display, placement)
    window = find_window(session, display, placement)
    source = whole if window is None else whole.of_window(window)
    probe = _Probe(source, request.seed)
    panels = size[0] * size[1] / (width * height)
    samples = round(panels * source.width * source.height) * request.channels * request.samples
    integrator = session.integrator(whole, placement.display_from_world, placement.exposure)
    probed = probe.trace(integrator, session)
    seconds = {
        "load": session.watch.seconds["load"],
        "build": frames * session.watch.seconds["build"],
        "trace": probed.compile + frames * samples * probed.seconds_per_sample,
    }
    if request.denoises:
        job = Job(session, integrator, source, placement.display_from_world)
        seconds["denoise"] = frames * panels * job.denoiser.probe(request.samples)
    seconds["total"] = sum(seconds.values())
    per_pixel = 0.0 if display.stereo else display.panel.pixel_pitch / display.gap / display.lens_array.pitch
    share_beyond = probe.share_beyond(session, placement) * source.width * source.height / (width * height)
    return Forecast(
        scene=scene.name,
        display=display.name,
        size=size,
        frames=frames,
        subpixels=bool(request.subpixels),
        spp=request.samples,
        placement=placement.mode,
        depth_range=placement.depth_range,
        depth_budget=placement.depth_budget,
        view_cone=view_cone(display),
        fused_gain=depth_gain_of_fused_cone(display),
        comfort=comfort_in_words(display, *placement.depth_range),
        blur=(abs(placement.depth_range[0]) * per_pixel, abs(placement.depth_range[1]) * per_pixel),
        blurred_share=share_beyond,
        rays={
            "primary": frames * samples,
            **{kind: round(frames * samples * share) for kind, share in probed.rays.items()},
        },
        memory={
            "expected": resident_memory()
            + min(size[0] * size[1] * memory_model.PICTURE + _working_bytes(source, session), session.memory),
            "limit": session.memory,
        },
        seconds=seconds,
        plan=_list_choices(session, integrator, source, window),
        probe={"samples": probed.samples, "seconds": probed.seconds},
        device=session.engine.gpu_name or f"cpu, {session.engine.threads} threads",
        proof=None if display.lens is None else prove(display),
        notes=(*session.notes, *placement.warnings, *describe_lens_gap(display)),
    )


def _list_choices(
    session: Session, integrator: Integrator, source: DisplayRays, window: PixelWindow | None
) -> dict[str, dict[str, object]]:
    """Values and reasons of all choices by name, with the pilot's, the traced window and the wavefronts."""
    request = session.request
    assert request.plan is not None
    plan = request.plan.with_pilot(read_choices(integrator)).to_dict()
    if window is None:
        traced: dict[str, object] = {"value": "all pixels", "reason": "the picture's every pixel is traced"}
    else:
        place = f"{window.width}x{window.height} pixels at {window.left},{window.top}"
        traced = {"value": place, "reason": "no others see the scene's box; the background is of one colour"}
    waves = cut_wavefronts(
        source.width, source.height, request.samples, channels=source.channels, memory=session.memory
    )
    number = len(waves.tiles) * len(waves.passes)
    reason = f"up to {waves.lanes} samples each, as the memory and the caches hold"
    return {**plan, "window": traced, "wavefronts": {"value": number, "reason": reason}}


@dataclass(frozen=True)
class _ProbeResult:
    """Cost of the probe; ``rays`` per sample, by kind."""

    samples: int
    seconds: float
    compile: float
    seconds_per_sample: float
    rays: dict[str, float]


class _Probe:
    """Times the samples of randomly chosen pixels of a picture, in runs of neighbours."""

    def __init__(self, source: DisplayRays, seed: int) -> None:
        from lippmann.rendering.transport.ray_source import ChosenRays

        run = min(16, source.width)
        count = max(1, min(1 << 14, source.width * source.height) // run)
        random = np.random.default_rng(seed)
        first = random.integers(0, source.width - run + 1, count)
        columns = first[:, None] + np.arange(run)
        rows = random.integers(0, source.height, count)
        self._pixels = ChosenRays(source, columns, np.broadcast_to(rows[:, None], columns.shape))

    def trace(self, integrator: Integrator, session: Session) -> _ProbeResult:
        """Sample the pixels again and again, each time with twice as many samples, until the time is up."""
        from lippmann.rendering.film.batched_picture import STREAMS
        from lippmann.rendering.film.sample_batches import BatchedRender

        request, progress = session.request, session.watch.progress
        batches = BatchedRender(
            integrator,
            self._pixels,
            seed=request.seed,
            box_filter=request.box_filter,
            coding=request.coding,
            memory=session.memory,
        )
        pixels = self._pixels.width * self._pixels.height * self._pixels.channels
        # A round that compiles; its time does not count.
        batches.add(STREAMS)
        compiled, samples, spent, last = batches.seconds_compile, STREAMS, 0.0, 0.0
        count, done = STREAMS, 0
        rays = {kind: [(0, 0)] for kind in ("shadow", "secondary")}

        def count_rays() -> None:
            for kind, counts in rays.items():
                counts.append((samples, getattr(batches.rays, kind)))

        count_rays()
        # The first samples of a pixel sample more emitters; from the 16th on all take equally many rays.
        while spent < PROBE_SECONDS or samples < min(request.samples, 16):
            started = time.perf_counter()
            batches.add(count)
            last = (time.perf_counter() - started) / (count * pixels)
            spent += last * count * pixels
            samples += count
            done += count
            count_rays()
            progress(Progress("probe", min(spent, PROBE_SECONDS), PROBE_SECONDS))
            if 2 * count * pixels <= memory_model.PREFERRED_LANES:
                count *= 2
        number = request.samples * pixels
        shares = {kind: _count_at(request.samples, counts) / number for kind, counts in rays.items()}
        return _ProbeResult(done * pixels, spent, compiled, last, shares)

    def share_beyond(self, session: Session, placement: Placement) -> float:
        """Share of the pixels whose middle sees a surface that the display does not resolve."""
        from lippmann.rendering.film.aov import plan_layers, trace_layers

        plan = plan_layers(self._pixels, session.memory)
        depth = trace_layers(session.built, self._pixels, plan, placement.display_from_world)["depth"]
        far, near = placement.depth_budget
        is_beyond: NDArray[np.bool_] = np.isfinite(depth) & ((depth < far) | (depth > near))
        return float(is_beyond.mean())


def _count_at(samples: int, counts: list[tuple[int, int]]) -> float:
    """A running count at ``samples``, linear between the ``(samples, count)`` given and beyond the last two."""
    place = next((place for place, (taken, _) in enumerate(counts) if samples <= taken), len(counts) - 1)
    (low, below), (high, above) = counts[place - 1 : place + 1]
    return below + (samples - low) * (above - below) / (high - low)


def _working_bytes(source: DisplayRays, session: Session) -> int:
    """Peak bytes of batches, wavefront and denoiser, see :mod:`~lippmann.rendering.film.sample_batches`."""
    request, limit = session.request, session.memory
    pixels = source.width * source.height * (3 if request.keeps_colors(source.display) else 1)
    lanes = cut_wavefronts(source.width, source.height, request.samples, channels=source.channels, memory=limit).lanes
    wave = lanes * memory_model.BYTES_PER_LANE
    if explain_missing_estimate(request) is not None:
        kept = 0
    elif request.denoises:
        kept = pixels * memory_model.batches(memory_model.MOST_BATCHES)
    else:
        # Batches are held for one band of rows at a time, in half of the memory beside the picture.
        left = limit - pixels * (memory_model.PICTURE + memory_model.ERROR_MAPS)
        kept = min(pixels * memory_model.batches(memory_model.MOST_BATCHES), max(0, left) // 2)
    if request.denoises:
        kept += min(pixels * memory_model.DENOISER, memory_model.NETWORK_MOST + pixels * 2 * memory_model.LAYERS)
    return kept + wave
