"""Light of a key frame in the frames after it, while the scene and its light are at rest and the display alone moves.

A diffuse surface then keeps its radiance. So a frame after a key frame traces the feature buffers of all pixels, but
paths for some of them alone: disocclusions, outlines, emitters, edges of shadows, and surfaces that are not diffuse.
All others take the irradiance of the key frame's denoised picture at the same point, times their own albedo.

The place of a point under a lens of the key frame follows from the geometry. The two lenses to either side of the
pixel's own ray, on arrays the four about it, show the point, or the nearest that they can show. Each gives a bilinear
mean of four pixels; those of another plane or normal, or of no diffuse surface, do not count. Light between the points
that the key frame shows is not known. So it is taken only where the lenses agree on it, as codes: then no edge of a
shadow lies between them, no highlight, and none of them shows another surface.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import encode
from lippmann.display.array_ops import NUMPY
from lippmann.display.micro_image_layout import micro_image_extent
from lippmann.scene.matrices import inverse, rotation_of, transform_points

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.rendering.job import Job, Traced
    from lippmann.rendering.transport.path import PreparedLight

Floats = NDArray[np.float32]
Reals = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Pixels that are looked up at once, so that all of their values stay in the processor's caches.
_BLOCK = 1 << 14
#: Least cosine between normals of the same surface; mean normals of one pixel that are shorter lie on an edge.
_SAME_NORMAL = 0.97
#: Distance from a surface's plane, as a share of its height, plus a share of the gap.
_OFF_PLANE = 0.02, 0.1
#: Farthest pixel that counts, in lens pitches; and the distance at which pixels count half of those at the very point.
_FAR, _NEAR = 1.5, 0.05
#: Least weight of a lens's pixels that count, of 1; and the largest difference of codes between lenses that agree.
_LEAST_WEIGHT, _AGREEMENT = 0.5, 0.02
#: Samples of a pixel that is traced, as a multiple of those of a frame that is traced whole: few pixels among clean
#: ones keep more of their noise in the denoiser.
_SAMPLES = 2


class KeyLight:
    """Keeps the picture of a key frame, and traces the frames after it with its light."""

    def __init__(self) -> None:
        self._key: tuple[_View, Floats] | None = None

    def trace_key(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a key frame; parameters as of ``trace_through`` in
        :class:`~lippmann.rendering.request.render_request.RenderRequest`.
        """
        self._key = None  # the pictures of two key frames may not fit the memory
        traced = trace(job)
        if _light_of(job) is not None:
            self._key = _View(job), traced.frame.pixels
        return traced

    def trace_next(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a frame after the key frame, with the light of that where scene and light are the same."""
        if self._key is None or not _is_light_at_rest(self._key[0].job, job):
            return trace(job)
        pixels, is_known = _gather(*self._key, _View(job))
        # Else it is less work to trace all of them.
        return _trace_others(job, pixels, is_known) if _SAMPLES * (1 - is_known.mean()) < 1 else trace(job)


def _light_of(job: Job) -> PreparedLight | None:
    """The light of a job whose denoised picture may share it; None for all others."""
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import DisplayRays, WindowRays

    if job.request.denoise == "none" or not isinstance(job.traced, DisplayRays | WindowRays) or job.traced.channels > 1:
        return None
    return job.integrator.light if isinstance(job.integrator, PathIntegrator) else None


def _is_light_at_rest(key: Job, job: Job) -> bool:
    """Whether nothing but the display has moved: not the scene, nor light that turns with the display."""
    scene = job.session.scene
    if key.session.scene is not scene or _light_of(key) is not _light_of(job):
        return False
    if scene.environment is None or not scene.environment.follows_viewer:
        return True
    return np.allclose(rotation_of(key.display_from_world), rotation_of(job.display_from_world), atol=1e-6)


class _View:
    """What the pixels of a frame see. Made before it is used: most key frames of other films are not."""

    def __init__(self, job: Job) -> None:
        self.job = job
        self._guides = job.denoiser.guides()

    @property
    def display(self) -> Display:
        """The display, of which the frame may be a window."""
        from lippmann.rendering.transport.ray_source import DisplayRays, WindowRays

        assert isinstance(self.job.source, DisplayRays | WindowRays)
        return self.job.source.display

    @property
    def corner(self) -> tuple[int, int]:
        """Column and row of the window's first pixel."""
        window = getattr(self.job.source, "window", None)
        return (0, 0) if window is None else (window.left, window.top)

    @cached_property
    def mm_per_unit(self) -> float:
        """Millimetres per unit of the scene."""
        return float(1 / np.linalg.norm(inverse(self.job.display_from_world)[:3, 0]))

    @cached_property
    def rays(self) -> tuple[Reals, Reals]:
        """Origins and directions ``(H, W, 3)`` of the pixels' centres, in display space (mm)."""
        height, width = self.albedo.shape[:2]
        column, row = np.meshgrid(np.arange(width) + self.corner[0] + 0.5, np.arange(height) + self.corner[1] + 0.5)
        place = self.display.panel_point(column, row)
        origin, direction = (np.stack(part, axis=-1) for part in self.display.light_ray(*place))
        return origin, direction

    @cached_property
    def points(self) -> Reals:
        """World points ``(H, W, 3)``."""
        assert self._guides.height is not None
        origin, direction = self.rays
        onward = (self._guides.height - origin[..., 2]) / direction[..., 2]
        return transform_points(inverse(self.job.display_from_world), origin + onward[..., None] * direction)

    @cached_property
    def normals(self) -> Floats:
        """Unit normals ``(H, W, 3)`` in world space."""
        normal = self._guides.normal @ rotation_of(inverse(self.job.display_from_world))[:3, :3].T
        unit: Floats = (normal / np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-6)).astype(np.float32)
        return unit

    @property
    def albedo(self) -> Floats:
        """``(H, W, 3)`` in [0, 1]."""
        return self._guides.albedo

    @cached_property
    def is_diffuse(self) -> Mask:
        """``(H, W)``: pixels that show one diffuse surface, and nothing of an edge."""
        assert self._guides.diffuse is not None
        is_whole: Mask = np.linalg.norm(self._guides.normal, axis=2) > _SAME_NORMAL
        return self._guides.diffuse & is_whole


def _gather(key: _View, colors: Floats, view: _View) -> tuple[Floats, Mask]:
    """The light ``(H, W, 3)`` of a frame's pixels by the ``colors`` of a key frame, and where it is known."""
    pixels = np.zeros((*view.is_diffuse.shape, 3), dtype=np.float32)
    is_known = np.zeros_like(view.is_diffuse)
    rows, columns = np.nonzero(view.is_diffuse)
    for first in range(0, len(rows), _BLOCK):
        place = rows[first : first + _BLOCK], columns[first : first + _BLOCK]
        pixels[place], is_known[place] = _gather_block(key, colors, view, place)
    return pixels, is_known


def _gather_block(
    key: _View, colors: Floats, view: _View, place: tuple[NDArray[np.intp], NDArray[np.intp]]
) -> tuple[Floats, Mask]:
    """The light ``(n, 3)`` of some pixels, and where it is known."""
    points, normals, albedo = view.points[place], view.normals[place], view.albedo[place]
    key_from_display = key.job.display_from_world @ inverse(view.job.display_from_world)
    origin = transform_points(key_from_display, view.rays[0][place])
    direction = view.rays[1][place] @ key_from_display[:3, :3].T
    x, y, _ = (origin - (origin[:, 2:] / direction[:, 2:]) * direction).T
    light, total = np.zeros((len(points), 3)), np.zeros((len(points), 1))
    least, most = np.full_like(light, np.inf), np.full_like(light, -np.inf)
    is_known = np.ones(len(points), dtype=bool)
    in_display = transform_points(key.job.display_from_world, points)
    for lens in _lenses_about(key.display, x, y):
        weight, irradiance, distance = _under_lens(key, colors, lens, points, in_display, normals)
        value = (irradiance * albedo).astype(np.float32)
        code = encode(value, key.job.request.coding)
        least, most = np.minimum(least, code), np.maximum(most, code)
        is_known &= weight > _LEAST_WEIGHT
        nearness = 1 / (_NEAR * key.display.lens_array.pitch + distance)[:, None]
        light += nearness * value
        total += nearness
    return (light / total).astype(np.float32), is_known & (most - least < _AGREEMENT).all(axis=1)


def _under_lens(
    key: _View, colors: Floats, lens: tuple[Reals, Reals], points: Reals, in_display: Reals, normals: Floats
) -> tuple[Reals, Reals, Reals]:
    """Under a lens of the key frame: the weight ``(n,)`` of the pixels about each point, 0 to 1, their irradiance
    ``(n, 3)``, and their distance from the point (mm). Points are given in the world and in the key's display."""
    display = key.display
    x, y, z = in_display.T
    off_plane = _OFF_PLANE[0] * np.abs(z) + _OFF_PLANE[1] * display.gap
    u, v = _places_under(display, (x, y, z), *lens)
    u, v = u - 0.5 - key.corner[0], v - 0.5 - key.corner[1]
    left, top = np.floor(u), np.floor(v)
    total, far = np.zeros(len(x)), np.zeros(len(x))
    light, albedo = np.zeros((len(x), 3)), np.zeros((len(x), 3))
    height, width = key.is_diffuse.shape
    for right, down in product((0, 1), repeat=2):
        column, row = (left + right).astype(np.intp), (top + down).astype(np.intp)
        is_there = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        there = np.where(is_there, row, 0), np.where(is_there, column, 0)
        apart = (key.points[there] - points) * key.mm_per_unit
        distance = np.sqrt(np.einsum("ij,ij->i", apart, apart))
        is_same = is_there & key.is_diffuse[there] & (distance < _FAR * display.lens_array.pitch)
        is_same &= np.einsum("ij,ij->i", key.normals[there], normals) > _SAME_NORMAL
        is_same &= np.abs(np.einsum("ij,ij->i", apart, normals)) < off_plane
        weight = (1 - np.abs(u - column)) * (1 - np.abs(v - row)) * is_same
        total += weight
        far += weight * distance
        light += weight[:, None] * colors[there]
        albedo += weight[:, None] * key.albedo[there]
    return total, light / np.maximum(albedo, 1e-6), far / np.maximum(total, 1e-6)


def _lenses_about(display: Display, x: Reals, y: Reals) -> Iterator[tuple[Reals, Reals]]:
    """Indices of the lens at points of the lens plane, and of those on the nearer side of its centre."""
    lattice = display.lattice
    i, j = lattice.lens_at(x, y, NUMPY)
    center_x, center_y = lattice.center(i, j, x, y, NUMPY)
    right = np.where(x >= center_x, 1.0, -1.0) * lattice.pitch
    up = np.where(y >= center_y, 1.0, -1.0) * lattice.row_pitch
    for across, along in product((0, 1), (0,) if lattice.layout == "lenticular" else (0, 1)):
        yield lattice.lens_at(x + across * right, y + (along * up if along else 0.0), NUMPY)


def _places_under(display: Display, point: tuple[Reals, Reals, Reals], i: Reals, j: Reals) -> tuple[Reals, Reals]:
    """Column and row of points (mm) under lenses, or the nearest of the pixels under each."""
    x, y = display.project(*point, i, j)
    u, v = display.pixel_coordinates(x, y)
    scale = display.magnification
    center = display.lattice.center(i, j, x / scale, y / scale, NUMPY)
    middle = display.pixel_coordinates(center[0] * scale, center[1] * scale)
    half_width, half_height = (side / 2 - 0.5 for side in micro_image_extent(display))
    u = np.clip(u, middle[0] - half_width, middle[0] + half_width)
    if display.lens_array.layout != "lenticular":
        v = np.clip(v, middle[1] - half_height, middle[1] + half_height)
    return u, v


def _trace_others(job: Job, pixels: Floats, is_known: Mask) -> Traced:
    """The picture with ``pixels`` where their light ``is_known``; the others are traced and denoised among them."""
    from lippmann.rendering.film.wavefront import STRIP_ROWS, Coverage
    from lippmann.rendering.job import Job, one_stream
    from lippmann.rendering.methods import SAMPLES_LAYER, denoise_whole
    from lippmann.rendering.transport.ray_source import SinglePixelRays

    rows, columns = np.nonzero(~is_known)
    order = np.lexsort((rows % STRIP_ROWS, columns, rows // STRIP_ROWS))  # neighbours take much the same paths
    rows, columns = rows[order], columns[order]
    request = replace(job.request, spp=_SAMPLES * job.request.samples)
    session = replace(job.session, request=request)
    few = SinglePixelRays(job.traced, columns, rows, np.zeros_like(rows))
    share = float(is_known.mean())
    note = f"{100 * share:.0f} % of the pixels have the key frame's light, the others {request.spp} samples"
    traced = one_stream(Job(session, job.integrator, few, job.display_from_world), request.judged_by, note)
    frame = traced.frame

    def spread(part: Floats, others: Floats | float) -> Floats:
        whole = np.empty((*is_known.shape, part.shape[-1]), dtype=np.float32)
        whole[...] = others
        whole[rows, columns] = part[0]
        return whole

    frame.pixels = spread(frame.pixels, pixels)
    frame.specular = None if frame.specular is None else spread(frame.specular, 0.0)
    frame.excess = None if frame.excess is None else spread(frame.excess, 0.0)
    if frame.coverage is not None:
        frame.coverage = Coverage(spread(frame.coverage.share, 1.0), frame.coverage.samples)
    frame.maps[SAMPLES_LAYER] = np.where(is_known, np.uint32(0), np.uint32(traced.samples))
    frame.shares = {"traced": 1 - share, "reprojected": share, "interpolated": 0.0}
    traced = denoise_whole(job, traced)
    traced.frame.pixels[is_known] = pixels[is_known]
    return traced


__all__ = ["KeyLight"]
