"""The viewing zone: where an eye sees the whole display show one set of views, without a jump between two.

It is determined by the screen's width W, the distance D at which the central views meet, and the width B over which
the views are seen from there (Dodgson, Proc. SPIE 4660, 2002). From a distance z an eye sees all of one set over
``B z / D - W |1 - z / D|``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ViewingZone:
    """Region from which the whole display shows one set of views.

    Attributes
    ----------
    screen:
        Width W of the lenses whose pixels lie on the panel, in mm.
    distance:
        Distance D at which the central views of all lenses meet, in mm; infinite if they are parallel.
    slope:
        Half the range of slopes of the views of one lens: B is twice ``slope D``.
    """

    screen: float
    distance: float
    slope: float

    def width_at(self, distance: float) -> float:
        """Width in mm of the zone at a distance from the lenses; 0 where no eye sees one set on the whole display."""
        return max(0.0, 2.0 * distance * self.slope - self.screen * abs(1.0 - distance / self.distance))

    @property
    def nearest(self) -> float:
        """Least distance in mm of an eye in the zone, straight ahead."""
        return self.screen / (2.0 * self.slope + self.screen / self.distance)

    @property
    def farthest(self) -> float:
        """Greatest distance in mm, infinite where the zone does not end."""
        narrowing = self.screen / self.distance - 2.0 * self.slope
        return self.screen / narrowing if narrowing > 0.0 else math.inf
