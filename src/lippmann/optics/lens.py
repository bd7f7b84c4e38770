"""The lenses of a display as rays meet them: their profile, and the array in which they stand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lippmann.display.array_ops import NUMPY
from lippmann.display.display import Display
from lippmann.display.lens_array import Lattice, LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.display.validation import check_kind
from lippmann.errors import DisplayError

Real = NDArray[np.float64]


def check_display(display: object) -> None:
    """Refuse what is no :class:`~lippmann.Display`, such as the name of one."""
    check_kind(display, Display, "display", "lippmann.load_display gives one")


def check_lens(lens: object) -> None:
    """Raise UsageError for arguments other than a :class:`Lens`, such as a display."""
    check_kind(lens, Lens, "lens", "Lens.of(display) gives one")


@dataclass(frozen=True)
class Lens:
    """One lens and its neighbours, in a frame of its own: its axis is z, its panel lies at z = 0, millimetres.

    ``x`` runs across a cylinder and ``y`` along it; arrays of micro-lenses have the axes of the display.

    Raises
    ------
    DisplayError
        If such lenses cannot stand side by side.

    Examples
    --------
    >>> from lippmann.optics.lens import Lens
    >>> Lens.of(lippmann.load_display("print-60lpi")).is_cylinder
    True
    """

    profile: LensProfile
    array: LensArray

    def __post_init__(self) -> None:
        self.profile.check(self.array)

    @staticmethod
    def of(display: Display) -> Lens:
        """The lens of a display.

        Raises
        ------
        DisplayError
            If the display gives none: names it.
        """
        check_display(display)
        if display.lens is None:
            rule = "its gap stands for a pinhole; a lens has a thickness, an index and a crest radius"
            fix = "add the table [lens] to its file, or thickness= to a print"
            raise DisplayError("gives no lens", where=display.name, rule=rule, fix=fix)
        return Lens(display.lens, display.lens_array)

    @property
    def is_cylinder(self) -> bool:
        """Whether the lens bends light across its axis only."""
        return self.array.layout == "lenticular"

    @property
    def pitch(self) -> float:
        """Distance to the next lens across, in millimetres."""
        return self.array.pitch

    @cached_property
    def reach(self) -> float:
        """Farthest distance of the crest from the lens's axis."""
        return self.profile.reach(self.array)

    @cached_property
    def rim(self) -> float:
        """Sag of the crest at its rim: what is flat between lenses lies as deep."""
        return self.profile.sag(self.reach)

    @cached_property
    def crests(self) -> Real:
        """``(n, 2)`` centres of the lens and of those that may stand in the way of its light, two rings of them."""
        steps = range(-2, 3)
        if self.is_cylinder:
            return np.array([[i * self.pitch, 0.0] for i in steps])
        around = np.array([(i, j) for j in steps for i in steps], dtype=np.float64)
        x, y = self._lattice.center(around[:, 0], around[:, 1], 0.0, 0.0, NUMPY)
        return np.stack([x, y], axis=1)

    def samples(self, count: int) -> tuple[Real, Real]:
        """Points that cover one lens evenly: ``count`` of a cylinder, ``count`` squared of a micro-lens.

        A cylinder's are in order from left to right.
        """
        steps = (np.arange(count) + 0.5) / count
        if self.is_cylinder:
            return (steps - 0.5) * self.pitch, np.zeros(count)
        # A rectangle as large as a cell, of which each point belongs to its nearest lens.
        y, x = np.meshgrid((steps - 0.5) * self.array.row_spacing, (steps - 0.5) * self.pitch, indexing="ij")
        return self.from_center(x.ravel(), y.ravel())

    def from_center(self, x: Real, y: Real) -> tuple[Real, Real]:
        """Points of the plane, each relative to the centre of the lens that holds it."""
        i, j = self._lattice.lens_at(x, y, NUMPY)
        center_x, center_y = self._lattice.center(i, j, x, y, NUMPY)
        return x - center_x, (y * 0.0 if self.is_cylinder else y - center_y)

    @cached_property
    def _lattice(self) -> Lattice:
        array = self.array
        return Lattice(array.layout, array.pitch, array.row_spacing, 0.0, 0.0, 0.0, 1e-12)
