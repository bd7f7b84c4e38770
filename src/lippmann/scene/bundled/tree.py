"""The tree: 4095 tapering branches and as many joints, under seven lights.

Every branch bears two, twelve generations of them: of the kind and count of the tree scene of Haines' Standard
Procedural Databases (IEEE Computer Graphics and Applications 7(11), 1987). Branches fork by fixed angles about an axis
that turns by the golden angle from branch to branch, so that no two boughs are alike though nothing is random.
Millimetres of the paper's display, +y up, the lawn at y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.bundled.stage import Stage, level_rectangle
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import Background, ClassicLight, ClassicMaterial
from lippmann.scene.whitted.builder import ClassicSceneBuilder

NAME = "tree"

Points = NDArray[np.float64]

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True)
class Layout:
    """Sizes in mm, angles in degrees.

    The trunk is ``trunk`` long and ``radius`` thick at its foot; a branch's radius shrinks to ``taper`` of its foot's
    along it, its two children are ``lengths`` of it long and lean away from it by ``forks``;
    ``turn`` is the direction of the first fork. The lawn's corners are
    given as (x, z).
    """

    generations: int = 12
    trunk: float = 29.0
    radius: float = 3.6
    taper: float = 0.69
    lengths: tuple[float, float] = (0.74, 0.64)
    forks: tuple[float, float] = (24.0, 30.0)
    turn: float = 10.0
    lawn: tuple[tuple[float, float], tuple[float, float]] = ((-64.0, -15.0), (64.0, 47.0))


LAYOUT = Layout()
STAGE = Stage(target=(0.0, 44.0, 28.2), elevation=15.0)

BARK = ClassicMaterial(color=(0.55, 0.40, 0.20), ambient=0.19, diffuse=1.0)
LAWN = ClassicMaterial(color=(0.20, 0.70, 0.20), ambient=0.19, diffuse=1.0)
LIGHTS = tuple(
    ClassicLight("point", (0.19, 0.19, 0.19), center=center)
    for center in (
        (-150.0, 900.0, -100.0),
        (520.0, 560.0, 480.0),
        (-720.0, 380.0, 560.0),
        (200.0, 760.0, -560.0),
        (-540.0, 220.0, -700.0),
        (900.0, 400.0, -440.0),
        (-200.0, 560.0, 980.0),
    )
)
SKY = Background(color=(0.08, 0.36, 0.75))
RAY_DEPTH = 2


@dataclass(frozen=True, eq=False)
class Branches:
    """Truncated cones: ``base``, ``apex`` ``(n, 3)``, ``base_radius``, ``apex_radius`` ``(n,)``, trunk first."""

    base: Points
    apex: Points
    base_radius: Points
    apex_radius: Points


def grow(layout: Layout = LAYOUT) -> Branches:
    """Return the branches, generation after generation."""
    turn = np.radians(layout.turn)
    base, direction = np.zeros((1, 3)), np.array([(0.0, 1.0, 0.0)])
    side = np.array([(np.cos(turn), 0.0, np.sin(turn))])
    length, radius = np.full(1, layout.trunk), layout.radius
    generations: list[tuple[Points, Points, Points, Points]] = []
    count = 0
    for _ in range(layout.generations):
        apex = base + direction * length[:, None]
        tip = radius * layout.taper
        generations.append((base, apex, np.full(len(base), radius), np.full(len(base), tip)))
        golden = GOLDEN_ANGLE * (count + np.arange(len(base)))
        count += len(base)
        third = np.cross(direction, side)
        away = side * np.cos(golden)[:, None] + third * np.sin(golden)[:, None]
        lean = np.radians(layout.forks) * (1.0, -1.0)
        # Both children bend in the plane of the branch and of `away`, to either side.
        children = direction[:, None] * np.cos(lean)[:, None] + away[:, None] * np.sin(lean)[:, None]
        sides = away[:, None] * np.cos(lean)[:, None] - direction[:, None] * np.sin(lean)[:, None]
        base = np.repeat(apex, 2, axis=0)
        direction, side = children.reshape(-1, 3), sides.reshape(-1, 3)
        length = (length[:, None] * layout.lengths).reshape(-1)
        radius = tip
    return Branches(*(np.concatenate(column) for column in zip(*generations, strict=True)))


def make() -> ClassicScene:
    """Return the tree on its lawn."""
    builder = ClassicSceneBuilder(NAME, handedness="right")
    builder.mesh(*level_rectangle(*LAYOUT.lawn), builder.material(LAWN))
    bark = builder.material(BARK)
    tree = grow()
    builder.tubes(tree.base, tree.apex, tree.base_radius, bark, apex_radius=tree.apex_radius)
    builder.spheres(tree.apex, tree.apex_radius, bark)
    return builder.build(LIGHTS, background=SKY, camera=STAGE.classic_camera(ray_depth=RAY_DEPTH))
