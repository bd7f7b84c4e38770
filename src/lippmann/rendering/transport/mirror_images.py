"""Images of small emitters in mirrors and glass, by which chains of sharp events are aimed.

The image of a small emitter in a curved mirror may fill a ten thousandth of a pixel. A chain through a random point of
the pixel hardly ever meets it, and brings far too much when it does. Where boxes about such images are known
(:mod:`lippmann.rendering.film.image_search`), half of the chains go through the boxes, half through the whole pixel,
and each is weighed by the density of both: so the mean is right whatever boxes there are, and only the noise depends on
them.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import upload
from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream
from lippmann.device.types import Bool, Float, Point2f, UInt32

Floats = NDArray[np.float32]

#: Boxes of a pixel, at most.
SLOTS = 8
#: Share of a pixel's chains that go through its boxes.
AIMED = 0.5
#: Sample dimension of the choice between the boxes and the whole pixel.
_CHOICE = 1 << 27


class MirrorImages:
    """Boxes about the images of emitters in the pixels or sub-pixels of a picture.

    Parameters
    ----------
    pixels:
        Number of (sub-)pixels.
    pixel:
        ``(n,)``: numbers of those that have boxes, in rising order, each once for every box; at most :data:`SLOTS`
        times.
    low, high:
        ``(n, 2)``: corners of the boxes in their pixels, 0 to 1 across and down, ``low < high``.
    """

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, pixels: int, pixel: NDArray[np.integer], low: Floats, high: Floats) -> None:
        where, rows, number = np.unique(pixel, return_inverse=True, return_counts=True)
        slot = np.arange(len(pixel)) - np.repeat(np.cumsum(number) - number, number)
        boxes = np.zeros((len(where), SLOTS, 4), np.float32)
        boxes[rows, slot] = np.concatenate([low, high], axis=1)
        # Row 0 is that of all pixels without boxes.
        row = np.zeros(pixels, np.uint32)
        row[where] = 1 + np.arange(len(where), dtype=np.uint32)
        self.pixels = pixels
        #: How many of them have boxes.
        self.with_images = len(where)
        self._row = upload(row)
        self._number = upload(np.concatenate([np.zeros(1, np.uint32), number.astype(np.uint32)]))
        self._boxes = upload(boxes)

    def point(self, pixel: UInt32, stream: SampleStream) -> tuple[Point2f, Float]:
        """A point of each lane's pixel, and one over its density there, which is at most ``1 / (1 - AIMED)``."""
        row = dr.gather(mi.UInt32, self._row, pixel, pixel < dr.opaque(mi.UInt32, self.pixels))
        number = dr.gather(mi.UInt32, self._number, row)
        point, choice = stream.next_2d(PIXEL_DIMENSION), stream.next_1d(_CHOICE)
        has_boxes = number > 0
        aimed = has_boxes & (choice < AIMED)
        slot = dr.minimum(mi.UInt32(choice / AIMED * mi.Float(number)), number - 1)
        low, high = self._box(row, slot, aimed)
        point = dr.select(aimed, mi.Point2f(low + (high - low) * point), point)
        density = mi.Float(0)
        for other in range(SLOTS):
            active = has_boxes & (other < number)
            low, high = self._box(row, mi.UInt32(other), active)
            within = active & dr.all((point >= low) & (point <= high))
            density += dr.select(within, dr.rcp((high.x - low.x) * (high.y - low.y)), 0)
        density = dr.select(has_boxes, (1 - AIMED) + AIMED * density / mi.Float(number), 1)
        return point, dr.rcp(density)

    def _box(self, row: UInt32, slot: UInt32, active: Bool) -> tuple[Point2f, Point2f]:
        at = ((row - 1) * SLOTS + slot) * 4
        x0, y0, x1, y1 = (dr.gather(mi.Float, self._boxes, at + place, active) for place in range(4))
        return mi.Point2f(x0, y0), mi.Point2f(x1, y1)
