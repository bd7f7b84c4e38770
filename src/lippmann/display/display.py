"""A panel behind a lens array: which lens shows a pixel, which ray a pixel records, which pixel sees a point.

Geometry (display frame, millimetres, right-handed: origin at the array's centre in the lens plane, +x right, +y up,
+z toward the viewer; the panel lies at z = -gap g, the lens centres at z = 0):

- The lens that shows the panel point q is the one that contains ``q D / (D + g)`` in the lens plane, D being the
  viewing distance: seen from (0, 0, D), q lies exactly behind that point. So a micro-image is ``p (D + g) / D`` wide.
- The light line of q runs through q and the centre of its lens. A cylindrical lens bends across its axis only: there
  the line runs through the axis, and along the axis it aims at the viewer's point (0, 0, D), or runs parallel to z if
  D is infinite. In coordinates across (u) and along (v) the lens it is ``u(z) = c + (c - u_q) z / g`` and
  ``v(z) = v_q (D - z) / (D + g)``.
- The ray traced is that line backwards, from ``aperture distance`` in front of the lens plane, away from the viewer.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

from lippmann.display.array_ops import NUMPY, Array, ArrayOps
from lippmann.display.distortion import Distortion
from lippmann.display.lens_array import WHOLE_TOLERANCE, Lattice, LensArray, LensGrid, lattice_in_front_of
from lippmann.display.lens_profile import LensProfile
from lippmann.display.panel import Panel
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.display.sheet import Sheet
from lippmann.display.stereo import COMFORTABLE, StereoPair, depth_of_disparity
from lippmann.display.validation import Table, check_keys, check_kind, check_text, number, positive
from lippmann.errors import DisplayError
from lippmann.json_values import JsonObject
from lippmann.runtime.engine_lock import cached_property
from lippmann.wording import html_table

#: Infinite viewing distances in files.
INFINITE = "infinite"

Vector = tuple[Array, Array, Array]

#: Tables of a display that may be left out.
OPTIONAL_TABLES: dict[
    str, type[Sheet] | type[LensProfile] | type[Distortion] | type[PixelAperture] | type[StereoPair]
] = {
    "sheet": Sheet,
    "lens": LensProfile,
    "distortion": Distortion,
    "pixel": PixelAperture,
    "stereo": StereoPair,
}

#: A scene point is resolved while it spreads over at most one lens pitch, or over so small a share of the panel's
#: shorter side: a large panel of fine lenses is sharp to its viewer long after single lenses are not.
RESOLVED_SHARE = 1.0 / 150.0


@dataclass(frozen=True)
class Display:
    """An integral-imaging display.

    Parameters
    ----------
    name:
        Short name for files and tables, such as ``seed-lenticular``.
    panel, lens_array:
        The pixels and the lenses.
    gap:
        Air-equivalent distance from the panel to the plane of the lens centres in millimetres.
    title:
        One line for people.
    viewing_distance:
        Distance in front of the lens plane at which the central rays of all lenses meet, in millimetres; ``math.inf``
        allowed.
    aperture_distance:
        Distance in front of the lens plane at which the recorded rays begin, in millimetres: at least 0, below the
        viewing distance. Nothing nearer to the viewer is recorded.
    sheet:
        Bleed, margin and printing of a print; None for displays that are no prints.
    lens:
        Profile of the lenses; None for a pinhole at the gap. The gap of a profile is that of
        :func:`lippmann.optics.fitting.gap_of`.
    pixel:
        The part of a sub-pixel that shines; None for the whole of it.
    distortion:
        How the true directions of the lenses differ from those of a pinhole at the gap, see
        :func:`lippmann.optics.directions.distortion_of`; None for the pinhole's.
    stereo:
        The side-by-side picture that an eye-tracked monitor takes; None for displays that take native pixels or quilts.

    Notes
    -----
    Without an explicit offset the lenses are aligned with the panel, axis by axis: if the number of micro-images
    across the panel is whole and even, a boundary between two lenses lies at the origin, else a lens centre does; so
    whole micro-images tile the panel exactly. A slanted sheet has a lens axis through the origin.

    A number of micro-images that is whole to one part in a million is taken as whole: the pitch in effect is then the
    one that makes it exact, so that rounded input does not leave slivers of lenses at the edges.

    Methods that take ``ops`` work on arrays of any one shape, element by element; indices of lenses are reals that
    hold whole numbers.

    Raises
    ------
    DisplayError
        If a value is out of range, or a lens has more pixels than the panel, or less than one.

    Examples
    --------
    >>> panel, lenses = lippmann.Panel(60, 40, pixel_pitch=0.1), lippmann.LensArray("square", pitch=1.0)
    >>> lippmann.Display("mine", panel, lenses, gap=3.0).panel.width
    60
    """

    name: str
    panel: Panel
    lens_array: LensArray
    gap: float
    title: str = ""
    viewing_distance: float = math.inf
    aperture_distance: float = 0.0
    sheet: Sheet | None = None
    lens: LensProfile | None = None
    pixel: PixelAperture | None = None
    distortion: Distortion | None = None
    stereo: StereoPair | None = None

    def __post_init__(self) -> None:
        check_text(self.name, "name", empty=False)
        check_text(self.title, "title")
        check_kind(self.panel, Panel, "panel")
        check_kind(self.lens_array, LensArray, "lens_array")
        object.__setattr__(self, "gap", positive(self.gap, "gap"))
        rule = "it must be a length above zero, or infinite"
        viewing_distance = number(self.viewing_distance, "viewing_distance", rule=rule)
        if viewing_distance <= 0:
            raise DisplayError(f"viewing_distance is {viewing_distance:g} mm", where="viewing_distance", rule=rule)
        object.__setattr__(self, "viewing_distance", viewing_distance)
        rule = "it must be a length of zero or more, below the viewing distance"
        aperture_distance = number(self.aperture_distance, "aperture_distance", rule=rule)
        if not 0 <= aperture_distance < viewing_distance:
            raise DisplayError(f"aperture_distance is {aperture_distance:g} mm", where="aperture_distance", rule=rule)
        object.__setattr__(self, "aperture_distance", aperture_distance)
        self._check_pixels_per_lens()
        self._check_sheet()
        if self.lens is not None:
            self.lens.check(self.lens_array)
        if self.pixel is not None:
            self.pixel.lit_size(self.panel)

    def _check_sheet(self) -> None:
        if self.sheet is None:
            return
        if self.lens_array.layout != "lenticular" or self.lens_array.slant:
            raise DisplayError("sheet is given", where="sheet", rule="prints have upright cylindrical lenses")
        least = min(self.panel.width, self.panel.height)
        if 2 * self.sheet.border >= least:
            what = f"bleed and margin take {2 * self.sheet.border} of {least} pixels"
            raise DisplayError(what, where="sheet", rule="they must leave some of the picture")

    def _check_pixels_per_lens(self) -> None:
        key, fix = "lens_array.pitch", "look at the units of pitch and pixel_pitch"
        for count, available, direction in zip(
            self.pixels_per_lens, (self.panel.width, self.panel.height), ("across", "down"), strict=True
        ):
            if count is None:
                continue
            if count > available * (1 + WHOLE_TOLERANCE):
                rule = f"the panel has only {available}"
                raise DisplayError(f"a lens covers {count:.6g} pixels {direction}", where=key, rule=rule, fix=fix)
            if count < 1 - WHOLE_TOLERANCE:
                rule = "it must cover at least one"
                raise DisplayError(f"a lens covers {count:.6g} pixels {direction}", where=key, rule=rule, fix=fix)

    # ---- Sizes -----------------------------------------------------------------------------------------------------

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the panel in millimetres."""
        return self.panel.size_mm

    @property
    def magnification(self) -> float:
        """Size of a micro-image relative to its lens, (D + g) / D; 1 if D is infinite."""
        return 1.0 + self.gap * self._convergence

    @property
    def micro_image_pitch(self) -> float:
        """Distance between neighbouring micro-images on the panel, across the lenses, in millimetres."""
        return self.lens_array.pitch * self.magnification

    @property
    def pixels_per_lens(self) -> tuple[float, float | None]:
        """Pixels of one micro-image across and from row to row; ``None`` for the latter if lenticular.

        Across means along a pixel row, so the slant counts: ``p (D + g) / (D d cos slant)``.
        """
        across = self.micro_image_pitch / (self.panel.pixel_pitch * math.cos(math.radians(self.lens_array.slant)))
        if self.lens_array.layout == "lenticular":
            return across, None
        return across, self.lens_array.row_spacing * self.magnification / self.panel.pixel_pitch

    @property
    def lens_grid(self) -> LensGrid:
        """The lenses that own at least one point inside the panel."""
        return self._lenses[1]

    @property
    def lattice(self) -> Lattice:
        """Lens centres in the lens plane: aligned with the panel, and counted as in :attr:`lens_grid`."""
        return self._lenses[0]

    # ---- What the display can show ---------------------------------------------------------------------------------

    @property
    def edge_factor(self) -> float:
        """Slope of the outermost views over that behind a pinhole at the gap; 1 for the pinhole."""
        half = 0.5 * self.micro_image_pitch
        return float(self.pinhole_place(half)) / half

    @property
    def field_of_view(self) -> float:
        """Angle in degrees, across the lenses, over which the central lens shows its own micro-image."""
        return math.degrees(2 * math.atan(0.5 * self.micro_image_pitch * self.edge_factor / self.gap))

    def reach_of_views(self, z: float) -> tuple[float, float]:
        """Farthest distance from the middle, in mm along x and y, of the panel's light lines at height ``z``."""
        # A light line meets the panel at q, d away from the middle of its micro-image: at height z it lies at
        # (q - d) / m (1 - z / D) - z d / g.
        nearness = (1.0 - z * self._convergence) / self.magnification
        across, along = (
            max(
                abs((0.5 * side - d) * nearness - z * d * self.edge_factor / self.gap)
                for d in (self.magnification * edge, -self.magnification * edge)
            )
            for side, edge in zip(self.size_mm, self.lens_array.half_cell, strict=True)
        )
        return across, along

    @property
    def resolved_size(self) -> float:
        """Millimetres of the lens plane below which the display's viewers tell nothing apart."""
        cut_off = 0 if self.sheet is None else 2 * self.sheet.border * self.panel.pixel_pitch
        return max(self.lens_array.pitch, RESOLVED_SHARE * (min(self.size_mm) - cut_off))

    @property
    def resolvable_depth(self) -> tuple[float, float]:
        """Nearest and farthest z in millimetres that the display resolves, at most up to the viewer.

        A point is held to be resolved while the light of one pixel, at its height, spreads over at most one lens pitch,
        the display's own sampling in the lens plane, or a 150th of the panel's shorter side: ``z = s g / d`` for a
        spread s. Where sub-pixels lie under a slanted sheet, each shows a direction of its own: d is theirs. An
        eye-tracked monitor resolves all depths, and is held to what is comfortable.
        """
        if self.stereo is not None:
            return depth_of_disparity(COMFORTABLE, COMFORTABLE, self.viewing_distance, self.stereo.eyes)
        depth = self.resolved_size * self.gap / self.panel.pixel_pitch * (3.0 if self.has_slanted_stripes else 1.0)
        return min(depth, self.viewing_distance), -depth

    @property
    def has_slanted_stripes(self) -> bool:
        """Whether a slanted sheet covers sub-pixels that stand side by side: each shows a direction of its own."""
        columns = {column for column, _ in self.panel.subpixel_offsets}
        return self.lens_array.slant != 0.0 and len(columns) > 1

    @property
    def depth_budget(self) -> tuple[float, float]:
        """:attr:`resolvable_depth`, cut at the aperture: nothing in front of it is recorded."""
        near, far = self.resolvable_depth
        return min(near, self.aperture_distance), far

    # ---- Pixels and panel points -----------------------------------------------------------------------------------

    def panel_point(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Panel point in millimetres of continuous pixel coordinates, see :meth:`Panel.point`."""
        return self.panel.point(u, v)

    def subpixel_point(self, u: Array, v: Array, c: Array, ops: ArrayOps = NUMPY) -> tuple[Array, Array]:
        """:meth:`panel_point` displaced by the offset of sub-pixel ``c`` (0 R, 1 G, 2 B)."""
        return self.panel.subpixel_point(u, v, c, ops)

    def pixel_coordinates(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Continuous pixel coordinates ``(u, v)`` of a panel point; the inverse of :meth:`panel_point`."""
        return self.panel.coordinates(x, y)

    # ---- Panel points, lenses and rays -----------------------------------------------------------------------------

    def lens_of(self, x: Array, y: Array, ops: ArrayOps = NUMPY) -> tuple[Array, Array]:
        """Indices ``(i, j)`` of the lens that shows a panel point.

        They lie within :attr:`lens_grid` for points inside the panel that keep 2e-9 pixels away from its right and
        lower edge; points beyond the panel belong to the lenses that would be there.
        """
        k = 1.0 / self.magnification
        return self.lattice.lens_at(x * k, y * k, ops)

    def lens_center(self, i: Array, j: Array, x: Array, y: Array, ops: ArrayOps = NUMPY) -> tuple[Array, Array]:
        """Point where the light line of the panel point ``(x, y)`` through lens ``(i, j)`` crosses the lens plane.

        That is the lens's centre; for a lenticular lens a point of its axis.
        """
        k = 1.0 / self.magnification
        return self.lattice.center(i, j, x * k, y * k, ops)

    def light_ray(self, x: Array, y: Array, ops: ArrayOps = NUMPY) -> tuple[Vector, Vector]:
        """The ray that a panel point records: origin in front of the lens plane, unit direction away from the viewer.

        Returns
        -------
        ``(ox, oy, oz), (dx, dy, dz)`` in the display frame, millimetres; ``oz`` is the aperture distance and ``dz``
        is negative.
        """
        i, j = self.lens_of(x, y, ops)
        cx, cy = self.lens_center(i, j, x, y, ops)
        dx, dy = self.pinhole_offset(x - cx, y - cy, ops)
        slope_x, slope_y = dx / self.gap, dy / self.gap
        length = ops.sqrt(slope_x * slope_x + slope_y * slope_y + 1.0)
        origin = (cx - slope_x * self.aperture_distance, cy - slope_y * self.aperture_distance)
        aperture = length * 0.0 + self.aperture_distance
        return (*origin, aperture), (slope_x / length, slope_y / length, -1.0 / length)

    def aperture_point(self, s: Array, t: Array, ops: ArrayOps = NUMPY) -> tuple[Array, Array]:
        """Point of a lens for ``s`` and ``t`` in [0, 1), in mm from its middle: all of its light has one direction.

        Areas are kept: even points of the square are even points of a cylinder's width, of a square or hexagonal cell
        or, by the concentric map of Shirley and Chiu (1997), of a round lens. Pinholes have no other point than their
        middle.

        ``s`` goes along the lens, not across it: where it is the place across a pixel, which decides the direction,
        places in the lens and directions are independent of each other, axis by axis. Of an eye-tracked monitor,
        each eye of which sees a picture from one point, ``s`` is the place across the two pixels of its lens.
        """
        if self.stereo is not None:
            return (s - 0.5) * self.lens_array.pitch, 0.0
        if self.lens is None:
            return 0.0, 0.0
        array, diameter = self.lens_array, self.lens.diameter
        if array.layout == "lenticular":
            return self.lattice.from_axes((t - 0.5) * (array.pitch if diameter is None else diameter), 0.0)
        if diameter is not None:
            return _disc_point(diameter * (t - 0.5), diameter * (s - 0.5), ops)
        # A rectangle as large as a cell, of which each point belongs to its nearest lens.
        across, along = (t - 0.5) * array.pitch, (s - 0.5) * array.row_spacing
        if array.layout == "square":
            return across, along
        lattice = self.lattice
        x, y = across + lattice.origin_x, along + lattice.origin_y
        center_x, center_y = lattice.center(*lattice.lens_at(x, y, ops), x, y, ops)
        return x - center_x, y - center_y

    def pinhole_place(self, place: Array, ops: ArrayOps = NUMPY) -> Array:
        """Place across a lens, in mm from its axis, at which a pinhole at the gap has the direction of ``place``."""
        return place if self.distortion is None else self.distortion.pinhole_place(place, 0.0 * place, ops)[0]

    def place(self, pinhole: Array, ops: ArrayOps = NUMPY) -> Array:
        """Place of the direction that a pinhole at the gap has at ``pinhole``: the inverse of :meth:`pinhole_place`."""
        return pinhole if self.distortion is None else self.distortion.place(pinhole, 0.0 * pinhole, ops)[0]

    def pinhole_offset(self, dx: Array, dy: Array, ops: ArrayOps = NUMPY) -> tuple[Array, Array]:
        """:meth:`pinhole_place` of a panel point: its offset from the lens's centre, or the level point of its axis."""
        return self._distort(Distortion.pinhole_place, dx, dy, ops)

    def panel_offset(self, dx: Array, dy: Array, ops: ArrayOps = NUMPY) -> tuple[Array, Array]:
        """The inverse of :meth:`pinhole_offset`."""
        return self._distort(Distortion.place, dx, dy, ops)

    def _distort(
        self, way: Callable[..., tuple[Array, Array]], dx: Array, dy: Array, ops: ArrayOps
    ) -> tuple[Array, Array]:
        """An offset by one of the distortion's two ways; what lies along a cylinder stays."""
        if self.distortion is None:
            return dx, dy
        if self.lens_array.layout != "lenticular":
            return way(self.distortion, dx, dy, ops)
        across, along = self.lattice.across(dx, dy), self.lattice.along(dx, dy)
        return self.lattice.from_axes(way(self.distortion, across, 0.0 * across, ops)[0], along)

    def project(
        self, px: Array, py: Array, pz: Array, i: Array, j: Array, ops: ArrayOps = NUMPY
    ) -> tuple[Array, Array]:
        """The panel point whose light line through lens ``(i, j)`` passes the point P; the inverse of a ray.

        Lens ``(i, j)`` shows P only if the result is its own, ``lens_of(x, y) == (i, j)``, and lies on the panel. A
        point nearer than a nanometre to the lens plane counts as lying one nanometre in front of it: lenses whose
        centre it hits show it, for all others the result lies very far away.
        """
        lattice = self.lattice
        scale = self.gap / _nonzero(pz, ops)
        if lattice.layout != "lenticular":
            cx, cy = lattice.center(i, j, px, py, ops)
            dx, dy = self.panel_offset((cx - px) * scale, (cy - py) * scale, ops)
            return cx + dx, cy + dy
        center = lattice.origin_x + i * lattice.pitch
        across = center + self.place((center - lattice.across(px, py)) * scale, ops)
        along = lattice.along(px, py) * self.magnification / _nonzero(1.0 - pz * self._convergence, ops)
        return lattice.from_axes(across, along)

    def visible_panel_point(
        self, ex: Array, ey: Array, ez: Array, lx: Array, ly: Array, ops: ArrayOps = NUMPY
    ) -> tuple[Array, Array]:
        """The panel point that an eye at E (``ez`` > 0) sees when it looks at the point ``(lx, ly)`` of the lens plane.

        Every lens is ideal and in focus on the panel: the eye sees the panel point on its line through the lens's
        centre, across a cylindrical lens; along its axis the line runs straight on. Outside the display's field the
        point lies in a neighbouring micro-image, as it does on a real display. The result may lie off the panel.
        """
        i, j = self.lattice.lens_at(lx, ly, ops)
        cx, cy = self.lattice.center(i, j, lx, ly, ops)
        scale = self.gap / ez
        dx, dy = self.panel_offset((cx - ex) * scale, (cy - ey) * scale, ops)
        return cx + dx, cy + dy

    def check_native(self) -> None:
        """Refuse, by a :class:`DisplayError`, a display that takes no native pixels."""
        if self.stereo is not None:
            rule = "an eye-tracked monitor weaves the pictures of the two eyes by itself"
            what = f"{self.name} takes no native pixels"
            raise DisplayError(
                what, parameter="display", rule=rule, fix="use lippmann quilt render, of pictures lippmann quilt pack"
            )

    # ---- Copies and plain values -----------------------------------------------------------------------------------

    def resized(self, width: int, height: int) -> Display:
        """The same optics in front of ``width`` x ``height`` pixels."""
        return replace(self, panel=replace(self.panel, width=width, height=height))

    def with_closer_eyes(self, share: float) -> Display:
        """An eye-tracked monitor whose two pictures are taken from this share of the distance between the eyes."""
        gap, pixels = self.gap / share, 2.0 * self.panel.pixel_pitch
        pitch = pixels * self.viewing_distance / (self.viewing_distance + gap)
        return replace(self, gap=gap, lens_array=replace(self.lens_array, pitch=pitch))

    def summary(self) -> JsonObject:
        """Key figures of the display, as plain values for a table or JSON.

        Keys: ``name``, ``title``, ``layout``; ``pixels``, ``lenses`` as [columns, rows]; ``pixels_per_lens`` as
        [across, down], down being None if lenticular; ``size_mm`` as [width, height]; ``field_of_view`` and ``slant``
        in degrees; ``depth_budget`` and ``resolvable_depth`` as [nearest, farthest] z, ``pixel_pitch``,
        ``lens_pitch``, ``gap``, ``viewing_distance`` (or ``"infinite"``) and ``aperture_distance`` in mm.
        """
        grid = self.lens_grid
        return {
            "name": self.name,
            "title": self.title,
            "layout": self.lens_array.layout,
            "pixels": [self.panel.width, self.panel.height],
            "lenses": [grid.columns, grid.rows],
            "pixels_per_lens": list(self.pixels_per_lens),
            "size_mm": list(self.size_mm),
            "field_of_view": self.field_of_view,
            "depth_budget": list(self.depth_budget),
            "resolvable_depth": list(self.resolvable_depth),
            "pixel_pitch": self.panel.pixel_pitch,
            "lens_pitch": self.lens_array.pitch,
            "slant": self.lens_array.slant,
            "gap": self.gap,
            "viewing_distance": self._plain_viewing_distance,
            "aperture_distance": self.aperture_distance,
        }

    def in_words(self) -> dict[str, str]:
        """Key figures of the display as people read them, by name, in the order of a table."""
        grid, (across, down) = self.lens_grid, self.pixels_per_lens
        front, back = self.depth_budget
        width, height = self.size_mm
        return {
            "name": self.name,
            "pixels": f"{self.panel.width}x{self.panel.height}",
            "lenses": str(grid.columns) if down is None else f"{grid.columns}x{grid.rows}",
            "pixels/lens": f"{across:.3g}" if down is None else f"{across:.3g}x{down:.3g}",
            "field": f"{self.field_of_view:.1f} deg",
            "depth behind/in front": f"{-back:.0f}/{front:.0f} mm",
            "panel": f"{width:.0f}x{height:.0f} mm",
            **({} if self.lens is None else {"lens": self.lens.in_words()}),
            "title": self.title,
        }

    def _repr_html_(self) -> str:
        """The table of :meth:`in_words` for notebooks."""
        return html_table("Display", self.in_words())

    def to_dict(self) -> JsonObject:
        """Plain values for JSON; lengths in millimetres, an infinite distance as ``"infinite"``."""
        panel, lenses = self.panel, self.lens_array
        return {
            "name": self.name,
            "title": self.title,
            "gap": self.gap,
            "viewing_distance": self._plain_viewing_distance,
            "aperture_distance": self.aperture_distance,
            "panel": {
                "width": panel.width,
                "height": panel.height,
                "pixel_pitch": panel.pixel_pitch,
                "subpixel_offsets": [list(offset) for offset in panel.subpixel_offsets],
                **self._plain_cells,
            },
            "lens_array": {
                "layout": lenses.layout,
                "pitch": lenses.pitch,
                "slant": lenses.slant,
                "offset": None if lenses.offset is None else list(lenses.offset),
                "row_pitch": lenses.row_pitch,
            },
            **self._plain_parts,
        }

    @staticmethod
    def from_dict(values: Table) -> Display:
        """The display of :meth:`to_dict`, exactly; a :class:`DisplayError` if a key is missing or unknown."""
        check_tables(values)
        parts: dict[str, Any] = dict(values)  # any type until the constructors have checked them
        parts["panel"] = Panel(**parts["panel"])
        parts["lens_array"] = LensArray(**parts["lens_array"])
        for name, kind in OPTIONAL_TABLES.items():
            if name in parts:
                parts[name] = kind(**parts[name])
        if parts.get("viewing_distance") == INFINITE:
            parts["viewing_distance"] = math.inf
        return Display(**parts)

    # ---- Derived once ----------------------------------------------------------------------------------------------

    @property
    def _plain_viewing_distance(self) -> float | str:
        return INFINITE if math.isinf(self.viewing_distance) else self.viewing_distance

    @property
    def _plain_parts(self) -> JsonObject:
        """The tables that are given; without them, earlier versions read the display too."""
        parts = {name: getattr(self, name) for name in OPTIONAL_TABLES}
        return {name: asdict(part) for name, part in parts.items() if part is not None}

    @property
    def _plain_cells(self) -> JsonObject:
        """Empty where pixels are all alike, so that earlier versions read the display too."""
        cells = self.panel.subpixel_cells
        if cells is None:
            return {}
        return {"subpixel_cells": [[[list(pair) for pair in cell] for cell in row] for row in cells]}

    @property
    def _convergence(self) -> float:
        return 1.0 / self.viewing_distance

    @cached_property
    def _lenses(self) -> tuple[Lattice, LensGrid]:
        return lattice_in_front_of(self.panel, self.lens_array, self.pixels_per_lens, self.magnification)


def check_tables(values: Table) -> None:
    """Refuse tables that are not shaped like :meth:`Display.to_dict`: unknown or missing keys, no tables."""
    check_keys(values, Display, "")
    check_keys(values["panel"], Panel, "panel")
    check_keys(values["lens_array"], LensArray, "lens_array")
    for name, kind in OPTIONAL_TABLES.items():
        if name in values:
            check_keys(values[name], kind, name)


def _disc_point(x: Array, y: Array, ops: ArrayOps) -> tuple[Array, Array]:
    """Point of a disc for one of the square about it, both about the origin; areas keep their ratios."""
    is_wide = ops.abs(x) > ops.abs(y)
    radius, other = ops.where(is_wide, x, y), ops.where(is_wide, y, x)
    angle = 0.25 * math.pi * other / _nonzero(radius, ops)
    near, far = radius * ops.cos(angle), radius * ops.sin(angle)
    return ops.where(is_wide, near, far), ops.where(is_wide, far, near)


def _nonzero(value: Array, ops: ArrayOps) -> Array:
    """``value``, kept a nanometre (or a millionth) away from zero, so that divisions stay finite."""
    tiny = 1e-6
    return ops.where(ops.abs(value) < tiny, tiny, value)
