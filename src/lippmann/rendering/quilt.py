"""Quilts straight from the scene: every pixel of every view has rays of its own, in one picture traced as a whole."""

from __future__ import annotations

import time
from dataclasses import astuple, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.sheet_layout import trimmed
from lippmann.display.view_cone import view_window
from lippmann.image.metadata import Provenance
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.picture import describe_placement
from lippmann.rendering.provenance import make_provenance
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import Build, find_uniform_background, open_session, read_choices
from lippmann.runtime.engine_lock import exclusive
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
    request: RenderRequest,
    progress: ProgressCallback = silent,
    build: Build | None = None,
) -> QuiltFrame:
    """Render the views that cameras in front of ``display`` see, of a print those of its trim, see
    :class:`~lippmann.rendering.transport.ray_source.QuiltRays`.

    Before a background of one colour only the part of the views is traced in which the scene's box can be seen.

    Parameters
    ----------
    grid:
        Columns and rows of views.
    size:
        Width and height of the quilt in pixels. What whole views leave over, on the right and on top, is black.
    request:
        Of the methods ``full``, ``auto`` and ``pooled``, whose views share their light (see
        :mod:`lippmann.rendering.sharing.cross_view`); without layers and sub-pixels.

    Raises
    ------
    UsageError, PictureError, SceneError, MemoryLimitError, EngineError
        As the stages find them.
    """
    if request.began is None:
        request = replace(request, began=time.perf_counter())
    request = resolve(request, scene, display, "quilt", size=size)
    session = open_session(scene, request, size, progress=progress, build=build)
    request = session.request
    placement = session.place(display)
    display = placement.traced(trimmed(display))

    from lippmann.device.pbr import BuiltScene
    from lippmann.device.pbr.scene import scene_corners
    from lippmann.rendering.methods import Job, trace
    from lippmann.rendering.transport.ray_source import QuiltRays

    display_from_world = placement.display_from_world
    (columns, rows), view_size = grid, (size[0] // grid[0], size[1] // grid[1])
    background, window = find_uniform_background(session.built, request), None
    if background is not None and isinstance(session.built, BuiltScene):
        window = view_window(scene_corners(session.built, display_from_world), display, view_size)
    source = QuiltRays(display, placement.world_from_display, columns, rows, view_size, window)
    integrator = session.integrator(source, display_from_world, placement.exposure)

    traced = trace(Job(session, integrator, source, display_from_world))
    session.watch.seconds.update(traced.seconds)
    traced.frame.pixels = _assemble(traced.frame.pixels, source, size, background)
    provenance = make_provenance(
        session,
        traced.frame,
        samples=traced.samples,
        options={
            **traced.options,
            "views": [columns, rows],
            "window": list(astuple(source.window)),
            **describe_placement(request, placement),
        },
        choices=read_choices(integrator),
        estimate=traced.estimate,
        notes=(*placement.warnings, *traced.notes),
    )
    return QuiltFrame(session.request.tone_mapped(traced.frame.pixels), provenance)


def _assemble(
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
