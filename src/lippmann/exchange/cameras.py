"""The cameras whose pictures the views of a display are, and how far things move from one to the next.

Seen from the viewing distance D every lens (pitch p) is a pixel of a pinhole camera that looks at the lens plane, and
every pixel (size d) under the lenses is one camera, ``B = d D / g`` beside its neighbour (g is the gap). All look
straight ahead, their frames shifted so that they coincide in the lens plane, the focus plane, at the distance F = D.

A point at the distance Z along the axis moves from view to view, in pixels, by the disparity of the 4D Light Field
Benchmark (K. Honauer et al., A Dataset and Evaluation Methodology for Depth Estimation on 4D Light Fields, 2016)

    disparity = (B f F R / Z - B f R) / (F S) = B / p (F / Z - 1)

for a focal length f and a sensor of the size S with R pixels, since a pixel covers ``p = F S / (f R)`` of the focus
plane. It is positive for what is nearer than that plane: in the view of the next camera to the right it stands so much
further left, in that of the next camera below so much higher.

Parallel views (D infinite) have no cameras at any distance. A stand-in distance F then gives cameras that see the same
pictures of a space that is squeezed along the axis: height z over the lens plane becomes ``z F / (F + z)``. So
disparities stay exact, ``d z / (g p)``, and depths are true to the first order in z / F.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display, LensArray, Panel
from lippmann.errors import PictureError, UsageError
from lippmann.image.views import view_grid

Real = NDArray[np.float64]

#: How many times the depth that a display of parallel views resolves its stand-in cameras are away: within that depth
#: the squeezed space is true to 1 %.
STAND_IN = 100.0

#: Focus distance over distance below which a disparity of 32 bits is that of infinity.
_INFINITE = 1e-6


@dataclass(frozen=True, eq=False)
class Cameras:
    """A grid of equal pinhole cameras; lengths in millimetres.

    Parameters
    ----------
    baseline:
        Distance between neighbouring cameras.
    focus_distance:
        From the cameras to the plane where their frames coincide.
    pixel_pitch:
        Size of a pixel in that plane, across.
    parallel:
        Whether they stand in for parallel views.
    center:
        Place ``(x, y)`` of the middle of the grid in the display frame.
    world_from_display:
        ``(4, 4)`` placement of the display frame whose lens plane is the focus plane.
    """

    baseline: float
    focus_distance: float
    pixel_pitch: float
    parallel: bool = False
    center: tuple[float, float] = (0.0, 0.0)
    world_from_display: Real = field(default_factory=lambda: np.eye(4))

    # ---- Disparity and depth --------------------------------------------------------------------------------------

    def disparity(self, axial_depth: Real) -> Real:
        """Disparity in pixels of points at these distances (mm, infinity allowed) along the axis."""
        return self.baseline / self.pixel_pitch * (self.focus_distance / axial_depth - 1.0)

    def disparity_of_height(self, z: Real) -> Real:
        """Disparity of points at the height ``z`` (mm) over the lens plane; of infinity where z is minus infinity."""
        seen = np.isfinite(z)
        height = np.where(seen, z, 0.0)
        share = height / (self.focus_distance - (0.0 if self.parallel else height))
        return self.baseline / self.pixel_pitch * np.where(seen, share, -1.0)

    def depth_of_disparity(self, disparity: Real) -> Real:
        """The inverse of :meth:`disparity`; what that cannot tell from infinity, or lies beyond, is infinitely far."""
        share = disparity * (self.pixel_pitch / self.baseline) + 1.0
        is_near = share > _INFINITE
        return np.where(is_near, self.focus_distance / np.where(is_near, share, 1.0), np.inf)

    def axial_depth(self, z: Real) -> Real:
        """Distance from the cameras, along the axis, of points at the height ``z`` over the lens plane; both in mm.

        Minus infinity, where nothing is seen, becomes infinity.

        Raises
        ------
        PictureError
            If stand-in cameras are too near to see a point: one that far behind the lens plane would lie beyond
            infinity in their space.
        """
        seen = np.isfinite(z)
        height = np.where(seen, z, 0.0)
        if not self.parallel:
            return np.where(seen, self.focus_distance - height, np.inf)
        lowest = float(height.min(initial=0.0))
        if lowest <= -self.focus_distance:
            rule = f"cameras at {self.focus_distance:g} mm that stand for parallel views show what is nearer than that"
            raise PictureError(f"a surface lies {-lowest:g} mm behind the lens plane", rule=rule, fix="say --distance")
        return np.where(seen, self.focus_distance**2 / (self.focus_distance + height), np.inf)

    def height(self, axial_depth: Real) -> Real:
        """The inverse of :meth:`axial_depth`."""
        if not self.parallel:
            return self.focus_distance - axial_depth
        return np.where(np.isinf(axial_depth), -np.inf, self.focus_distance**2 / axial_depth - self.focus_distance)

    # ---- Displays -------------------------------------------------------------------------------------------------

    @staticmethod
    def of_display(display: Display, distance: float | None = None) -> Cameras:
        """The cameras of a display's views.

        ``distance`` (mm) says where stand-in cameras of parallel views are; by default at 100 times the depth that the
        display resolves.

        Raises
        ------
        UsageError
            If a distance is given where the display has a viewing distance of its own, or it is not above zero.
        """
        parallel = math.isinf(display.viewing_distance)
        if distance is not None and not parallel:
            rule = f"the views of {display.name} meet at its viewing distance of {display.viewing_distance:g} mm"
            raise UsageError("is for parallel views", where="--distance", rule=rule)
        if distance is not None and not 0 < distance < math.inf:
            raise UsageError(f"{distance:g} mm will not do", where="--distance", rule="it must be above zero")
        focus = display.viewing_distance
        if parallel:
            focus = -STAND_IN * display.resolvable_depth[1] if distance is None else distance
        baseline = display.panel.pixel_pitch * focus / display.gap
        grid = view_grid(display)
        middle = -baseline * float(np.mean(grid.right)), baseline * float(np.mean(grid.down))
        return Cameras(baseline, focus, display.lattice.pitch, parallel, middle)

    def display(self, views: int, width: int, height: int, *, where: str = "") -> Display:
        """The square micro-lens array whose lenses show ``views`` x ``views`` such cameras, each of these pixels.

        One lens per pixel: ``p`` wide, with the gap ``g = p F / (views B - p)``.

        Raises
        ------
        PictureError
            If the cameras are so near to each other that the gap would not be above zero.
        """
        spread = views * self.baseline - self.pixel_pitch
        if spread <= 0:
            rule = f"they must span more than a pixel of the focus plane, {self.pixel_pitch:g} mm"
            what = f"{views} cameras {self.baseline:g} mm apart make no display"
            raise PictureError(what, where=where, rule=rule, fix="say --display")
        gap = self.pixel_pitch * self.focus_distance / spread
        pixel_pitch = gap * self.baseline / self.focus_distance
        return Display(
            name=f"cameras-{views}x{views}",
            title=f"As {views}x{views} cameras {self.baseline:g} mm apart see it from {self.focus_distance:g} mm",
            panel=Panel(views * width, views * height, pixel_pitch),
            lens_array=LensArray("square", self.pixel_pitch),
            gap=gap,
            viewing_distance=self.focus_distance,
            # The cameras see all that is in front of them; the aperture has to be in front of the viewer.
            aperture_distance=math.nextafter(self.focus_distance, 0.0),
        )
