"""Tiles of a picture, rendered: the job's scene is built once, then any tile can be asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.types import Pixels
from lippmann.display import NUMPY, Display
from lippmann.display.panel import PixelWindow
from lippmann.image.encoding import stored_values
from lippmann.journal.tile_file import TileResult
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.denoise.guided_denoiser import choose_effort
from lippmann.rendering.estimate.psnr import ERROR_LAYER, ErrorSums, PixelErrors
from lippmann.rendering.film.memory_model import cut_wavefronts
from lippmann.rendering.film.sample_batches import BatchedRender
from lippmann.rendering.film.wavefront import RayTotals, trace_frame
from lippmann.rendering.methods import SAMPLES_LAYER, Job, trace
from lippmann.rendering.request.preconditions import explain_missing_estimate
from lippmann.rendering.session import Session, Stopwatch, open_session
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.ray_source import DisplayRays
from lippmann.runtime import engine as engines
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.placement import Placement
from lippmann.tiles.job import TileJob

#: The arrays of :attr:`TileResult.sums`: flat indices of the lenses that have pixels in the tile, and their sums; those
#: of the samples' errors, where denoised pixels have others.
LENSES = "lenses"
SUMS = tuple(each.name for each in fields(ErrorSums))
OF_SAMPLES = "samples "


@dataclass(frozen=True, eq=False)
class Prepared:
    """A job with its scene on the device. Make one with :func:`prepare`, once in a process.

    ``no_estimate`` says why tiles have no ``sums``, None if they have.
    """

    job: TileJob
    session: Session
    placement: Placement
    no_estimate: str | None
    integrator: Integrator
    source: DisplayRays

    @property
    def options(self) -> dict[str, object]:
        """How the picture was made in tiles, for its file."""
        job = self.job
        if job.surroundings is None:
            return {}
        cut: dict[str, object] = {"tile_side": job.side, "tile_margin": job.surroundings.margin}
        if not job.request.denoises:
            return cut
        effort = choose_effort(job.request.denoise, job.request.samples)
        return {**cut, "denoise": "oidn", "denoise_effort": effort}


@dataclass(frozen=True, eq=False)
class TracedTile:
    """A tile in linear light: ``(rows, columns, 3)`` float32, with the errors where it knows them.

    ``maps``: further layers ``(rows, columns)`` of its method; ``rays``: those of its surroundings count, too.
    """

    index: int
    pixels: NDArray[np.float32]
    errors: PixelErrors | None
    rays: RayTotals
    maps: Mapping[str, Pixels] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@exclusive()
def prepare(job: TileJob, progress: ProgressCallback = silent) -> Prepared:
    """Start the engine, build the scene, place the display.

    Raises
    ------
    SceneError, EngineError, UsageError
        As the stages find them.
    """
    session = open_session(job.scene, job.request, memory=job.tile_memory, progress=progress)
    request = session.request
    job = replace(job, request=request)
    placement = session.place(job.display)
    source = session.rays(job.display, placement)
    integrator = session.integrator(source, placement.display_from_world, placement.exposure)
    # Tiles are traced in silence, whoever counts them.
    quiet = replace(session, watch=Stopwatch())
    return Prepared(job, quiet, placement, explain_missing_estimate(request), integrator, source)


@exclusive()
def trace_tile(prepared: Prepared, index: int) -> TracedTile:
    """The part of rendering a tile that the engine does: the same beside whichever others, whenever and wherever."""
    job, request, engine = prepared.job, prepared.job.request, prepared.session.engine
    # Another thread may have rendered on another device since the last tile.
    engines.start(engine.device, engine.threads)
    if job.surroundings is not None:
        return _trace_window(prepared, index)
    window = job.grid[index]
    if prepared.no_estimate is not None:
        plan = cut_wavefronts(
            window.width,
            window.height,
            request.samples,
            channels=prepared.source.channels,
            memory=job.tile_memory,
        )
        frame = trace_frame(
            prepared.integrator,
            prepared.source,
            plan,
            seed=request.seed,
            box_filter=request.box_filter,
            corner=(window.top, window.left),
        )
        return TracedTile(index, frame.pixels, None, frame.rays)
    batches = BatchedRender(
        prepared.integrator,
        prepared.source,
        seed=request.seed,
        box_filter=request.box_filter,
        coding=job.request.coding,
        memory=job.tile_memory,
        window=window,
    )
    batches.add(request.samples)
    errors = batches.squared_error()
    maps = {ERROR_LAYER: np.maximum(errors.values, 0)}
    return TracedTile(index, batches.picture(), errors, batches.rays, maps)


def _trace_window(prepared: Prepared, index: int) -> TracedTile:
    """A tile as the middle of a larger picture, which is rendered as any other is."""
    job = prepared.job
    tile, window = job.grid[index], job.window(index)
    traced = trace(
        Job(
            prepared.session,
            prepared.integrator,
            prepared.source.of_window(window),
            prepared.placement.display_from_world,
            is_part=job.request.denoises,
        )
    )
    inside = tile.relative_to(window).slices
    maps = {name: values[inside] for name, values in traced.frame.maps.items() if name != SAMPLES_LAYER}
    errors = None if traced.errors is None else traced.errors.part(inside)
    return TracedTile(index, traced.frame.pixels[inside], errors, traced.frame.rays, maps, traced.notes)


def pack(prepared: Prepared, traced: TracedTile) -> TileResult:
    """The part of rendering a tile that needs no engine: values as the file holds them, errors as sums."""
    job = prepared.job
    sums, maps = {}, {}
    if traced.errors is not None:
        sums = lens_sums(job.display, job.grid[traced.index], traced.errors)
    if job.keeps_maps:
        maps = dict(traced.maps)
    values = stored_values(job.request.tone_mapped(traced.pixels), job.stored, job.transfer)
    return TileResult(traced.index, values, maps, sums, dict(vars(traced.rays)), traced.notes)


def lens_sums(display: Display, window: PixelWindow, errors: PixelErrors) -> dict[str, Pixels]:
    """Sums over the part of each micro-image that lies in the tile."""
    lenses, owner, pixels = np.unique(_owners(display, window), return_inverse=True, return_counts=True)
    layers: dict[str, Pixels] = {LENSES: lenses}
    for before, each in (("", errors), (OF_SAMPLES, errors.samples)):
        if each is not None:
            sums = ErrorSums.none(len(lenses), pixels)
            sums.add(owner, each)
            layers |= {before + name: getattr(sums, name) for name in SUMS}
    return layers


def _owners(display: Display, window: PixelWindow) -> NDArray[np.int64]:
    """``(rows, columns)``: the flat index of every pixel's lens."""
    u, v = np.meshgrid(
        window.left + np.arange(window.width) + 0.5,
        window.top + np.arange(window.height) + 0.5,
    )
    i, j = display.lens_of(*display.panel_point(u, v), NUMPY)
    owners: NDArray[np.int64] = j.astype(np.int64) * display.lens_grid.columns + i.astype(np.int64)
    return owners
