"""Two eyes in front of a display: the side-by-side pairs of eye-tracked monitors, and binocular disparity."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from lippmann.display.validation import finite
from lippmann.errors import DisplayError

#: Mean distance between the pupils of adults, mm: N. A. Dodgson, "Variation and extrema of human interpupillary
#: distance", Proc. SPIE 5291 (2004).
EYE_DISTANCE = 63.0

#: Least and largest distance between the eyes of a viewer, mm: children's to the extremes of the same survey.
EYE_DISTANCES = (40.0, 80.0)

#: Disparity in degrees, crossed or uncrossed, up to which a stereo picture is comfortable: M. Lambooij et al., "Visual
#: discomfort and visual fatigue of stereoscopic displays: a review", J. Imaging Sci. Technol. 53 (2009).
COMFORTABLE = 1.0

#: Whether each eye's picture has all columns of the panel, or half of them.
PairWidth = Literal["full", "half"]


@dataclass(frozen=True)
class StereoPair:
    """The picture that an eye-tracked monitor takes: left and right eye's side by side, the left eye's on the left.

    Parameters
    ----------
    eyes:
        Distance between the eyes in mm, 40 to 80.
    width:
        ``full``: each eye's picture has all columns of the panel. ``half``: each has half of them, and is shown at
        twice its width.

    Raises
    ------
    DisplayError
        If a value is out of range.
    """

    eyes: float = EYE_DISTANCE
    width: PairWidth = "half"

    def __post_init__(self) -> None:
        least, most = EYE_DISTANCES
        rule = f"it must be {least:g} to {most:g} mm"
        object.__setattr__(self, "eyes", finite(self.eyes, "stereo.eyes", rule=rule))
        if not least <= self.eyes <= most:
            raise DisplayError(f"eyes is {self.eyes:g}", where="stereo.eyes", rule=rule)
        if self.width not in get_args(PairWidth):
            raise DisplayError.unknown("layout", self.width, get_args(PairWidth), where="stereo.layout")

    @property
    def panels(self) -> int:
        """How many panels' pixels both eyes' pictures have together."""
        return 2 if self.width == "full" else 1

    @property
    def ending(self) -> str:
        """The ending of the stem of a file with such a picture, by which players know it."""
        return "_2x1" if self.width == "full" else "_half_2x1"


def disparity(z: float, distance: float, eyes: float) -> float:
    """Angular disparity in degrees of a point straight ahead at height ``z`` over the panel, crossed above 0.

    The vergence angle at the point less that at the panel, for eyes at ``distance``; lengths in mm. The two eyes'
    pictures of the point lie ``K (1 - distance / (distance - z))`` apart on the panel, with K = ``eyes``.
    """
    return _vergence(distance - z, eyes) - _vergence(distance, eyes)


def depth_of_disparity(crossed: float, uncrossed: float, distance: float, eyes: float) -> tuple[float, float]:
    """Nearest and farthest z in mm whose disparity is at most ``crossed`` and ``uncrossed`` degrees.

    The farthest is minus infinity where even parallel eyes see less disparity.
    """
    straight = _vergence(distance, eyes)
    near, far = (0.5 * math.radians(straight + change) for change in (crossed, -uncrossed))
    return distance - 0.5 * eyes / math.tan(near), distance - 0.5 * eyes / math.tan(far) if far > 0.0 else -math.inf


def parallax(z: float, distance: float) -> float:
    """Distance on the panel between the two pictures of a point, uncrossed above 0, as a share of the eye distance."""
    return 1.0 - distance / (distance - z)


def perceived_height(z: float, distance: float, share: float) -> float:
    """Height at which a point at height ``z`` is seen whose pictures are taken from ``share`` of the eye distance.

    The parallax of all points is as much smaller, as K is in :func:`disparity`; lengths in mm.
    """
    return distance - distance / (1.0 - share * parallax(z, distance))


def comfortable_share(back: float, front: float, distance: float, eyes: float) -> float:
    """Share of the eye distance, at most 1, at which a scene from z = ``back`` to ``front`` mm is comfortable."""
    near, far = depth_of_disparity(COMFORTABLE, COMFORTABLE, distance, eyes)
    pairs = ((parallax(limit, distance), parallax(z, distance)) for limit, z in ((near, front), (far, back)))
    return min(1.0, *(limit / value for limit, value in pairs if limit * value > 0.0))


def _vergence(distance: float, eyes: float) -> float:
    """Angle in degrees between the sight lines of two eyes to a point straight ahead."""
    return 2.0 * math.degrees(math.atan2(0.5 * eyes, distance))
