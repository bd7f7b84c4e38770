"""The beam of one sample, by which curved mirrors and gloss are widened where light is pooled.

A curved mirror that is small beside a pixel shows an emitter in a spot that hardly any sample meets. Its lobe is
widened by what its normals differ over the beam: as if a sample saw all normals in its share of the pixel, not that in
one point. Their variance over the beam of width w, (k w)^2 / 12 where k is the curvature, counts twice in the square of
a GGX width (Kaplanyan, Hill, Patney and Lefohn 2016, *Filtering distributions of normals for shading antialiasing*). A
beam that a mirror turns spreads by 2 k w more. With n samples of a pixel their beams are thinner by a root of n, so
that the blur goes away as samples grow.
"""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.types import Float, Ray3f, SurfaceInteraction3f, Vector2f
from lippmann.rendering.transport.ray_source import RaySource

#: By how much the square of a lobe's GGX width grows at most.
MOST_WIDENING = 0.09
#: Pixels to a side of the picture of which the beam is the mean.
_SIDE = 8


class Beam:
    """How wide samples' beams are along the two sides of a pixel; lenses may focus them.

    Attributes
    ----------
    width:
        Where rays begin, in world units; negative where beams first get narrower.
    spread:
        What it grows by over a world unit.
    """

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, width: tuple[float, float], spread: tuple[float, float]) -> None:
        # Opaque to the compiler: pictures of any number of samples share their kernels.
        self.width, self.spread = (mi.Vector2f(*(dr.opaque(mi.Float, x) for x in both)) for both in (width, spread))


def beam_of(source: RaySource, samples: int) -> Beam:
    """The beam of one of so many samples of each (sub-)pixel, in the mean of the picture."""
    place = np.arange(_SIDE * _SIDE, dtype=np.uint32)
    column, row = (
        mi.UInt32(((2 * at + 1) * size // (2 * _SIDE)).astype(np.uint32))
        for at, size in ((place % _SIDE, source.width), (place // _SIDE, source.height))
    )
    middle, widths, spreads = 0.5, [], []
    for first, last in (((0.0, middle), (1.0, middle)), ((middle, 0.0), (middle, 1.0))):
        a, b = (source.rays(column, row, mi.UInt32(0), mi.Point2f(*at)) for at in (first, last))
        width, spread = _apart(a, b)
        widths.append(width / math.sqrt(samples))
        spreads.append(spread / math.sqrt(samples))
    return Beam((widths[0], widths[1]), (spreads[0], spreads[1]))


def _apart(a: Ray3f, b: Ray3f) -> tuple[float, float]:
    """Distance of the origins of two rays along the way in which their directions differ, and that difference."""
    apart, turned = np.array(b.o - a.o).T, np.array(b.d - a.d).T
    spread = np.linalg.norm(turned, axis=1)
    # Directions that differ by rounding only tell no way.
    parallel = spread.mean() < 1e-6
    along = np.linalg.norm(apart, axis=1) if parallel else (apart * turned).sum(axis=1) / np.maximum(spread, 1e-12)
    return float(along.mean()), 0.0 if parallel else float(spread.mean())


def turn_of_normals(si: SurfaceInteraction3f, width: Vector2f) -> Float:
    """By how many radians the shading normal turns over a beam's narrower side; 0 where the shape does not tell.

    ``si`` was computed with ``RayFlags.dNSdUV``.
    """
    squared = mi.Float(0)
    for normal, position in ((si.dn_du, si.dp_du), (si.dn_dv, si.dp_dv)):
        length = dr.squared_norm(position)
        squared += dr.select(length > 0, 0.5 * dr.squared_norm(normal) / length, 0)
    return dr.min(dr.abs(width)) * dr.sqrt(squared)


def widening(turn: Float) -> Float:
    """What the square of a lobe's GGX width grows by where normals turn by ``turn`` over the beam."""
    return dr.minimum(dr.square(turn) / 6, MOST_WIDENING)
