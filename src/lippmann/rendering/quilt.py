"""Quilts straight from the scene: every pixel of every view has rays of its own, in one picture traced as a whole."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.errors import PictureError, UsageError
from lippmann.image import Provenance
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.adaptive.stopping import goal_of
from lippmann.rendering.denoise.oidn import load_denoiser
from lippmann.rendering.film.wavefront_plan import make_plan
from lippmann.rendering.picture import Stopwatch, build_for, default_memory, make_integrator, provenance_of, transfer_of
from lippmann.rendering.request.region_of_interest import even_background, scene_corners, view_window
from lippmann.rendering.request.resolve import decide
from lippmann.rendering.request.settings import RenderSettings
from lippmann.runtime import engine as engines
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.placement import PlacementOptions, place
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Color

if TYPE_CHECKING:
    from lippmann.rendering.transport.ray_source import QuiltRays


@dataclass(frozen=True, eq=False)
class QuiltFrame:
    """A rendered quilt: ``pixels`` ``(height, width, 3)`` float32 linear RGB, with how it was made."""

    pixels: NDArray[np.float32]
    provenance: Provenance


@exclusive()
def render_quilt(
    scene: Scene,
    display: Display,
    grid: tuple[int, int],
    size: tuple[int, int],
    settings: RenderSettings,
    placement_options: PlacementOptions,
    progress: ProgressCallback = silent,
) -> QuiltFrame:
    """Render the views that cameras before ``display`` see, see
    :class:`~lippmann.rendering.transport.ray_source.QuiltRays`.

    Before a background of one colour only the part of the views is traced in which the scene's box can be seen.

    Parameters
    ----------
    grid:
        Columns and rows of views.
    size:
        Width and height of the quilt in pixels. What whole views leave over, on the right and on top, is black.
    settings:
        Those of the methods ``full``, ``auto`` and ``pooled``, whose views share their light (see
        :mod:`lippmann.rendering.sharing.cross_view`); without layers and sub-pixels.

    Raises
    ------
    UsageError, PictureError, SceneError, MemoryLimitError, EngineError
        As the stages find them.
    """
    watch = Stopwatch(progress)
    settings = decide(settings).settings
    memory = settings.memory or default_memory()
    # What cannot be done is found before anything is loaded.
    _check(display, settings)
    make_plan(*size, 1, memory=memory)
    goal_of(settings)
    if settings.denoises:
        load_denoiser()
    engine = watch.stage("load", lambda: engines.start(settings.device, settings.threads))
    built = watch.stage("build", lambda: build_for(scene, settings))
    placement = place(
        scene.bounds,
        display,
        cameras=scene.cameras,
        options=placement_options,
        home_camera=scene.home_camera,
        bounds_in=scene.bounds_in,
    )

    from lippmann.device.pbr import BuiltScene
    from lippmann.rendering.methods import Job, trace
    from lippmann.rendering.transport.ray_source import QuiltRays

    (columns, rows), view_size = grid, (size[0] // grid[0], size[1] // grid[1])
    background, window = even_background(built, settings), None
    if background is not None and isinstance(built, BuiltScene):
        window = view_window(scene_corners(built, placement.display_from_world), display, view_size)
    source = QuiltRays(display, placement.world_from_display, columns, rows, view_size, window)
    integrator = watch.stage("build", lambda: make_integrator(built, settings, placement.display_from_world, source))
    traced = trace(
        Job(
            built,
            integrator,
            source,
            settings,
            placement.display_from_world,
            transfer_of(settings),
            memory,
            engine.threads,
            progress,
        )
    )
    watch.seconds |= traced.seconds
    traced.frame.pixels = _assembled(traced.frame.pixels, source, size, background)
    provenance = provenance_of(
        scene,
        built,
        settings,
        engine,
        traced.frame,
        watch,
        samples=traced.samples,
        estimate=traced.estimate,
        options={
            **traced.options,
            "views": [columns, rows],
            "window": list(astuple(source.window)),
            "pixel_filter": settings.pixel_filter,
            "placement": placement.mode,
            "depth_range": list(placement.depth_range),
            "resolvable_range": list(placement.resolvable_range),
        },
        notes=(*placement.warnings, *traced.notes),
    )
    return QuiltFrame(traced.frame.pixels, provenance)


def _check(display: Display, settings: RenderSettings) -> None:
    if display.lens_array.layout != "lenticular":
        rule = "a quilt's views lie side by side, for cylindrical lenses"
        raise PictureError(f"the display {display.name} has {display.lens_array.layout} lenses", rule=rule)
    for given, what in (
        (settings.method not in ("full", "pooled"), f"the method {settings.method}"),
        (settings.subpixels, "sub-pixels"),
        (settings.layers, "layers"),
    ):
        if given:
            raise UsageError(f"{what} will not do for a quilt", rule="every pixel of it is traced, for all colours")


def _assembled(
    pixels: NDArray[np.float32], source: QuiltRays, size: tuple[int, int], background: Color | None
) -> NDArray[np.float32]:
    """The whole quilt: tiles of whole views, the background about their windows, and a black rest right and on top."""
    if pixels.shape[:2] == (size[1], size[0]):
        return pixels
    whole = np.zeros((size[1], size[0], 3), dtype=np.float32)
    width, height = source.view_size
    window = source.window
    for number, tile in enumerate(source.tiles()):
        above, right = divmod(number, source.columns)
        first, column = size[1] - (above + 1) * height, right * width
        view = whole[first : first + height, column : column + width]
        if background is not None:
            view[...] = background
        view[window.slices] = pixels[tile]
    return whole
