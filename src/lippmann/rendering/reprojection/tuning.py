"""The numbers that the methods are tuned by.

``benchmarks/reuse.py`` measures their effect: with light as in the paper, and with sampled light.
"""

from __future__ import annotations

from typing import NamedTuple


class Tuning(NamedTuple):
    """A named tuple, not a dataclass, so that compiled kernels can read it.

    Attributes
    ----------
    key_stride:
        Lenses from one key micro-image to the next; in two more rounds its root, and 1. A stride of 16 instead of 2
        traces a quarter fewer pixels of 512x512 at the same PSNR; halving it in each round takes twice the rounds for 0
        to 2 % fewer traced pixels.
    one_surface:
        Neighbouring pixels see one surface if their disparities differ by at most this part of the larger: a surface
        that turns away from the viewer by up to 75 degrees, on a display with a field of 18 degrees and 8 pixels under
        a lens. Sources on two sides show one point if theirs do.
    one_height:
        Pixels of a run see one surface, too, if their heights differ by at most this part of the display's gap.
    on_center:
        Pixels. A point this near to a pixel's centre lies on it: rounding must not decide.
    longest_piece:
        Pixels. A piece between two pixels of the source that is stretched to more is seen too obliquely by it.
    smallest_share:
        Least sum of bilinear weights of the pixels that stand for missing ones at the rim of a micro-image.
    close, too_far:
        Pixels. A line of sight enters a surface where the two are this close; farther apart than ``too_far`` it does
        not.
    part_tolerance:
        Part of the tolerance to which colours must agree at the rim of a micro-image, and of the two that a careful
        mean is made of: they may be wrong in the same sense.
    deviation:
        Part of the tolerance by which a traced pixel must differ from its predicted colour for the search to go on.
        With 0.5 up to 3 % more pixels are traced, for 2 to 6 dB more than 60 dB.
    around:
        Pixels to either side of such a pixel that are all traced.
    """

    key_stride: int = 16
    one_surface: float = 0.2
    one_height: float = 0.06
    on_center: float = 1e-3
    longest_piece: float = 3.0
    smallest_share: float = 0.25
    close: float = 0.02
    too_far: float = 0.2
    part_tolerance: float = 0.5
    deviation: float = 0.7
    around: int = 3


TUNING = Tuning()
