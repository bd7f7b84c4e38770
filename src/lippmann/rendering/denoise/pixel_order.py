"""What the network is shown of a picture: its pixels in which order, and which part of it.

``raw``
    The pixels as they lie on the panel. What stands near the lens plane, within a few gaps, looks there like a plain
    picture, and no order is finer.
``views``
    One picture for each view: every one is a true picture of the scene, however deep that is, but a coarse one, of a
    pixel per lens. An exact permutation there and back.

Which is better follows from the scene: from whether a pixel resembles its neighbour under the same lens, or the one at
its place under the next lens. The guides tell that before any light is denoised, see :func:`best_form`.

Sky and background behind all surfaces have no noise: of raw pixels the network is shown those that see a surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.image.micro_images import Permutation, micro_images_as_views
from lippmann.image.views import view_grid
from lippmann.rendering.denoise.oidn import NETWORK_STEP, Effort, denoise
from lippmann.rendering.film.feature_buffers import Guides

FloatArray = NDArray[np.float32]

#: Views with fewer pixels on a side are no pictures that the network knows: see ``docs/background/denoising.md``.
SMALLEST_VIEW = 48
#: Pixels around the surfaces, so that the network sees what they stand before; whole steps of the network.
MARGIN = NETWORK_STEP
#: Pixels around the surfaces that are cleaned, too: guides of a few samples miss edges that barely reach into one.
EDGE = 2


def denoise_views(
    pixels: NDArray[np.generic],
    display: Display,
    guides: Guides,
    *,
    effort: Effort = "high",
    turned: bool = False,
    threads: int | None = None,
) -> FloatArray:
    """An integral image without its noise, view by view.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` finite linear RGB of the panel of a display that :func:`has_exact_views`.
    guides:
        Albedo and normal of the same pixels, from :func:`~lippmann.rendering.film.feature_buffers.trace_guides`.
    effort, turned, threads:
        As those of :func:`~lippmann.rendering.denoise.oidn.denoise`.

    Raises
    ------
    UsageError
        ``pyoidn`` is missing.
    EngineError
        Open Image Denoise fails.
    """
    permutation = Permutation(display)
    layers = (pixels, guides.albedo, guides.normal)
    views = [micro_images_as_views(permutation.split(layer), display) for layer in layers]
    result = np.empty(views[0].shape, dtype=np.float32)
    for place in np.ndindex(result.shape[:2]):
        color, albedo, normal = (layer[place] for layer in views)
        # The guides follow mirrors and glass without chance, so what noise they have lies along edges alone.
        result[place] = denoise(color, albedo, normal, clean_guides=True, effort=effort, turned=turned, threads=threads)
    return permutation.join(micro_images_as_views(result, display))


def best_form(display: Display, guides: Guides) -> Literal["raw", "views"]:
    """The form that leaves less error, as far as display and guides tell.

    Views, where they are exact and large enough for the network, and where neighbours in a view are more alike than
    neighbours on the panel.
    """
    if not has_exact_views(display):
        return "raw"
    _, _, rows, columns = _view_shape(display)
    if min(rows, columns) < SMALLEST_VIEW:
        return "raw"
    on_panel, in_view = neighbour_differences(display, guides)
    return "views" if in_view < on_panel else "raw"


def neighbour_differences(display: Display, guides: Guides) -> tuple[float, float]:
    """Mean absolute difference of the guides between neighbours on the panel and between those in a view.

    Taken across the lenses: along a cylindrical lens both orders have the same neighbours.
    """
    axes = (1,) if display.lens_array.layout == "lenticular" else (0, 1)
    on_panel, in_view = 0.0, 0.0
    for guide, weight in ((guides.albedo, 1.0), (guides.normal, 0.5)):  # components in [0, 1], in [-1, 1]
        micro_images = Permutation(display).split(guide)
        for axis in axes:
            on_panel += weight * _mean_step(guide, axis)
            in_view += weight * _mean_step(micro_images, axis)
    return on_panel, in_view


def has_exact_views(display: Display) -> bool:
    """Whether the views of a display are an exact permutation of its pixels, with all places filled."""
    return view_grid(display).exact and bool(Permutation(display).mask.all())


def _mean_step(values: FloatArray, axis: int) -> float:
    lines = np.swapaxes(values, 0, axis)
    step = lines[1:] - lines[:-1]
    return float(np.abs(step, out=step).mean()) if step.size else 0.0


def _view_shape(display: Display) -> tuple[int, ...]:
    rows, columns, ny, nx = Permutation(display).shape
    return (1, nx, ny, columns) if display.lens_array.layout == "lenticular" else (ny, nx, rows, columns)


@dataclass(frozen=True, eq=False)
class SurfacePart:
    """The rectangle of a picture that holds all surfaces, and a margin.

    Attributes
    ----------
    place:
        Its rows and columns.
    near:
        ``(h, w, 1)`` bool: pixels of it that show surfaces or are close to one.
    """

    place: tuple[slice, slice]
    near: NDArray[np.bool_]

    @staticmethod
    def of(normal: NDArray[np.generic]) -> SurfacePart | None:
        """By a guide ``(H, W, 3)``, which is 0 where there is no surface; None where there is none at all."""
        is_surface = (normal[..., 0] != 0) | (normal[..., 1] != 0) | (normal[..., 2] != 0)
        place = _rectangle(is_surface)
        return None if place is None else SurfacePart(place, _widened(is_surface[place])[..., None])


def denoise_seen(
    color: NDArray[np.generic],
    albedo: NDArray[np.generic],
    normal: NDArray[np.generic],
    surfaces: SurfacePart | None,
    *,
    effort: Effort = "high",
    turned: bool = False,
    threads: int | None = None,
) -> FloatArray:
    """The picture without its noise; arguments as those of :func:`~lippmann.rendering.denoise.oidn.denoise`.

    The network is shown the rectangle of the ``surfaces``, those of ``normal``. What is not near one is left as it is,
    so that nothing tells where that rectangle ends.
    """
    result = np.array(color, dtype=np.float32)
    if surfaces is not None:
        place = surfaces.place
        # The guides follow mirrors and glass without chance, so what noise they have lies along edges alone.
        cleaned = denoise(
            color[place],
            albedo[place],
            normal[place],
            clean_guides=True,
            effort=effort,
            turned=turned,
            threads=threads,
        )
        np.copyto(result[place], cleaned, where=surfaces.near)
    return result


def _widened(is_surface: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """With the pixels up to ``EDGE`` beside and above each other."""
    for axis in (0, 1):
        lines = np.swapaxes(is_surface, 0, axis)
        wide = lines.copy()
        for step in range(1, EDGE + 1):
            wide[step:] |= lines[:-step]
            wide[:-step] |= lines[step:]
        is_surface = np.swapaxes(wide, 0, axis)
    return is_surface


def _rectangle(is_surface: NDArray[np.bool_]) -> tuple[slice, slice] | None:
    """Rows and columns with all surfaces, and a margin; None if there is none."""
    spans = []
    for axis in (1, 0):
        there = np.flatnonzero(np.any(is_surface, axis=axis))
        if not len(there):
            return None
        first = max(0, (int(there[0]) // MARGIN - 1) * MARGIN)
        spans.append(slice(first, min(is_surface.shape[1 - axis], int(there[-1]) + 1 + MARGIN)))
    return spans[0], spans[1]
