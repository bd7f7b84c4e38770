"""Where in its pixels a picture shows images of small emitters by sharp events alone.

The way from a point of a pixel by some sharp events is smooth: Newton's method finds the point from which it meets the
middle of an emitter, and the derivatives there tell how large the image is. That is specular manifold sampling
(Zeltner, Georgiev and Jakob 2020), here in the plane of the pixels, which every optics has. What is not found stays
with chains at random (:mod:`lippmann.rendering.transport.mirror_images`).
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide, upload
from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, Float, MitsubaScene, Point2f, Ray3f, UInt32, Vector3f
from lippmann.rendering.film import memory_model
from lippmann.rendering.transport.mirror_images import SLOTS, MirrorImages
from lippmann.rendering.transport.ray_source import DisplayRays, RaySource, SubpixelRays, pixel_number
from lippmann.rendering.transport.sharp_events import follows_sharply, sharp_lobe

Floats = NDArray[np.float32]

#: Searches from each pixel: one for so many of its samples, within limits; and in the whole picture, at least.
SAMPLES_OF_SEARCH, FEWEST, MOST, FEWEST_IN_ALL = 2, 2, 8, 1 << 15
#: Sharp events between the pixel and the emitter, at most; without any, it is seen directly.
MOST_EVENTS = 4
#: Steps of Newton's method; how far one goes, and how far all of them may, in pixels.
STEPS, LONGEST_STEP, FARTHEST = 6, 0.5, 3.0
#: Boxes are so many times as wide as the image, but no narrower than this, in pixels.
MARGIN, NARROWEST = 1.5, 1e-4
#: Images that fill more than this part of a pixel are met by chains at random.
LARGEST = 0.25
#: Width of the differences by which derivatives are taken, in pixels.
_DIFFERENCE = 1 / 64
#: Squared sine between both derivatives below which they tell no point.
_ALIKE = 1e-12
#: Sample dimensions: of the point, the emitter, the number of events, and the choice between a surface's lobes.
_POINT, _EMITTER, _EVENTS, _LOBE = range(4)
_SEED = 0x4D495252


@dataclass(frozen=True, eq=False)
class Targets:
    """Spheres about emitters: ``middles`` ``(n, 3)`` and ``radii`` ``(n,)``, in world units."""

    middles: Floats
    radii: Floats

    def __len__(self) -> int:
        return len(self.radii)


def find_targets(scene: MitsubaScene) -> Targets:
    """The emitters of a scene that have a place and a size."""
    boxes = [shape.bbox() for shape in scene.shapes() if shape.is_emitter()]
    low = np.array([np.array(box.min).ravel() for box in boxes], np.float32).reshape(-1, 3)
    high = np.array([np.array(box.max).ravel() for box in boxes], np.float32).reshape(-1, 3)
    known = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
    low, high = low[known], high[known]
    # The sphere as wide as the longest side: what of an emitter lies beyond is mostly within the margin of the image.
    return Targets(0.5 * (low + high), 0.5 * (high - low).max(axis=1, initial=0))


@dataclass(frozen=True, eq=False)
class ImageSearch:
    """What a search came to: small images, None where there are none; and whether it was made and ``found_none``."""

    images: MirrorImages | None
    found_none: bool = False


def search_images(scene: MitsubaScene, source: RaySource, samples: int, memory: int) -> ImageSearch:
    """Look for the images of emitters in the pixels of ``source``.

    Parameters
    ----------
    scene:
        The scene.
    source:
        Rays of the whole picture.
    samples:
        Of each pixel, about: the search takes a small part of their time.
    memory:
        Bytes that it may take; where these do not hold it, it is not made.
    """
    targets = find_targets(scene)
    rays = SubpixelRays(source) if isinstance(source, DisplayRays) and source.channels == 3 else source
    pixels = rays.width * rays.height * rays.channels
    room = (memory - pixels * memory_model.MIRROR_IMAGES) // memory_model.IMAGE_SEARCH_LANE
    lanes = min(memory_model.preferred_lanes(), room)
    if not len(targets):
        return ImageSearch(None, found_none=True)
    if lanes < memory_model.SMALLEST_LANES:
        return ImageSearch(None)
    search = _Search(scene, targets, rays)
    fewest = max(FEWEST, -(-FEWEST_IN_ALL // pixels))
    found = search.from_pixels(pixels, range(fewest), lanes)
    searches = max(fewest, min(samples // SAMPLES_OF_SEARCH, MOST))
    if len(found) and searches > fewest:
        found = _Found.joined([found, search.from_pixels(pixels, range(fewest, searches), lanes)])
    return ImageSearch(found.boxes(pixels), found_none=not len(found))


@dataclass(frozen=True, eq=False)
class _Found:
    """Images: ``(n,)`` numbers of their pixels, and ``(n, 2)`` middles in these and half sides of the boxes."""

    pixel: NDArray[np.uint32]
    middle: Floats
    half: Floats

    def __len__(self) -> int:
        return len(self.pixel)

    @classmethod
    def none(cls) -> _Found:
        return cls(np.zeros(0, np.uint32), np.zeros((0, 2), np.float32), np.zeros((0, 2), np.float32))

    @classmethod
    def joined(cls, parts: list[_Found]) -> _Found:
        return cls(
            np.concatenate([part.pixel for part in parts]),
            np.concatenate([part.middle for part in parts]),
            np.concatenate([part.half for part in parts]),
        )

    def boxes(self, pixels: int) -> MirrorImages | None:
        """Those of small images, each once; of a pixel that has too many, the largest."""
        low, high = np.clip(self.middle - self.half, 0, 1), np.clip(self.middle + self.half, 0, 1)
        area = (high - low).prod(axis=1)
        left = np.flatnonzero((area > 0) & (area < LARGEST))
        left = left[np.lexsort([-area[left], self.pixel[left]])]
        kept = []
        for _ in range(SLOTS):
            _, first, of = np.unique(self.pixel[left], return_index=True, return_inverse=True)
            largest = left[first]
            kept.append(largest)
            # Searches that end within one box have found one image.
            around, middle = largest[of], self.middle[left]
            is_same = ((middle >= low[around]) & (middle <= high[around])).all(axis=1)
            left = left[~is_same]
        chosen = np.concatenate(kept)
        chosen = chosen[np.argsort(self.pixel[chosen], kind="stable")]
        return MirrorImages(pixels, self.pixel[chosen], low[chosen], high[chosen]) if len(chosen) else None


class _Search:
    """Newton's method from points of the pixels of ``source``; what goes astray is dropped on the way."""

    def __init__(self, scene: MitsubaScene, targets: Targets, source: RaySource) -> None:
        self._scene, self._source, self._targets = scene, source, len(targets)
        self._middles, self._radii = upload(targets.middles), upload(targets.radii)

    def from_pixels(self, pixels: int, numbers: range, lanes: int) -> _Found:
        """The images found from one point of each pixel for each of the ``numbers``, so many lanes at a time."""
        step = max(1, lanes // len(numbers))
        firsts = range(0, pixels, step)
        return _Found.joined([self._from_part(first, min(step, pixels - first), numbers) for first in firsts])

    def _from_part(self, first: int, pixels: int, numbers: range) -> _Found:
        source = self._source
        lane = dr.arange(mi.UInt32, pixels * len(numbers))
        pixel, number = divide(lane, dr.opaque(mi.UInt32, len(numbers)))
        pixel += dr.opaque(mi.UInt32, first)
        number += dr.opaque(mi.UInt32, numbers.start)
        rest, channel = divide(pixel, source.channels)
        row, column = divide(rest, dr.opaque(mi.UInt32, source.width))
        stream = SampleStream.of_pixels(pixel, number, dr.opaque(mi.UInt32, _SEED))
        lanes = _Lanes(
            column,
            row,
            channel,
            stream.next_2d(_POINT),
            mi.UInt32(stream.next_1d(_EMITTER) * self._targets),
            # Direct sight is looked for half as often as each number of events: it has one way only.
            mi.UInt32(stream.next_1d(_EVENTS) * (MOST_EVENTS + 0.5) + 0.5),
            stream.next_1d(_LOBE),
        )
        # Most see no sharp surface, which a single chain tells.
        lanes = lanes.chosen(self._passes(lanes, lanes.point).arrived)
        for _ in range(STEPS - 1):
            if not len(lanes):
                return _Found.none()
            step, _, kept = self._step(lanes)
            lanes.point = lanes.point + step
            lanes = lanes.chosen(kept & (dr.max(dr.abs(lanes.point - 0.5)) < FARTHEST))
        return self._met(lanes) if len(lanes) else _Found.none()

    def _met(self, lanes: _Lanes) -> _Found:
        """Where chains now meet their emitters."""
        source = self._source
        step, half, kept = self._step(lanes)
        kept &= self._passes(lanes, lanes.point).meets
        middle = lanes.point + step
        cell = dr.floor(middle)
        column, row = mi.Int32(lanes.column) + mi.Int32(cell.x), mi.Int32(lanes.row) + mi.Int32(cell.y)
        kept &= (column >= 0) & (column < source.width) & (row >= 0) & (row < source.height) & (half.x > 0)
        number = pixel_number(source, mi.UInt32(column), mi.UInt32(row)) * source.channels + lanes.channel
        middle -= cell
        dr.eval(kept, number, middle, half)
        met = np.array(kept)
        return _Found(np.array(number)[met], np.array(middle).T[met], np.array(half).T[met])

    def _step(self, lanes: _Lanes) -> tuple[Point2f, Point2f, Bool]:
        """The step to the image, the half sides of its box, 0 where the emitter is not met yet, and what goes on."""
        # From each point and from those beside it, by three lanes.
        number = len(lanes)
        side, at = divide(dr.arange(mi.UInt32, 3 * number), dr.opaque(mi.UInt32, number))
        beside = mi.Point2f(dr.select(side == 1, _DIFFERENCE, 0.0), dr.select(side == 2, _DIFFERENCE, 0.0))
        every = lanes.at(at)
        passed = self._passes(every, every.point + beside)
        missed, arrives = passed.by, passed.arrived
        dr.eval(missed, arrives)
        parts = [dr.arange(mi.UInt32, number) + dr.opaque(mi.UInt32, number * part) for part in range(3)]
        miss, right, below = (
            mi.Vector3f(*(dr.gather(mi.Float, each, part) for each in (missed.x, missed.y, missed.z))) for part in parts
        )
        arrived = dr.gather(mi.Bool, arrives, parts[0])
        for part in parts[1:]:
            arrived &= dr.gather(mi.Bool, arrives, part)
        a, b = (right - miss) / _DIFFERENCE, (below - miss) / _DIFFERENCE
        # Least squares: the way past a middle is at right angles to the ray, in a plane of its own for each.
        aa, ab, bb, am, bm = dr.dot(a, a), dr.dot(a, b), dr.dot(b, b), dr.dot(a, miss), dr.dot(b, miss)
        determinant = aa * bb - ab * ab
        kept = arrived & (determinant > _ALIKE * aa * bb)
        step = mi.Point2f(ab * bm - bb * am, ab * am - aa * bm) / determinant
        step *= dr.minimum(1, LONGEST_STEP / dr.maximum(dr.norm(mi.Vector2f(step)), 1e-9))
        radius = dr.gather(mi.Float, self._radii, lanes.emitter)
        half = MARGIN * radius * mi.Point2f(dr.safe_sqrt(bb / determinant), dr.safe_sqrt(aa / determinant))
        half = dr.select(dr.norm(miss) < radius, dr.maximum(half, NARROWEST), 0)
        return step, half, kept

    def _passes(self, lanes: _Lanes, point: Point2f) -> _Passed:
        ray = self._source.rays(lanes.column, lanes.row, lanes.channel, point)
        last, arrived = _followed(self._scene, ray, lanes.events, lanes.lobe)
        middle = dr.gather(mi.Point3f, self._middles, lanes.emitter)
        along = dr.dot(middle - last.o, last.d)
        met = self._scene.ray_intersect_preliminary(last, coherent=False, active=arrived)
        meets = met.is_valid() & met.shape.is_emitter()
        return _Passed(last.o + along * last.d - middle, arrived & (along > 0), meets)


@dataclass
class _Passed:
    """How chains came by their emitters: the way from its middle, whether they came so far, and met any emitter."""

    by: Vector3f
    arrived: Bool
    meets: Bool


@dataclass
class _Lanes:
    """Points of pixels, and the emitters and events by which their chains are to meet them."""

    column: UInt32
    row: UInt32
    channel: UInt32
    point: Point2f
    emitter: UInt32
    events: UInt32
    lobe: Float

    def __len__(self) -> int:
        return int(dr.width(self.column))

    def chosen(self, kept: Bool) -> _Lanes:
        """Those that are kept."""
        every = [self.column, self.row, self.channel, self.point, self.emitter, self.events, self.lobe]
        dr.eval(kept, every)
        lanes = self.at(dr.compress(kept))
        dr.eval(lanes.column, lanes.row, lanes.channel, lanes.point, lanes.emitter, lanes.events, lanes.lobe)
        return lanes

    def at(self, place: UInt32) -> _Lanes:
        """Those at some places."""
        column, row, channel, emitter, events = (
            dr.gather(mi.UInt32, each, place)
            for each in (self.column, self.row, self.channel, self.emitter, self.events)
        )
        x, y, lobe = (dr.gather(mi.Float, each, place) for each in (self.point.x, self.point.y, self.lobe))
        return _Lanes(column, row, channel, mi.Point2f(x, y), emitter, events, lobe)


@dr.syntax
def _followed(scene: MitsubaScene, ray: Ray3f, events: UInt32, lobe: Float) -> tuple[Ray3f, Bool]:
    """Rays after so many sharp events, and whether they get that far."""
    context = mi.BSDFContext()
    ray = mi.Ray3f(ray)
    left = mi.UInt32(events)
    active, arrived = left > 0, mi.Bool(True)
    while dr.hint(active, label="search"):
        si = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        bsdf = si.bsdf(ray)
        active &= si.is_valid()
        narrow = sharp_lobe(si, bsdf, active)
        bs, weight = bsdf.sample(context, si, lobe, mi.Point2f(0.5), active)
        # Of a lobe of some width the middle, so that the way follows from the point alone.
        is_mirrored = (dr.squared_norm(narrow) > 0) & (bs.wo.z * si.wi.z > 0)
        bs.wo = dr.select(is_mirrored, 2 * dr.dot(si.wi, narrow) * narrow - si.wi, bs.wo)
        active &= follows_sharply(si, narrow, bs) & (dr.max(weight) > 0)
        arrived &= active
        ray = si.spawn_ray(si.to_world(bs.wo))
        left -= dr.select(mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null), mi.UInt32(0), mi.UInt32(1))
        active &= left > 0
    return ray, arrived
