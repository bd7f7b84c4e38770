"""Tiles of a picture, rendered: the job's scene is built once, then any tile can be asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann import engine as engines
from lippmann.display import NUMPY, Display
from lippmann.image.codec import stored_values
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.render.batches import FullInBatches
from lippmann.render.estimate import ERROR_LAYER, ErrorSums, PixelErrors, why_no_estimate
from lippmann.render.full import RayTotals, trace_frame
from lippmann.render.pipeline import build_for, make_integrator
from lippmann.render.plan import make_plan
from lippmann.render.rays import DisplayRays
from lippmann.render.tiles import TileJob
from lippmann.scene.placement import Placement, place
from lippmann.store.grid import Window
from lippmann.store.tile_file import TileResult

#: The arrays of :attr:`TileResult.sums`: flat indices of the lenses that have pixels in the tile, and their sums.
LENSES = "lenses"
SUMS = ("pixels", "values", "squares", "lone")


@dataclass(frozen=True, eq=False)
class Prepared:
    """A job with its scene on the device. Make one with :func:`prepare`, once in a process.

    ``no_estimate`` says why tiles have no ``sums``, None if they have.
    """

    job: TileJob
    built: Any
    placement: Placement
    engine: engines.Engine
    no_estimate: str | None
    integrator: Any
    source: DisplayRays


@dataclass(frozen=True, eq=False)
class TracedTile:
    """A tile in linear light: ``(rows, columns, 3)`` float32, with the errors where it knows them."""

    index: int
    pixels: NDArray[np.float32]
    errors: PixelErrors | None
    rays: RayTotals


def prepare(job: TileJob, progress: ProgressCallback = silent) -> Prepared:
    """Start the engine, build the scene, place the display.

    Raises
    ------
    SceneError, EngineError, UsageError
        As the stages find them.
    """
    progress(Progress("load", 0, 1))
    engine = engines.start(job.settings.device, job.settings.threads)
    progress(Progress("build", 0, 1))
    scene, settings = job.scene, job.settings
    built = build_for(scene, settings)
    placement = job.placement
    if not isinstance(placement, Placement):
        placement = place(
            scene.bounds,
            job.display,
            cameras=scene.cameras,
            options=placement,
            home_camera=scene.home_camera,
            bounds_in=scene.bounds_in,
        )
    return Prepared(
        job,
        built,
        placement,
        engine,
        why_no_estimate(settings),
        make_integrator(built, settings, placement.display_from_world),
        DisplayRays(job.display, placement.world_from_display, settings.subpixels),
    )


def render_tile(prepared: Prepared, index: int) -> TileResult:
    """One tile, ready to be kept: the same whenever, wherever and beside whatever it is rendered."""
    return packed(prepared, trace_tile(prepared, index))


def trace_tile(prepared: Prepared, index: int) -> TracedTile:
    """The part of :func:`render_tile` that the engine does."""
    job, settings = prepared.job, prepared.job.settings
    window = job.grid[index]
    is_box = settings.pixel_filter == "box"
    if prepared.no_estimate is not None:
        plan = make_plan(
            window.columns,
            window.rows,
            settings.samples,
            channels=prepared.source.channels,
            memory=job.tile_memory,
        )
        frame = trace_frame(
            prepared.integrator,
            prepared.source,
            plan,
            seed=settings.seed,
            box_filter=is_box,
            corner=(window.row, window.column),
        )
        return TracedTile(index, frame.pixels, None, frame.rays)
    batches = FullInBatches(
        prepared.integrator,
        prepared.source,
        seed=settings.seed,
        box_filter=is_box,
        transfer=job.transfer,
        memory=job.tile_memory,
        window=window,
    )
    batches.add(settings.samples)
    return TracedTile(index, batches.picture(), batches.squared_error(), batches.rays)


def packed(prepared: Prepared, traced: TracedTile) -> TileResult:
    """The part of :func:`render_tile` that needs no engine: values as the file holds them, errors as sums."""
    job = prepared.job
    sums, maps = {}, {}
    if traced.errors is not None:
        sums = lens_sums(job.display, job.grid[traced.index], traced.errors)
        if job.keeps_maps:
            maps = {ERROR_LAYER: np.maximum(traced.errors.values, 0)}
    values = stored_values(traced.pixels, job.stored, job.transfer)
    return TileResult(traced.index, values, maps, sums, dict(vars(traced.rays)))


def lens_sums(display: Display, window: Window, errors: PixelErrors) -> dict[str, NDArray[Any]]:
    """Sums over the part of each micro-image that lies in the tile."""
    lenses, owner, pixels = np.unique(_owners(display, window), return_inverse=True, return_counts=True)
    sums = ErrorSums(pixels.astype(np.float64), *np.zeros((3, len(lenses))))
    sums.add(owner, errors.values, errors.lone)
    return {LENSES: lenses, **{name: getattr(sums, name) for name in SUMS}}


def _owners(display: Display, window: Window) -> NDArray[np.int64]:
    """``(rows, columns)``: the flat index of every pixel's lens."""
    u, v = np.meshgrid(
        window.column + np.arange(window.columns) + 0.5,
        window.row + np.arange(window.rows) + 0.5,
    )
    i, j = display.lens_of(*display.panel_point(u, v, NUMPY), NUMPY)
    owners: NDArray[np.int64] = j.astype(np.int64) * display.lens_grid.columns + i.astype(np.int64)
    return owners
