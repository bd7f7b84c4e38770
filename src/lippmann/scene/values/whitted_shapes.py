"""Exact shapes in batches: one batch per kind, one row per primitive.

A scene holds each kind once, however many primitives of it there are, because a renderer pays per batch and not per
row. Every batch carries ``material`` (index into ``ClassicScene.materials``) and ``clip_group`` (index into
``ClassicScene.clip_groups``, -1 for none) per primitive. All numbers are float64, all indices int32, all arrays
read-only. Lengths are world units; directions and normals are unit vectors unless said otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from itertools import product
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError

Numbers = NDArray[np.float64]
Indices = NDArray[np.int32]
Flags = NDArray[np.bool_]


def _numbers(*shape: int) -> Numbers:
    return np.zeros((0, *shape))


def _no_indices() -> Indices:
    return np.zeros(0, np.int32)


def _no_flags() -> Flags:
    return np.zeros(0, np.bool_)


@dataclass(frozen=True, eq=False)
class Batch:
    """Fields common to all kinds. ``len(batch)`` is the number of primitives.

    Raises
    ------
    SceneError
        If arrays differ in length or shape, or hold numbers that are not finite.
    """

    kind: ClassVar[str]
    shapes: ClassVar[dict[str, tuple[int, ...]]]  # what follows the leading axis of every array of numbers

    material: Indices = field(default_factory=_no_indices, kw_only=True)
    clip_group: Indices = field(default_factory=_no_indices, kw_only=True)

    def __post_init__(self) -> None:
        count = len(self.material)
        for item in fields(self):
            array = getattr(self, item.name)
            expected = (count, *self.shapes.get(item.name, ()))
            if array.shape != expected:
                raise SceneError(f"{self.kind}: '{item.name}' has shape {array.shape}, expected {expected}")
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                raise SceneError(f"{self.kind}: '{item.name}' holds a number that is not finite")
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.material)

    def bounds(self) -> Numbers | None:
        """The box ``(2, 3)`` around all primitives; None for none, or for shapes without end."""
        if not len(self):
            return None
        low, high = self.extents()
        return np.stack([low.min(axis=0), high.max(axis=0)])

    def extents(self) -> tuple[Numbers, Numbers]:
        """Lowest and highest corners ``(n, 3)`` of the boxes around the primitives, of kinds that have an end."""
        raise NotImplementedError  # every finite kind answers; kinds without end override bounds()

    def _require(self, valid: Flags | np.bool_, rule: str) -> None:
        if not np.all(valid):
            first = int(np.argmin(np.atleast_1d(valid)))
            raise SceneError(f"{self.kind} {first} is impossible", rule=rule)


def _disc_extent(axis: Numbers, radius: Numbers) -> Numbers:
    """Half-sizes ``(n, 3)`` of the boxes around discs of this radius, perpendicular to the unit ``axis``."""
    extent: Numbers = radius[:, None] * np.sqrt(np.clip(1.0 - axis**2, 0.0, 1.0))
    return extent


@dataclass(frozen=True, eq=False)
class Spheres(Batch):
    """``centers (n, 3)``, ``radii (n,)`` > 0; ``inside_only (n,)`` marks those that are seen from within alone."""

    kind: ClassVar[str] = "sphere"
    shapes: ClassVar[dict[str, tuple[int, ...]]] = {"centers": (3,)}

    centers: Numbers = field(default_factory=lambda: _numbers(3))
    radii: Numbers = field(default_factory=_numbers)
    inside_only: Flags = field(default_factory=_no_flags)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require(self.radii > 0, "a radius is positive")

    def extents(self) -> tuple[Numbers, Numbers]:
        return self.centers - self.radii[:, None], self.centers + self.radii[:, None]


@dataclass(frozen=True, eq=False)
class Tubes(Batch):
    """Open cylinders and truncated cones without caps.

    ``base`` and ``apex`` ``(n, 3)`` are the ends of the axis (never the same point), ``base_radius`` and
    ``apex_radius`` ``(n,)`` the radii there: equal for a cylinder, one of them zero for a full cone.
    """

    kind: ClassVar[str] = "tube"
    shapes: ClassVar[dict[str, tuple[int, ...]]] = {"base": (3,), "apex": (3,)}

    base: Numbers = field(default_factory=lambda: _numbers(3))
    apex: Numbers = field(default_factory=lambda: _numbers(3))
    base_radius: Numbers = field(default_factory=_numbers)
    apex_radius: Numbers = field(default_factory=_numbers)
    inside_only: Flags = field(default_factory=_no_flags)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require((self.base != self.apex).any(axis=1), "base and apex are different points")
        valid = (self.base_radius >= 0) & (self.apex_radius >= 0) & (self.base_radius + self.apex_radius > 0)
        self._require(valid, "radii are not negative, and not both zero")

    def extents(self) -> tuple[Numbers, Numbers]:
        axis = self.apex - self.base
        axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
        base, apex = _disc_extent(axis, self.base_radius), _disc_extent(axis, self.apex_radius)
        return np.minimum(self.base - base, self.apex - apex), np.maximum(self.base + base, self.apex + apex)


@dataclass(frozen=True, eq=False)
class Cylinders(Batch):
    """Cylinders without end: ``centers (n, 3)`` on the axis, unit ``axes (n, 3)``, ``radii (n,)`` > 0."""

    kind: ClassVar[str] = "cylinder"
    shapes: ClassVar[dict[str, tuple[int, ...]]] = {"centers": (3,), "axes": (3,)}

    centers: Numbers = field(default_factory=lambda: _numbers(3))
    axes: Numbers = field(default_factory=lambda: _numbers(3))
    radii: Numbers = field(default_factory=_numbers)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require(_unit(self.axes), "an axis is a unit vector")
        self._require(self.radii > 0, "a radius is positive")

    def bounds(self) -> None:
        """None: a cylinder of this kind has no end."""
        return


@dataclass(frozen=True, eq=False)
class Rings(Batch):
    """Flat rings: ``centers (n, 3)``, unit ``normals (n, 3)``, radii ``0 <= inner < outer``; inner 0 is a disc."""

    kind: ClassVar[str] = "ring"
    shapes: ClassVar[dict[str, tuple[int, ...]]] = {"centers": (3,), "normals": (3,)}

    centers: Numbers = field(default_factory=lambda: _numbers(3))
    normals: Numbers = field(default_factory=lambda: _numbers(3))
    inner: Numbers = field(default_factory=_numbers)
    outer: Numbers = field(default_factory=_numbers)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require(_unit(self.normals), "a normal is a unit vector")
        self._require((self.inner >= 0) & (self.inner < self.outer), "the inner radius is 0 or more, the outer larger")

    def extents(self) -> tuple[Numbers, Numbers]:
        extent = _disc_extent(self.normals, self.outer)
        return self.centers - extent, self.centers + extent


@dataclass(frozen=True, eq=False)
class Boxes(Batch):
    """Boxes along the axes: corners ``minimum <= maximum`` ``(n, 3)``."""

    kind: ClassVar[str] = "box"
    shapes: ClassVar[dict[str, tuple[int, ...]]] = {"minimum": (3,), "maximum": (3,)}

    minimum: Numbers = field(default_factory=lambda: _numbers(3))
    maximum: Numbers = field(default_factory=lambda: _numbers(3))

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require((self.minimum <= self.maximum).all(axis=1), "the minimum is not above the maximum")

    def extents(self) -> tuple[Numbers, Numbers]:
        return self.minimum, self.maximum

    def corners(self) -> Numbers:
        """Corners ``(n, 8, 3)``; bits 2, 1 and 0 of a corner's number choose the maximum of x, y and z."""
        ends = np.stack([self.minimum, self.maximum], axis=1)
        return np.stack([ends[:, [x, y, z], [0, 1, 2]] for x, y, z in product((0, 1), repeat=3)], axis=1)


@dataclass(frozen=True, eq=False)
class Planes(Batch):
    """Planes without end through ``centers (n, 3)`` with unit ``normals (n, 3)``."""

    kind: ClassVar[str] = "plane"
    shapes: ClassVar[dict[str, tuple[int, ...]]] = {"centers": (3,), "normals": (3,)}

    centers: Numbers = field(default_factory=lambda: _numbers(3))
    normals: Numbers = field(default_factory=lambda: _numbers(3))

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require(_unit(self.normals), "a normal is a unit vector")

    def bounds(self) -> None:
        """None: a plane has no end."""
        return


@dataclass(frozen=True, eq=False)
class Triangles(Batch):
    """``positions (n, 3 corners, 3)``, ``normals (n, 3 corners, 3)`` as given (interpolated, then normalised).

    A flat triangle (``smooth (n,)`` False) carries its own geometric normal at all three corners, so both kinds shade
    alike. ``colors (n, 3 corners, 3)`` are linear RGB and count only where ``colored (n,)`` is True; there they
    replace the colour of the material.

    The winding decides which side a normal belongs to: seen along the ray d, the interpolated normal is negated where
    ``cross(v1 - v0, v2 - v0) . d > 0``. So normals must lie on the side from which the corners run counter-clockwise
    in a right-handed frame; where they do not, the front is shaded as if it were the back.
    """

    kind: ClassVar[str] = "triangle"
    shapes: ClassVar[dict[str, tuple[int, ...]]] = {"positions": (3, 3), "normals": (3, 3), "colors": (3, 3)}

    positions: Numbers = field(default_factory=lambda: _numbers(3, 3))
    normals: Numbers = field(default_factory=lambda: _numbers(3, 3))
    colors: Numbers = field(default_factory=lambda: _numbers(3, 3))
    smooth: Flags = field(default_factory=_no_flags)
    colored: Flags = field(default_factory=_no_flags)

    def extents(self) -> tuple[Numbers, Numbers]:
        return self.positions.min(axis=1), self.positions.max(axis=1)


def _unit(vectors: Numbers) -> Flags:
    close: Flags = np.abs(np.linalg.norm(vectors, axis=-1) - 1.0) < 1e-6
    return close
