"""The camera grid that is equivalent to a display's views, and the disparity between neighbouring cameras.

The views of a display are the pictures of pinhole cameras at the viewing distance D. A lens (pitch p) is one pixel of a
camera; a pixel under the lenses (size d) is one camera, at the baseline ``B = d D / g`` from its neighbour (g is the
gap). All cameras look straight ahead. Their image planes are shifted so that the frames coincide in the lens plane, the
focus plane, at the distance F = D.

A point at the distance Z along the axis moves from view to view by the disparity, in pixels, of the 4D Light Field
Benchmark (K. Honauer et al., A Dataset and Evaluation Methodology for Depth Estimation on 4D Light Fields, 2016):

    disparity = (B f F R / Z - B f R) / (F S) = B / p (F / Z - 1)

Here f is the focal length and S the size of a sensor with R pixels; a pixel covers ``p = F S / (f R)`` of the focus
plane. The disparity of a point nearer than the focus plane is positive: the next camera to the right sees the point so
much further left, the next camera below so much higher.

Parallel views (D infinite) are equivalent to no camera at a finite distance. Stand-in cameras at a distance F see the
same pictures of a scene that is compressed along the axis: the height z over the lens plane becomes ``z F / (F + z)``.
Disparities are exact, ``d z / (g p)``; depths are exact to first order in z / F.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display, LensArray, Panel
from lippmann.errors import PictureError, UsageError

Real = NDArray[np.float64]

#: Distance of stand-in cameras over the depth that a display of parallel views resolves: within that depth the error
#: of the compressed depth is at most 1 %.
STAND_IN = 100.0

#: Focus distance over distance below which a float32 disparity cannot be told from that of infinity.
_INFINITE = 1e-6


@dataclass(frozen=True, eq=False)
class Cameras:
    """A grid of equal pinhole cameras with parallel axes; lengths in millimetres.

    Parameters
    ----------
    baseline:
        Distance between neighbouring cameras.
    focus_distance:
        Distance from the cameras to the focus plane, in which their frames coincide.
    pixel_pitch:
        Width of a pixel in the focus plane.
    parallel:
        Whether these are stand-in cameras of parallel views.
    center:
        Position ``(x, y)`` of the centre of the grid in the display frame, in front of the middle of the lenses: the
        axis of the middle camera passes the middle of its frame, and layouts have no other principal point. Where
        lenses stand beside their pixels, the display's own cameras lie off by ``s``, and points at the height z off by
        ``s z / focus_distance``.
    world_from_display:
        ``(4, 4)`` affine map from the display frame, whose lens plane is the focus plane, to the world.
    """

    baseline: float
    focus_distance: float
    pixel_pitch: float
    parallel: bool = False
    center: tuple[float, float] = (0.0, 0.0)
    world_from_display: Real = field(default_factory=lambda: np.eye(4))

    # ---- Disparity and depth --------------------------------------------------------------------------------------

    def disparity(self, axial_depth: Real) -> Real:
        """Disparity in pixels per view of points at ``axial_depth`` (mm along the axis, may be infinite)."""
        return self.baseline / self.pixel_pitch * (self.focus_distance / axial_depth - 1.0)

    def disparity_of_height(self, z: Real) -> Real:
        """Disparity in pixels per view of points at the height ``z`` (mm) over the lens plane; NaN where it is -inf.

        A ray that meets nothing has no disparity: that of infinity would be a surface to every tool that reads it.
        """
        is_finite = np.isfinite(z)
        height = np.where(is_finite, z, 0.0)
        share = height / (self.focus_distance - (0.0 if self.parallel else height))
        return self.baseline / self.pixel_pitch * np.where(is_finite, share, np.nan)

    def depth_of_disparity(self, disparity: Real) -> Real:
        """Distance in mm along the axis of points with this disparity; infinite where it is NaN or beyond float32."""
        share = disparity * (self.pixel_pitch / self.baseline) + 1.0
        is_near = share > _INFINITE
        return np.where(is_near, self.focus_distance / np.where(is_near, share, 1.0), np.inf)

    def axial_depth(self, z: Real) -> Real:
        """Distance in mm from the cameras, along the axis, of points at the height ``z`` (mm) over the lens plane.

        A height of minus infinity, where a ray meets nothing, becomes an infinite distance.

        Raises
        ------
        PictureError
            If a point lies behind the lens plane by the distance of stand-in cameras or more: its compressed depth
            would lie beyond infinity.
        """
        is_finite = np.isfinite(z)
        height = np.where(is_finite, z, 0.0)
        if not self.parallel:
            return np.where(is_finite, self.focus_distance - height, np.inf)
        lowest = float(height.min(initial=0.0))
        if lowest <= -self.focus_distance:
            rule = f"stand-in cameras at {self.focus_distance:g} mm show depths up to that distance"
            raise PictureError(
                f"a surface lies {-lowest:g} mm behind the lens plane", rule=rule, fix="say distance=..."
            )
        return np.where(is_finite, self.focus_distance**2 / (self.focus_distance + height), np.inf)

    def height(self, axial_depth: Real) -> Real:
        """Height in mm over the lens plane of points at ``axial_depth`` (mm); the inverse of :meth:`axial_depth`."""
        if not self.parallel:
            return self.focus_distance - axial_depth
        return np.where(np.isinf(axial_depth), -np.inf, self.focus_distance**2 / axial_depth - self.focus_distance)

    # ---- Displays -------------------------------------------------------------------------------------------------

    @staticmethod
    def of_display(display: Display, distance: float | None = None) -> Cameras:
        """The cameras that are equivalent to a display's views.

        Parameters
        ----------
        display:
            The display.
        distance:
            For parallel views only: distance of the stand-in cameras from the lens plane, in mm. None: 100 times the
            depth that the display resolves behind the lens plane.

        Raises
        ------
        UsageError
            If ``distance`` is not positive, or the display has a finite viewing distance.
        """
        parallel = math.isinf(display.viewing_distance)
        if distance is not None and not parallel:
            rule = f"the views of {display.name} meet at its viewing distance of {display.viewing_distance:g} mm"
            raise UsageError("is for parallel views", parameter="distance", rule=rule)
        if distance is not None and not 0 < distance < math.inf:
            raise UsageError(f"{distance:g} mm is out of range", parameter="distance", rule="it must be above zero")
        focus = display.viewing_distance
        if parallel:
            focus = -STAND_IN * display.resolvable_depth[1] if distance is None else distance
        baseline = display.panel.pixel_pitch * focus / display.gap
        lattice, grid = display.lattice, display.lens_grid
        right = lattice.origin_x + 0.5 * (grid.columns - 1) * lattice.pitch
        down = 0.0 if grid.rows == 1 else 0.5 * (grid.rows - 1) * lattice.row_pitch
        return Cameras(baseline, focus, lattice.pitch, parallel, (right, lattice.origin_y - down))

    def display(self, views: int, width: int, height: int, *, where: str = "") -> Display:
        """The square micro-lens array whose views are ``views`` x ``views`` of these cameras.

        One lens per pixel of a camera: pitch p, gap ``g = p F / (views B - p)``.

        Parameters
        ----------
        views:
            Cameras across, and down.
        width, height:
            Pixels of each camera.
        where:
            The file that describes the cameras, for messages.

        Raises
        ------
        PictureError
            If the baseline is so small that the gap would not be positive.
        """
        spread = views * self.baseline - self.pixel_pitch
        if spread <= 0:
            rule = f"they must span more than one pixel of the focus plane, {self.pixel_pitch:g} mm"
            what = f"{views} cameras with the baseline {self.baseline:g} mm span {views * self.baseline:g} mm"
            raise PictureError(what, where=where, rule=rule, fix="say display=...")
        gap = self.pixel_pitch * self.focus_distance / spread
        pixel_pitch = gap * self.baseline / self.focus_distance
        return Display(
            name=f"cameras-{views}x{views}",
            title=f"As {views}x{views} cameras {self.baseline:g} mm apart see it from {self.focus_distance:g} mm",
            panel=Panel(views * width, views * height, pixel_pitch),
            lens_array=LensArray("square", self.pixel_pitch),
            gap=gap,
            viewing_distance=self.focus_distance,
            # The cameras see everything in front of them, but the aperture has to lie between them and the display.
            aperture_distance=math.nextafter(self.focus_distance, 0.0),
        )
