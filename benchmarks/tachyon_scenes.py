"""Scenes for ``tachyon.py``, each of one kind that might suit one program better than the other, as Tachyon files.

Every function returns the text of a scene whose camera, lights and ray depth are its own. Objects placed at random have
a fixed seed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float64]

LIGHTS = (((-6.0, 9.0, -8.0), (0.5, 0.5, 0.45)), ((7.0, 6.0, -9.0), (0.3, 0.3, 0.35)), ((0.0, 12.0, 4.0), (0.2,) * 3))
IMAGE = "IMAGEDEF ::cells FORMAT RGB24 RESOLUTION 4 4 1 ENCODING HEX " + " ".join(
    f"{255 - 14 * cell:02x}{40 + 12 * cell:02x}{(90 * cell) % 256:02x}" for cell in range(16)
)


def row(values: Iterable[float]) -> str:
    """Numbers as the file has them."""
    return " ".join(f"{float(value):.9g}" for value in values)


def finish(
    name: str,
    color: Iterable[float] = (0.8, 0.8, 0.8),
    *,
    ambient: float = 0.1,
    diffuse: float = 0.8,
    mirror: float = 0.0,
    opacity: float = 1.0,
    texture: str = "TEXFUNC 0",
) -> str:
    """A material by name."""
    light = f"AMBIENT {ambient} DIFFUSE {diffuse} SPECULAR {mirror} OPACITY {opacity}"
    return f"TEXDEF {name} {light} COLOR {row(color)} {texture}"


def scene(
    body: Iterable[str],
    *,
    center: Iterable[float] = (0.0, 4.0, -14.0),
    view: Iterable[float] = (0.0, -0.27, 1.0),
    depth: int = 3,
    lights: Iterable[tuple[Iterable[float], Iterable[float]]] = LIGHTS,
    background: Iterable[float] = (0.08, 0.36, 0.57),
) -> str:
    """A scene file: camera, point lights, then ``body``."""
    return "\n".join(
        [
            "BEGIN_SCENE RESOLUTION 512 512",
            f"CAMERA ZOOM 1.2 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH {depth} CENTER {row(center)} "
            f"VIEWDIR {row(view)} UPDIR 0 1 0 END_CAMERA",
            f"BACKGROUND {row(background)}",
            *(f"LIGHT CENTER {row(place)} RAD 0.01 COLOR {row(color)}" for place, color in lights),
            *body,
            "END_SCENE",
            "",
        ]
    )


def sphere(center: Iterable[float], radius: float, name: str) -> str:
    return f"SPHERE CENTER {row(center)} RAD {radius:.9g} {name}"


def tube(base: Iterable[float], apex: Iterable[float], radius: float, name: str) -> str:
    return f"FCYLINDER BASE {row(base)} APEX {row(apex)} RAD {radius:.9g} {name}"


def box(low: Iterable[float], high: Iterable[float], name: str) -> str:
    return f"BOX MIN {row(low)} MAX {row(high)} {name}"


def floor(name: str, height: float = -1.0) -> str:
    return f"PLANE CENTER 0 {height} 0 NORMAL 0 1 0 {name}"


def frames(directions: Vectors) -> Vectors:
    """Rotations ``(n, 3, 3)`` whose last column is a direction ``(n, 3)``."""
    helper = np.where(np.abs(directions[:, 1:2]) < 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    x = np.cross(helper, directions)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(directions, x), directions], axis=2)


def unit_vectors(rng: np.random.Generator, count: int) -> Vectors:
    vectors = rng.normal(size=(count, 3))
    unit: Vectors = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit


def sphereflake() -> str:
    """7 381 mirrored spheres: each has nine of a third of its radius, four generations; five rays deep."""
    turns = np.radians(np.arange(0, 360, 60.0))
    upper = np.radians(np.arange(30, 390, 120.0))
    around = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(6)])
    above = np.column_stack([np.cos(upper), np.sin(upper), np.full(3, np.sqrt(2))]) / np.sqrt(3)
    around[:, 2], ring = -0.12, np.concatenate([around, above])
    ring /= np.linalg.norm(ring, axis=1, keepdims=True)
    centers, directions, radius = np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]), 2.2
    body = [finish("steel", (1.0, 0.9, 0.7), ambient=0.1, diffuse=0.5, mirror=0.5), finish("ground", (1, 0.75, 0.33))]
    body.append(floor("ground", -2.2))
    for _ in range(5):
        body += [sphere(center, radius, "steel") for center in centers]
        turned = np.einsum("nij,kj->nki", frames(directions), ring).reshape(-1, 3)
        centers = np.repeat(centers, 9, axis=0) + turned * (radius * 4 / 3)
        directions, radius = turned, radius / 3
    return scene(body, center=(4.5, 4.5, -6.5), view=(-0.62, -0.52, 1.0), depth=5)


def lattice() -> str:
    """729 mirrored spheres at the points of a cubic grid, 1 944 mirrored rods between neighbours; eight rays deep."""
    body = [
        finish("ball", (1.0, 0.6, 0.4), ambient=0.1, diffuse=0.4, mirror=0.5),
        finish("rod", (0.5, 0.8, 1.0), ambient=0.1, diffuse=0.5, mirror=0.4),
    ]
    points = np.stack(np.meshgrid(*[np.arange(9.0) - 4] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    body += [sphere(point, 0.2, "ball") for point in points]
    for axis in np.eye(3):
        body += [tube(point, point + axis, 0.06, "rod") for point in points if (point + axis).max() <= 4]
    return scene(body, center=(7.0, 5.5, -9.5), view=(-0.72, -0.56, 1.0), depth=8)


def small_spheres() -> str:
    """20 000 small matt spheres in a ball."""
    rng = np.random.default_rng(1)
    places = unit_vectors(rng, 20000) * (4.5 * rng.random((20000, 1)) ** (1 / 3)) + np.array([0.0, 1.0, 0.0])
    body = [finish("red", (0.9, 0.4, 0.3)), finish("ground"), floor("ground", -4.0)]
    body += [sphere(place, radius, "red") for place, radius in zip(places, rng.uniform(0.02, 0.1, 20000), strict=True)]
    return scene(body)


def deep_mirrors() -> str:
    """Nine mirrored balls in a room of six mirrors: every ray goes twelve deep."""
    body = [
        finish("glass", (0.5, 0.6, 0.7), ambient=0.05, diffuse=0.1, mirror=0.85),
        finish("ball", (1, 0.7, 0.5), ambient=0.05, diffuse=0.3, mirror=0.6),
    ]
    for axis in range(3):
        for side in (-6.0, 6.0):
            place, normal = np.zeros(3), np.zeros(3)
            place[axis], normal[axis] = side, -np.sign(side)
            body.append(f"PLANE CENTER {row(place)} NORMAL {row(normal)} glass")
    body += [sphere((x, y, x * y / 3), 0.9, "ball") for x in (-3, 0, 3) for y in (-3, 0, 3)]
    lights = [((-3.0, 5.0, -4.0), (0.6, 0.6, 0.5)), ((4.0, 4.0, 3.0), (0.4, 0.4, 0.5))]
    return scene(body, center=(0.5, 0.8, -5.5), view=(0.1, -0.1, 1.0), depth=12, lights=lights)


def _knot(around: int, across: int) -> Vectors:
    """Triangles ``(2 around across, 3, 2, 3)`` of a knotted pipe: corners, each a point and its normal."""
    t = np.linspace(0, 2 * np.pi, around, endpoint=False)
    path = np.column_stack(
        [(2 + np.cos(3 * t)) * np.cos(2 * t), np.sin(3 * t) * 1.2, (2 + np.cos(3 * t)) * np.sin(2 * t)]
    )
    along = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    turned = frames(along / np.linalg.norm(along, axis=1, keepdims=True))
    s = np.linspace(0, 2 * np.pi, across, endpoint=False)
    normals = np.einsum("nij,kj->nki", turned[:, :, :2], np.column_stack([np.cos(s), np.sin(s)]))
    corners = np.stack([path[:, None] + normals * 0.55, normals], axis=2)
    a, b = corners, np.roll(corners, -1, axis=0)
    # The seam of the frame turns at places; triangles there are as good as any.
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    return np.concatenate([np.stack([a, c, b], axis=2), np.stack([a, d, c], axis=2)]).reshape(-1, 3, 2, 3)


def _smooth_triangles(triangles: Vectors, name: str) -> list[str]:
    return [
        " ".join(
            ["STRI", *(f"V{k} {row(point)}" for k, (point, _) in enumerate(corners))]
            + [f"N{k} {row(normal)}" for k, (_, normal) in enumerate(corners)]
            + [name]
        )
        for corners in triangles
    ]


def large_mesh() -> str:
    """A smooth knot of 200 000 triangles, slightly mirrored."""
    body = [finish("clay", (0.8, 0.6, 0.5), diffuse=0.7, mirror=0.2), finish("ground"), floor("ground", -2.5)]
    body += _smooth_triangles(_knot(1000, 100), "clay")
    return scene(body, center=(0.0, 4.0, -8.5), view=(0.0, -0.45, 1.0))


def mirror_mesh() -> str:
    """A mirrored knot of 20 000 triangles, eight rays deep."""
    body = [finish("chrome", (0.8, 0.8, 0.9), diffuse=0.2, mirror=0.75), finish("ground", texture=_CHECKER)]
    body += [floor("ground", -2.5), *_smooth_triangles(_knot(400, 25), "chrome")]
    return scene(body, center=(0.0, 4.0, -8.5), view=(0.0, -0.45, 1.0), depth=8)


def glass_mesh() -> str:
    """A transparent knot of 20 000 triangles: every ray and every shadow crosses many of them."""
    body = [finish("film", (0.6, 0.8, 0.9), diffuse=0.5, mirror=0.0, opacity=0.4), finish("ground", texture=_CHECKER)]
    body += [floor("ground", -2.5), *_smooth_triangles(_knot(400, 25), "film")]
    return scene(body, center=(0.0, 4.0, -8.5), view=(0.0, -0.45, 1.0), depth=8)


_CHECKER = "TEXFUNC 1 CENTER 0.05 0.05 0.05 ROTATE 0 0 0 SCALE 1 1 1"


def needles() -> str:
    """3 000 long thin cylinders that cross each other."""
    rng = np.random.default_rng(2)
    middles, half = rng.uniform(-4, 4, (3000, 3)) + np.array([0.0, 1.0, 0.0]), unit_vectors(rng, 3000) * 4
    body = [finish("pine", (0.4, 0.7, 0.3)), finish("ground"), floor("ground", -5.0)]
    body += [tube(middle - arm, middle + arm, 0.02, "pine") for middle, arm in zip(middles, half, strict=True)]
    return scene(body)


def foggy_spheres() -> str:
    """2 000 mirrored spheres over a checkered ground in fog."""
    rng = np.random.default_rng(3)
    places = np.column_stack([rng.uniform(-12, 12, 2000), rng.uniform(-0.8, 5, 2000), rng.uniform(-4, 30, 2000)])
    body = ["FOG EXP START 2 END 60 DENSITY 0.06 COLOR 0.6 0.6 0.65", finish("ball", (0.8, 0.3, 0.2), mirror=0.3)]
    body += [finish("ground", texture=_CHECKER), floor("ground")]
    body += [sphere(place, radius, "ball") for place, radius in zip(places, rng.uniform(0.1, 0.35, 2000), strict=True)]
    return scene(body, depth=4)


def many_lights() -> str:
    """100 lights over 900 spheres on a ground."""
    body = [finish("ball", (0.9, 0.8, 0.7), mirror=0.2), finish("ground"), floor("ground")]
    body += [sphere((x * 0.6, -0.6, z * 0.6), 0.25, "ball") for x in range(-15, 15) for z in range(-10, 20)]
    rng = np.random.default_rng(4)
    places = np.column_stack([rng.uniform(-9, 9, 100), rng.uniform(2, 6, 100), rng.uniform(-8, 12, 100)])
    return scene(body, lights=[(place, (0.02, 0.02, 0.018)) for place in places])


def textures() -> str:
    """Every kind of texture on spheres, and on a ground and a wall."""
    place = "ROTATE 0.1 0.2 0 SCALE 2 3 1"
    kinds = {
        "checker": _CHECKER,
        "grit": "TEXFUNC 2 CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1",
        "marble": "TEXFUNC 3 CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1",
        "wood": "TEXFUNC 4 CENTER 0 0 0 ROTATE 0 0 0 SCALE 0.02 0.02 0.02",
        "noise": "TEXFUNC 5 CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1",
        "around": "TEXFUNC 6 CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1",
        "rolled": f"TEXFUNC 7 ::cells CENTER 0 0 0 {place}",
        "globe": f"TEXFUNC 8 ::cells CENTER 0 0 0 {place}",
        "tiles": f"TEXFUNC 9 ::cells CENTER 0 0 0 {place} UAXIS 0.3 0 0 VAXIS 0 0 0.3",
    }
    body = [IMAGE, *(finish(name, (0.9, 0.8, 0.7), mirror=0.1, texture=kind) for name, kind in kinds.items())]
    body += [floor("tiles"), "PLANE CENTER 0 0 12 NORMAL 0 0 -1 marble"]
    names = list(kinds)
    body += [
        sphere((x * 1.1, y * 1.1, y * 0.4), 0.5, names[(3 * x + 5 * y) % len(names)])
        for x in range(-6, 7)
        for y in range(7)
    ]
    return scene(body)


def planes() -> str:
    """24 planes and 24 endless cylinders, half of them mirrors."""
    rng = np.random.default_rng(5)
    body = [finish("wall", (0.7, 0.7, 0.8)), finish("mirror", diffuse=0.3, mirror=0.6)]
    for number, normal in enumerate(unit_vectors(rng, 24)):
        body.append(f"PLANE CENTER {row(normal * 9)} NORMAL {row(-normal)} {('wall', 'mirror')[number % 2]}")
    for number, (place, axis) in enumerate(zip(rng.uniform(-5, 5, (24, 3)), unit_vectors(rng, 24), strict=True)):
        material = ("wall", "mirror")[number % 2]
        body.append(f"CYLINDER CENTER {row(place + np.array([0.0, 0.0, 5.0]))} AXIS {row(axis)} RAD 0.3 {material}")
    lights = [((-3.0, 4.0, -3.0), (0.6, 0.6, 0.5)), ((3.0, 2.0, -4.0), (0.4, 0.4, 0.5))]
    return scene(body, center=(0, 0.5, -6), view=(0, 0, 1), depth=6, lights=lights)


def glass() -> str:
    """343 transparent, mirrored balls and 64 transparent boxes: rays branch, six deep."""
    body = [
        finish("bubble", (0.5, 0.7, 0.9), ambient=0.05, diffuse=0.3, mirror=0.3, opacity=0.3),
        finish("ground", texture=_CHECKER),
        floor("ground", -4.0),
    ]
    body += [sphere((x, y + 1, z), 0.33, "bubble") for x in range(-3, 4) for y in range(-3, 4) for z in range(-3, 4)]
    corners = np.stack(np.meshgrid(*[np.arange(4.0) * 2 - 3] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + np.array(
        [0.0, 1.0, 0.0]
    )
    body += [box(corner - 0.17 + 0.5, corner + 0.17 + 0.5, "bubble") for corner in corners]
    return scene(body, depth=6)


def rings() -> str:
    """5 000 rings and discs, some mirrored."""
    rng = np.random.default_rng(6)
    body = [finish("gold", (1, 0.8, 0.3), mirror=0.3), finish("paper"), floor("paper", -5.0)]
    places, normals = rng.uniform(-4.5, 4.5, (5000, 3)) + np.array([0.0, 1.0, 0.0]), unit_vectors(rng, 5000)
    inner, outer = rng.uniform(0, 0.1, 5000) * (rng.random(5000) < 0.7), rng.uniform(0.12, 0.2, 5000)
    for number, (place, normal) in enumerate(zip(places, normals, strict=True)):
        material = ("gold", "paper")[number % 2]
        sizes = f"INNER {inner[number]:.6g} OUTER {outer[number]:.6g}"
        body.append(f"RING CENTER {row(place)} NORMAL {row(normal)} {sizes} {material}")
    return scene(body)


def boxes() -> str:
    """A town of 2 500 boxes, windows mirrored, in the sun."""
    rng = np.random.default_rng(7)
    body = ["DIRECTIONAL_LIGHT DIRECTION 1 -1.4 0.6 COLOR 0.4 0.4 0.4", finish("stone", mirror=0.15), finish("ground")]
    body.append(floor("ground"))
    for x in range(-25, 25):
        for z in range(-10, 40):
            height = rng.uniform(0.1, 1.6) * (1 + 2 * (rng.random() < 0.05))
            body.append(box((x * 0.5, -1, z * 0.5), (x * 0.5 + 0.35, height - 1, z * 0.5 + 0.35), "stone"))
    return scene(body)


def clusters() -> str:
    """Clusters within clusters: 8 000 spheres in 20 groups of 20 groups, each a hundredth of the size above."""
    rng = np.random.default_rng(8)
    places, spread = np.array([[0.0, 1.0, 0.0]]), 4.0
    for _ in range(3):
        offsets = rng.normal(size=(len(places), 20, 3)) * spread / 2
        places, spread = (places[:, None] + offsets).reshape(-1, 3), spread / 12
    body = [finish("ball", (0.9, 0.7, 0.3), mirror=0.3), finish("ground"), floor("ground", -5.0)]
    body += [sphere(place, 0.008, "ball") for place in places]
    return scene(body, depth=4)


def mixture() -> str:
    """Some of everything: 300 each of balls, glass balls, tubes, rings and boxes, a mesh, textures, fog, 4 lights."""
    rng = np.random.default_rng(9)
    count = 300
    body = [
        "FOG LINEAR START 10 END 60 DENSITY 1 COLOR 0.5 0.55 0.6",
        finish("ball", (0.9, 0.5, 0.3), mirror=0.4, diffuse=0.5),
        finish("film", (0.5, 0.7, 0.9), mirror=0.2, diffuse=0.4, opacity=0.5),
        finish("wood", texture="TEXFUNC 4 CENTER 0 0 0 ROTATE 0 0 0 SCALE 0.02 0.02 0.02"),
        finish("ground", mirror=0.2, diffuse=0.6, texture=_CHECKER),
        floor("ground", -3.0),
    ]
    low, high = [-6, -2.5, -3], [6, 4.5, 8]
    body += [sphere(place, 0.25, "ball") for place in rng.uniform(low, high, (count, 3))]
    body += [sphere(place, 0.25, "film") for place in rng.uniform(low, high, (count, 3))]
    arms = unit_vectors(rng, count)
    body += [tube(p, p + a, 0.08, "wood") for p, a in zip(rng.uniform(low, high, (count, 3)), arms, strict=True)]
    for place, normal in zip(rng.uniform(low, high, (count, 3)), unit_vectors(rng, count), strict=True):
        body.append(f"RING CENTER {row(place)} NORMAL {row(normal)} INNER 0.15 OUTER 0.35 ball")
    body += [
        box(p, p + s, "wood")
        for p, s in zip(rng.uniform(low, high, (count, 3)), rng.uniform(0.1, 0.5, (count, 3)), strict=True)
    ]
    body += _smooth_triangles(_knot(200, 25) + np.array([[0.0, 1.0, 3.0], [0.0, 0.0, 0.0]]), "ball")
    return scene(body, depth=5, lights=[*LIGHTS, ((-2.0, 5.0, -10.0), (0.2, 0.2, 0.2))])


SCENES: dict[str, Callable[[], str]] = {
    function.__name__: function
    for function in (
        *(sphereflake, lattice, small_spheres, deep_mirrors, large_mesh, mirror_mesh, glass_mesh, needles),
        *(foggy_spheres, many_lights, textures, planes, glass, rings, boxes, clusters, mixture),
    )
}
