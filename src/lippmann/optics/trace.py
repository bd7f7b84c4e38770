"""The path of light through one lens, in closed form: the readable twin of :mod:`lippmann.optics.trace_kernel`.

A ray from the eye meets the crest of a lens, is bent by Snell's law, loses by Fresnel's, and lands on the panel. Light
runs the other way; paths are reversible. Crests are conics ``r^2 + (1 + K) h^2 = 2 R h``, h below their top, with r = x
for a cylinder and r^2 = x^2 + y^2 for a micro-lens.

A direction is given by its slopes (x, y) per unit of z, as seen from the lens: an eye afar at ``(s_x z, s_y z, z)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens import Lens, Real

Mask = NDArray[np.bool_]


class Vectors(NamedTuple):
    """Arrays of the three components of vectors."""

    x: Real
    y: Real
    z: Real


@dataclass(frozen=True)
class Traced:
    """Rays of one direction, through points of one lens.

    Attributes
    ----------
    x, y:
        Where they land on the panel, relative to the lens's axis, in millimetres.
    area:
        Share that each point of the lens has of the light in this direction, relative to a point of a flat sheet: 0 in
        shadow. Its mean over points that cover a lens is 1.
    transmission:
        Share of unpolarised light that passes the surface, the rest is reflected.
    strays:
        Whether light leaves the sheet again through the far flank of its crest.
    inside:
        Unit directions within the lens, toward the panel.
    """

    x: Real
    y: Real
    area: Real
    transmission: Real
    strays: Real
    inside: Vectors

    @property
    def light(self) -> Real:
        """Share of light that gets from the panel to the eye: area and transmission, without what strays."""
        return self.area * self.transmission * (1.0 - self.strays)


def trace(lens: Lens, x: Real, y: Real, slope_x: float | Real, slope_y: float | Real = 0.0) -> Traced:
    """Trace rays from a direction through points ``(x, y)`` of the lens, relative to its axis; arrays of one shape."""
    slope_x, slope_y, x, y = np.broadcast_arrays(np.float64(slope_x), np.float64(slope_y), x, y)
    length = np.sqrt(1.0 + slope_x**2 + slope_y**2)
    ray = Vectors(-slope_x / length, -slope_y / length, -1.0 / length)
    h, normal = crest(lens, x, y)
    facing = -_dot(ray, normal)
    area = np.where(facing > 0.0, facing / (normal.z * -ray.z), 0.0)
    area = np.where(_is_shadowed(lens, x, y, h, slope_x, slope_y), 0.0, area)
    transmission, inside = refract(ray, normal, np.maximum(facing, 0.0), 1.0 / lens.profile.index)
    way = (lens.profile.thickness - h) / -inside.z
    return Traced(
        x + way * inside.x, y + way * inside.y, area, transmission, _leaves_again(lens, x, y, h, inside), inside
    )


def trace_back(lens: Lens, x: Real, y: Real, inside: Vectors) -> tuple[Real, Real, Real]:
    """Trace light from points of the panel, in directions ``inside`` the lens away from it, out of the crest.

    Returns
    -------
    Slopes x and y of the light outside, and the share of it that passes; NaN and 0 where it is totally reflected.
    """
    h = _hit(lens, x, y, inside)
    way = (lens.profile.thickness - h) / inside.z
    _, normal = crest(lens, x + way * inside.x, y + way * inside.y)
    outward = Vectors(-normal.x, -normal.y, -normal.z)
    transmission, ray = refract(inside, outward, -_dot(inside, outward), lens.profile.index)
    return ray.x / ray.z, ray.y / ray.z, transmission


def crest(lens: Lens, x: Real, y: Real) -> tuple[Real, Vectors]:
    """Depth below the top of the crest, and the unit normal out of the lens, over points relative to its axis."""
    profile, tangential = lens.profile, 0.0 if lens.is_cylinder else 1.0
    squared = x**2 + tangential * y**2
    is_crest = squared <= lens.reach**2 * (1.0 + 1e-12)
    squared = np.where(is_crest, squared, 0.0)
    root = np.sqrt(1.0 - (1.0 + profile.conic) * squared / profile.radius**2)
    h = np.where(is_crest, squared / profile.radius / (1.0 + root), lens.rim)
    # The gradient of the conic: (x, y, R - (1 + K) h), and R root = R - (1 + K) h.
    gradient = (np.where(is_crest, x, 0.0), np.where(is_crest, tangential * y, 0.0), profile.radius * root)
    length = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
    return h, Vectors(gradient[0] / length, gradient[1] / length, gradient[2] / length)


def refract(ray: Vectors, normal: Vectors, cosine: Real, ratio: float) -> tuple[Real, Vectors]:
    """Fresnel's transmission of unpolarised light and the unit direction behind a surface.

    ``normal`` points against the ray and ``cosine`` is that of the angle between them; ``ratio`` is the refractive
    index before the surface over that behind it. Where all is reflected: 0 and NaN.
    """
    squared = 1.0 - ratio**2 * (1.0 - cosine**2)
    behind = np.sqrt(np.where(squared > 0.0, squared, np.nan))
    across = ((ratio * cosine - behind) / (ratio * cosine + behind)) ** 2
    along = ((cosine - ratio * behind) / (cosine + ratio * behind)) ** 2
    transmission = np.where(squared > 0.0, 1.0 - 0.5 * (across + along), 0.0)
    bend = ratio * cosine - behind
    return transmission, Vectors(*(ratio * r + bend * n for r, n in zip(ray, normal, strict=True)))


def _dot(a: Vectors, b: Vectors) -> Real:
    return a.x * b.x + a.y * b.y + a.z * b.z


def _conic_along(lens: Lens, x: Real, y: Real, h: Real, direction: Vectors) -> tuple[Real, Real, Real]:
    """Coefficients a, b, c of ``a s^2 + 2 b s + c``: the conic along the line from a point, +z up."""
    tangential, flat = (0.0 if lens.is_cylinder else 1.0), 1.0 + lens.profile.conic
    a = direction.x**2 + tangential * direction.y**2 + flat * direction.z**2
    b = x * direction.x + tangential * y * direction.y - (flat * h - lens.profile.radius) * direction.z
    c = x**2 + tangential * y**2 + flat * h**2 - 2.0 * lens.profile.radius * h
    return a, b, c


def _is_shadowed(lens: Lens, x: Real, y: Real, h: Real, slope_x: Real, slope_y: Real) -> Mask:
    """Whether a crest stands between a point of the lens and the eye: a neighbour's; over flat parts, its own too."""
    toward = Vectors(slope_x, slope_y, np.ones_like(slope_x))
    shadowed = np.zeros(np.shape(x), dtype=bool)
    for center_x, center_y in lens.crests:
        from_x, from_y = x - center_x, y - center_y
        a, b, c = _conic_along(lens, from_x, from_y, h, toward)
        # Of the two points where the line pierces the conic, it leaves at the farther one.
        inside = b * b - a * c
        root = np.sqrt(np.maximum(inside, 0.0))
        a = np.where(np.abs(a) < 1e-300, 1e-300, a)
        for way in ((-b - root) / a, (-b + root) / a):
            at_x, at_y, depth = from_x + way * slope_x, from_y + way * slope_y, h - way
            in_reach = (inside > 0.0) & (way > 1e-9 * lens.reach) & (depth >= 0.0) & (depth <= lens.rim)
            shadowed |= in_reach & _is_own(lens, at_x, at_y)
    return shadowed


def _leaves_again(lens: Lens, x: Real, y: Real, h: Real, inside: Vectors) -> Real:
    """Whether light that entered at a point of the crest meets the same crest once more before the panel."""
    a, b, _ = _conic_along(lens, x, y, h, inside)
    way = -2.0 * b / np.where(np.abs(a) < 1e-300, 1e-300, a)
    at_x, at_y, depth = x + way * inside.x, y + way * inside.y, h - way * inside.z
    again = (way > 1e-9 * lens.reach) & (depth >= 0.0) & (depth < lens.rim) & _is_own(lens, at_x, at_y)
    return np.where(again, 1.0, 0.0)


def _is_own(lens: Lens, x: Real, y: Real) -> Mask:
    """Whether points relative to the axis of a lens lie on its crest."""
    if lens.is_cylinder:
        own: Mask = np.abs(x) <= lens.reach
        return own
    own_x, own_y = lens.from_center(x, y)
    nearest: Mask = (np.abs(own_x - x) + np.abs(own_y - y)) < 1e-9 * lens.pitch
    return nearest & (x**2 + y**2 <= lens.reach**2)


def _hit(lens: Lens, x: Real, y: Real, inside: Vectors) -> Real:
    """Depth at which light from points of the panel meets the crest of the lens."""
    a, b, c = _conic_along(lens, x, y, np.full(np.shape(x), lens.profile.thickness), inside)
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    # The upper sheet of the conic is met where the line leaves it; the form without cancellation.
    way = np.where(b <= 0.0, (-b + root) / np.where(a == 0.0, 1e-300, a), -c / (b + root))
    return lens.profile.thickness - way * inside.z
