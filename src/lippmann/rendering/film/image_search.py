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
from lippmann.device.types import MitsubaScene
from lippmann.rendering.film import memory_model
from lippmann.rendering.film.image_approach import Lanes, approached, begins
from lippmann.rendering.transport.mirror_images import SLOTS, MirrorImages
from lippmann.rendering.transport.ray_source import DisplayRays, RaySource, SubpixelRays, pixel_number

Floats = NDArray[np.float32]

#: Searches from each pixel: one for so many of its samples, within limits; and in the whole picture, at least.
SAMPLES_OF_SEARCH, FEWEST, MOST, FEWEST_IN_ALL = 2, 2, 8, 1 << 15
#: Sharp events between the pixel and the emitter, at most; without any, it is seen directly.
MOST_EVENTS = 4
#: Images that fill more than this part of a pixel are met by chains at random.
LARGEST = 0.25
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


def _has_uneven_environment(scene: MitsubaScene) -> bool:
    """Whether something small may shine that no search finds; emitters without size are sampled, and never missed."""
    environment = scene.environment()
    return environment is not None and mi.has_flag(environment.flags(), mi.EmitterFlags.SpatiallyVarying)


@dataclass(frozen=True, eq=False)
class ImageSearch:
    """What a search came to.

    Attributes
    ----------
    images:
        Small ones; None where there are none.
    none_small:
        Whether it was made and found no small image, of emitters that are all looked for.
    """

    images: MirrorImages | None
    none_small: bool = False


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
    looks_for_all = not _has_uneven_environment(scene)
    if not len(targets):
        return ImageSearch(None, none_small=looks_for_all)
    if lanes < memory_model.SMALLEST_LANES:
        return ImageSearch(None)
    search = _Search(scene, targets, rays)
    fewest = max(FEWEST, -(-FEWEST_IN_ALL // pixels))
    found = search.from_pixels(pixels, range(fewest), lanes)
    searches = max(fewest, min(samples // SAMPLES_OF_SEARCH, MOST))
    if len(found) and searches > fewest:
        found = _Found.joined([found, search.from_pixels(pixels, range(fewest, searches), lanes)])
    images = found.boxes(pixels)
    return ImageSearch(images, none_small=looks_for_all and images is None)


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
        lanes = Lanes(
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
        lanes = lanes.chosen(begins(self._scene, source, lanes))
        return self._met(lanes) if len(lanes) else _Found.none()

    def _met(self, lanes: Lanes) -> _Found:
        """Where chains come to meet their emitters."""
        source = self._source
        emitter = dr.gather(mi.Point3f, self._middles, lanes.emitter)
        radius = dr.gather(mi.Float, self._radii, lanes.emitter)
        middle, half, last, kept = approached(self._scene, source, lanes, emitter, radius)
        hit = self._scene.ray_intersect_preliminary(last, coherent=False, active=kept)
        kept &= hit.is_valid() & hit.shape.is_emitter()
        cell = dr.floor(middle)
        column, row = mi.Int32(lanes.column) + mi.Int32(cell.x), mi.Int32(lanes.row) + mi.Int32(cell.y)
        kept &= (column >= 0) & (column < source.width) & (row >= 0) & (row < source.height) & (half.x > 0)
        number = pixel_number(source, mi.UInt32(column), mi.UInt32(row)) * source.channels + lanes.channel
        middle -= cell
        dr.eval(kept, number, middle, half)
        met = np.array(kept)
        return _Found(np.array(number)[met], np.array(middle).T[met], np.array(half).T[met])
