"""Names of the cells in which light is pooled.

A cell is a cube of space together with a range of directions: of the normal for diffuse light, of the reflected eye ray
for gloss. Cells nest: each level halves the cubes, and at first the directions, too. A key of 64 bits holds a hash of
the root cell in its upper half and the way down from there in its lower; the key of an ancestor is a prefix.

Directions are laid out on the octahedral map (Cigolle et al. 2014), so that a floor's two sides, or the walls of a
corner, never share a cell.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

#: Levels below the root.
LEVELS = 8
#: Levels that halve the directions as well: the last ones.
DIRECTION_LEVELS = 4
#: Cubes of a root cell along an axis, in finest cells.
ROOT_CUBES = 1 << LEVELS
#: Bits of a key below the prefix that names its ancestor, by level from root to leaf.
SHIFTS = tuple(32 - 3 * level - 2 * max(level - (LEVELS - DIRECTION_LEVELS), 0) for level in range(LEVELS + 1))
#: Root cells along an axis of the octahedral map; an odd number, for axes lie in the middle of their cells then.
ROOT_DIRECTIONS = 5
#: Key of what belongs to no cell.
NOWHERE = 0xFFFF_FFFF_FFFF_FFFF


def octahedral(v: Any) -> Any:
    """A unit vector's place on the square [0, 1]^2."""
    scale = dr.rcp(dr.abs(v.x) + dr.abs(v.y) + dr.abs(v.z))
    x, y = v.x * scale, v.y * scale
    below = v.z < 0
    fx = dr.select(below, (1 - dr.abs(y)) * dr.mulsign(mi.Float(1), x), x)
    fy = dr.select(below, (1 - dr.abs(x)) * dr.mulsign(mi.Float(1), y), y)
    return mi.Point2f(fx * 0.5 + 0.5, fy * 0.5 + 0.5)


def mix(key: Any) -> Any:
    """A bijective mixing of 64 bits (Stafford's variant 13 of MurmurHash3's finaliser); NumPy or Dr.Jit."""
    key = key ^ (key >> 30)
    key = key * 0xBF58476D1CE4E5B9
    key = key ^ (key >> 27)
    key = key * 0x94D049BB133111EB
    return key ^ (key >> 31)


def key_of(position: Any, direction: Any, fineness: Any, kind: Any, finest: Any) -> Any:
    """Key of the finest cell.

    Parameters
    ----------
    position, direction:
        Point and unit vector in world space.
    fineness:
        Root cells of direction for a quarter of the sphere's octahedral map (UInt32, at least 1).
    kind:
        A number (UInt32) of what may not share a cell.
    finest:
        Side of the finest cubes, in world units.
    """
    cube = [mi.UInt32(mi.Int32(dr.floor(c / finest))) for c in (position.x, position.y, position.z)]
    place = octahedral(direction)
    steps = fineness * (ROOT_DIRECTIONS << DIRECTION_LEVELS)
    turn = [dr.minimum(mi.UInt32(c * mi.Float(steps)), steps - 1) for c in (place.x, place.y)]
    root = mi.UInt64(kind) + mi.UInt64(fineness) * 64
    for c in cube:
        root = mix(root ^ mi.UInt64(c >> LEVELS))
    for c in turn:
        root = mix(root ^ mi.UInt64(c >> DIRECTION_LEVELS))
    low = mi.UInt32(0)
    for level in range(LEVELS):
        bit = LEVELS - 1 - level
        parts = [(c >> bit) & 1 for c in cube]
        if bit < DIRECTION_LEVELS:
            parts += [(c >> bit) & 1 for c in turn]
        for part in parts:
            low = (low << 1) | part
    return (root & 0xFFFF_FFFF_0000_0000) | mi.UInt64(low)
