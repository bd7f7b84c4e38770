"""Gears: 64 toothed wheels in eight meshing layers, every other one clear, over a reflecting floor.

Of the kind and count of the gears scene of Haines' Standard Procedural Databases (IEEE Computer Graphics and
Applications 7(11), 1987): each wheel has two concave 144-cornered faces and 144 side faces, 36 610 triangles in all
with the floor's two. Millimetres of the paper's display, +y up, the floor at y = 0.
"""

from __future__ import annotations

from colorsys import hsv_to_rgb
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.bundled.stage import Stage, level_rectangle
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import Background, ClassicLight, ClassicMaterial
from lippmann.scene.whitted.builder import ClassicSceneBuilder

NAME = "gears"

Points = NDArray[np.float64]
Faces = NDArray[np.int64]


@dataclass(frozen=True)
class Layout:
    """Sizes in mm.

    ``columns`` x ``rows`` wheels of ``teeth`` teeth mesh in each of ``layers`` layers, lying flat with their upright
    axes ``pitch`` apart (so the pitch circle's radius is half of that); ``tooth`` is a tooth's height. Each layer lies
    ``layer_rise`` above and ``layer_back`` behind the one below, the lowest ``lift`` above the floor, whose corners are
    given as (x, z).
    """

    columns: int = 4
    rows: int = 2
    layers: int = 8
    teeth: int = 36
    pitch: float = 28.5
    tooth: float = 2.0
    thickness: float = 2.6
    layer_rise: float = 6.0
    layer_back: float = 5.0
    lift: float = 5.0
    floor: tuple[tuple[float, float], tuple[float, float]] = ((-64.0, -32.0), (64.0, 42.0))


LAYOUT = Layout()
STAGE = Stage(target=(0.0, 35.0, 3.4), elevation=38.0)

OPAQUE = ClassicMaterial(ambient=0.1, diffuse=0.9, phong=0.25, phong_size=30.0)
CLEAR = ClassicMaterial(ambient=0.05, diffuse=0.25, opacity=0.25, phong=0.25, phong_size=30.0)
FLOOR = ClassicMaterial(color=(1.0, 0.88, 0.75), ambient=0.07, diffuse=0.35, specular=0.55)
LIGHTS = tuple(
    ClassicLight("point", (0.28, 0.28, 0.28), center=center)
    for center in (
        (120.0, 260.0, 40.0),
        (-120.0, 220.0, 60.0),
        (140.0, 120.0, 220.0),
        (-60.0, 90.0, 260.0),
        (0.0, 180.0, 240.0),
    )
)
SKY = Background(color=(0.08, 0.32, 0.66))
RAY_DEPTH = 8

# Half-widths of a tooth at its root and at its tip, as fractions of the angle from tooth to tooth: on the pitch circle
# well under a quarter, because straight flanks need play where involutes would not.
_ROOT_HALF, _TIP_HALF = 0.27, 0.12
# Teeth end this share of half their height beyond the pitch circle, so that they do not touch their neighbour's root.
_TIP_SHARE = 0.9


def outline(teeth: int, root_radius: float, tip_radius: float) -> Points:
    """Corners of a wheel's face, ``(4 teeth, 2)``, counter-clockwise; the first tooth is centred on the x axis."""
    step = 2 * np.pi / teeth
    angles = step * (np.arange(teeth)[:, None] + np.array([-_ROOT_HALF, -_TIP_HALF, _TIP_HALF, _ROOT_HALF]))
    radii = np.array([root_radius, tip_radius, tip_radius, root_radius])
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=-1).reshape(-1, 2)


def face_triangles(teeth: int) -> Faces:
    """Cut the concave face of :func:`outline` into ``4 teeth - 2`` counter-clockwise triangles without slivers.

    Two per tooth; the convex polygon of the roots that remains is cut by joining every second corner, again and again,
    which gives far rounder triangles than a fan.
    """
    corner = 4 * np.arange(teeth)
    cut = [np.stack([corner, corner + 1, corner + 2], axis=1), np.stack([corner, corner + 2, corner + 3], axis=1)]
    ring = np.stack([corner, corner + 3], axis=1).reshape(-1)
    while len(ring) > 3:
        ears = len(ring) // 2
        last = np.append(ring, ring[0])[2 : 2 * ears + 1 : 2]
        cut.append(np.stack([ring[0 : 2 * ears : 2], ring[1 : 2 * ears : 2], last], axis=1))
        ring = ring[::2]
    if len(ring) == 3:
        cut.append(ring[None, :])
    return np.concatenate(cut)


def wheel(layout: Layout = LAYOUT) -> tuple[Points, Faces]:
    """Return one wheel, axis along y, its lower face in y = 0: positions ``(8 teeth, 3)`` and outward triangles."""
    radius = layout.pitch / 2
    flat = outline(layout.teeth, radius - layout.tooth / 2, radius + _TIP_SHARE * layout.tooth / 2)
    count = len(flat)
    positions = np.zeros((2, count, 3))
    positions[:, :, 0] = flat[:, 0]
    positions[:, :, 2] = -flat[:, 1]  # counter-clockwise seen from above
    positions[1, :, 1] = layout.thickness
    top = face_triangles(layout.teeth) + count
    bottom = face_triangles(layout.teeth)[:, ::-1]
    here = np.arange(count)
    there = np.roll(here, -1)
    sides = [np.stack([here, there, there + count], axis=1), np.stack([here, there + count, here + count], axis=1)]
    return positions.reshape(-1, 3), np.concatenate([top, bottom, *sides])


def make() -> ClassicScene:
    """Return the gears scene."""
    builder = ClassicSceneBuilder(NAME, handedness="right")
    builder.mesh(*level_rectangle(*LAYOUT.floor), builder.material(FLOOR))

    positions, faces = wheel()
    c, s = np.cos(np.pi / LAYOUT.teeth), np.sin(np.pi / LAYOUT.teeth)
    half_a_tooth_on = positions @ np.array([(c, 0, -s), (0, 1, 0), (s, 0, c)])
    for layer, row, column in np.ndindex(LAYOUT.layers, LAYOUT.rows, LAYOUT.columns):
        center = (
            (column - (LAYOUT.columns - 1) / 2) * LAYOUT.pitch,
            LAYOUT.lift + layer * LAYOUT.layer_rise,
            (row - (LAYOUT.rows - 1) / 2) * LAYOUT.pitch - layer * LAYOUT.layer_back,
        )
        # Neighbours in a layer mesh tooth to gap; the clear wheels form a chequered lattice in depth as well.
        shape = positions if (row + column) % 2 == 0 else half_a_tooth_on
        builder.mesh(shape + center, faces, builder.material(_paint(layer, row, column)))
    return builder.build(LIGHTS, background=SKY, camera=STAGE.classic_camera(ray_depth=RAY_DEPTH))


def _paint(layer: int, row: int, column: int) -> ClassicMaterial:
    """Hues step by the golden ratio, so that neighbours in any direction differ."""
    index = (layer * LAYOUT.rows + row) * LAYOUT.columns + column
    color = hsv_to_rgb((index * 0.6180339887) % 1.0, 0.62, 1.0)
    return replace(CLEAR if (layer + row + column) % 2 else OPAQUE, color=color)
