"""Replayed pictures against pictures that Mitsuba's own cameras take in the scene itself.

What "sampled at the same points" means. An eye that looks at a lens sees the panel point behind the lens's centre, and
there a pixel. What the pixel shows was recorded along one line: through the pixel's centre and the centre of its lens.
Continued to the viewing distance D that line passes a *viewpoint*; if D is infinite it has a *direction* instead. So
the replayed colour is one sample of the picture that a perspective camera at the viewpoint (an orthographic one that
looks along the direction) takes, at the place where this camera sees the lens's centre. An eye at a viewpoint that all
lenses share is that camera: then the whole replayed picture is one direct picture. Any other eye sees a mosaic of
direct pictures, one for each view that it sees somewhere.

A lenticular sheet has no parallax along its lenses: its viewpoints lie level with the middle of the panel, and its
directions are level, however high the eye is.

Lenses, panel points, pixels and viewpoints are worked out here from the definitions, by trying all lenses; cameras,
intersections and surfaces are Mitsuba's. Samples where a shift of a ten-thousandth of a millimetre makes the direct
camera see another surface (silhouettes, edges) are left out; all others must agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

#: Millimetres. 8 pixels of 0.5 mm, 10 mm behind the lenses: a field of 23 degrees.
PIXEL, GAP, DISTANCE, APERTURE = 0.5, 10.0, 400.0, 60.0

#: A camera this far away (mm) starts in front of every scene here.
ORTHOGRAPHIC_START = 100.0

#: How far (mm in the lens plane) a stable sample may be moved, and how far (mm) its surface point may jump then.
NUDGE, JUMP = 1e-4, 1e-2


# ---- Displays by hand ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sheet:
    """A display in numbers: ``across`` pixels per lens along a row, ``columns`` lenses, ``rows`` lenses or pixels."""

    layout: str
    across: int
    columns: int
    rows: int
    distance: float = math.inf
    tangent: float = 0.0
    row_pixels: int = 1

    @property
    def stretch(self):
        """Size of a micro-image over that of its lens."""
        return 1 + GAP / self.distance

    @property
    def pitch(self):
        return self.across * PIXEL / self.stretch * math.cos(math.atan(self.tangent))

    @property
    def row_pitch(self):
        return (self.across if self.layout == "square" else self.row_pixels) * PIXEL / self.stretch

    @property
    def size(self):
        """Pixels of the panel."""
        height = self.rows * {"lenticular": 1, "square": self.across, "hexagonal": self.row_pixels}[self.layout]
        return self.across * self.columns, height

    def display(self):
        from lippmann.display import Display, LensArray, Panel

        slant = math.degrees(math.atan(self.tangent))
        lenses = {
            "lenticular": lambda: LensArray("lenticular", self.pitch, slant=slant),
            "square": lambda: LensArray("square", self.pitch),
            "hexagonal": lambda: LensArray("hexagonal", self.pitch, row_pitch=self.row_pitch, offset=(0.0, 0.0)),
        }[self.layout]()
        return Display(
            f"proof-{self.layout}",
            Panel(*self.size, PIXEL),
            lenses,
            GAP,
            viewing_distance=self.distance,
            aperture_distance=APERTURE,
        )

    def centers(self):
        """``(n, 2)`` lens centres, more than the panel needs; of a lenticular sheet x is across, y is 0."""
        i = np.arange(-self.columns, self.columns + 1)
        if self.layout == "lenticular":
            # A slanted sheet has an axis through the middle; a straight one tiles the panel with whole lenses.
            first = 0.5 if self.tangent == 0 and self.columns % 2 == 0 else 0.0
            return np.stack([(i + first) * self.pitch, 0.0 * i], axis=-1)
        j = np.arange(-self.rows, self.rows + 1)
        if self.layout == "square":
            x, y = np.meshgrid(i + 0.5 * (self.columns % 2 == 0), j + 0.5 * (self.rows % 2 == 0))
        else:
            x, y = np.meshgrid(i, j)
            x = x + 0.5 * (y % 2)
        return np.stack([x * self.pitch, y * self.row_pitch], axis=-1).reshape(-1, 2)

    def to_axes(self, points):
        """Coordinates across and along slanted lenses."""
        cos, sin = math.cos(math.atan(self.tangent)), math.sin(math.atan(self.tangent))
        x, y = points[..., 0], points[..., 1]
        return np.stack([x * cos - y * sin, x * sin + y * cos], axis=-1)

    def from_axes(self, points):
        return replace(self, tangent=-self.tangent).to_axes(points)

    def nearest_lens(self, points):
        """``(n, 2)`` centre of the lens that holds each point of the lens plane, and ``(n,)`` whether that is clear."""
        centers = self.centers()
        if self.layout == "lenticular":
            points = self.to_axes(points) * [1.0, 0.0]
        distances = np.linalg.norm(points[:, None] - centers, axis=-1)
        order = np.argsort(distances, axis=1)[:, :2]
        first, second = np.take_along_axis(distances, order, axis=1).T
        return centers[order[:, 0]], second - first > 1e-6


STRAIGHT = Sheet("lenticular", across=9, columns=24, rows=160)
# Three rows down is one pixel across: sub-pixels of neighbouring rows stand behind the same places of their lenses.
SLANTED = Sheet("lenticular", across=8, columns=20, rows=120, tangent=1 / 3)
LEANING_LEFT = Sheet("lenticular", across=8, columns=20, rows=120, tangent=-1 / 6)
SQUARE = Sheet("square", across=8, columns=24, rows=20)
HEXAGONAL = Sheet("hexagonal", across=8, columns=24, rows=24, row_pixels=7)
SHEETS = {
    "straight": STRAIGHT,
    "slanted": SLANTED,
    "leaning left": LEANING_LEFT,
    "square": SQUARE,
    "hexagonal": HEXAGONAL,
}


@dataclass
class Samples:
    """What an eye sees: ``points`` ``(n, 2)`` where its lines meet the lens plane once recorded, and the camera that
    sees the same, ``viewpoints`` ``(n, 2)``: x, y at the viewing distance, or the slopes dx/dz, dy/dz of a direction.

    ``clear`` is False where a line between two lenses is hit; ``own`` says if the pixel belongs to the lens looked at.
    """

    points: np.ndarray
    viewpoints: np.ndarray
    clear: np.ndarray
    own: np.ndarray


def lens_plane_points(sheet, width, height):
    """``(n, 2)`` places of the pixels of a replayed picture, whose frame is the panel's own, row by row."""
    w, h = np.array(sheet.size) * PIXEL
    x, y = (np.arange(width) + 0.5) / width * w - w / 2, h / 2 - (np.arange(height) + 0.5) / height * h
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def samples_of(sheet, points, eye, offset=(0.0, 0.0)):
    """What an eye at ``eye`` sees when it looks at ``points``; ``offset`` is that of the sub-pixel, right and down."""
    lens, clear = sheet.nearest_lens(points)
    eye_xy = np.array(eye[:2])
    if sheet.layout == "lenticular":
        lens_points = sheet.to_axes(points)
        lens_points[:, 0] = lens[:, 0]
        lens_points = sheet.from_axes(lens_points)
    else:
        lens_points = lens
    seen = lens_points + (lens_points - eye_xy) * (GAP / eye[2])
    # The (sub-)pixel there; on a line between two it is the right or lower one.
    half = np.array(sheet.size) / 2
    column = np.floor(seen[:, 0] / PIXEL + half[0] - offset[0] + 1e-6)
    row = np.floor(half[1] - seen[:, 1] / PIXEL - offset[1] + 1e-6)
    x = (column + 0.5 + offset[0] - half[0]) * PIXEL
    y = (half[1] - row - 0.5 - offset[1]) * PIXEL
    pixel = np.stack([x, y], axis=-1)
    inside = (column >= 0) & (column < sheet.size[0]) & (row >= 0) & (row < sheet.size[1])
    # The line it recorded.
    owner, owner_clear = sheet.nearest_lens(pixel / sheet.stretch)
    own = inside & (np.abs(owner - lens).max(axis=1) < 1e-6)
    if sheet.layout == "lenticular":
        along = sheet.to_axes(pixel)
        owner = sheet.from_axes(np.stack([owner[:, 0], along[:, 1] / sheet.stretch], axis=-1))
        slope = sheet.from_axes(sheet.to_axes((owner - pixel) / GAP) * [1.0, 0.0])
        level = sheet.from_axes(sheet.to_axes(owner) * [1.0, 0.0])
    else:
        slope = (owner - pixel) / GAP
        level = owner
    viewpoint = slope if math.isinf(sheet.distance) else level + slope * sheet.distance
    return Samples(owner, viewpoint, inside & clear & owner_clear, own)


# ---- Mitsuba's cameras ---------------------------------------------------------------------------------------------


def camera_rays(world_from_display, distance, viewpoint, points):
    """Rays of the Mitsuba camera at one viewpoint through ``points`` ``(n, 2)`` of the lens plane."""
    import mitsuba as mi

    def in_world(point):
        return (world_from_display @ [*point, 1.0])[:3]

    unit = float(np.linalg.norm(world_from_display[:3, 0]))
    direction = np.array([0.0, 0.0, -1.0]) if math.isfinite(distance) else np.array([*-viewpoint, -1.0])
    direction /= np.linalg.norm(direction)
    origin = np.array([*viewpoint, distance]) if math.isfinite(distance) else -direction * ORTHOGRAPHIC_START
    pose = mi.ScalarTransform4d().look_at(
        origin=in_world(origin), target=in_world(origin + direction), up=world_from_display[:3, 1] / unit
    )
    # The camera's picture: a square about the middle of its view that holds all points.
    right = np.cross(direction, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, direction)
    relative = np.concatenate([points, np.zeros((len(points), 1))], axis=1) - origin
    picture = np.stack([relative @ right, relative @ up], axis=-1)
    half = 1.1 * np.abs(picture).max()
    common = {
        "film": {"type": "hdrfilm", "width": 100, "height": 100, "rfilter": {"type": "box"}},
        "near_clip": unit,
        "far_clip": 1e3 * unit,
    }
    if math.isfinite(distance):
        fov = math.degrees(2 * math.atan(half / distance))
        sensor = mi.load_dict({"type": "perspective", "to_world": pose, "fov": fov, "fov_axis": "x", **common})
    else:
        pose = pose @ mi.ScalarTransform4d().scale([half * unit, half * unit, 1.0])
        sensor = mi.load_dict({"type": "orthographic", "to_world": pose, **common})
    film = 0.5 + 0.5 * picture / half * [1.0, -1.0]
    position = mi.Point2f(film[:, 0].astype(np.float32), film[:, 1].astype(np.float32))
    ray, _ = sensor.sample_ray(0.0, 0.5, position, mi.Point2f(0.5, 0.5))
    return tuple(np.broadcast_to(np.array(vector).T, (len(points), 3)) for vector in (ray.o, ray.d))


@dataclass
class Direct:
    """What the direct cameras see, in the display's frame: ``(n, 3)`` each; ``hit`` ``(n,)``."""

    hit: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    emission: np.ndarray
    stable: np.ndarray


def direct_pictures(built, world_from_display, sheet, samples):
    """The direct pictures' samples, one camera for each viewpoint that occurs."""
    nudges = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]) * NUDGE
    n = len(samples.points)
    origin, direction = np.zeros((5, n, 3)), np.zeros((5, n, 3))
    _, group = np.unique(np.round(samples.viewpoints, 6), axis=0, return_inverse=True)
    group = group.reshape(-1)
    for number in range(group.max() + 1):
        members = np.flatnonzero(group == number)
        viewpoint = samples.viewpoints[members].mean(axis=0)
        points = (samples.points[members] + nudges[:, None]).reshape(-1, 2)
        o, d = camera_rays(world_from_display, sheet.distance, viewpoint, points)
        origin[:, members], direction[:, members] = o.reshape(5, -1, 3), d.reshape(5, -1, 3)
    hit, position, normal, emission = intersect(built, origin.reshape(-1, 3), direction.reshape(-1, 3))
    unit = np.linalg.norm(world_from_display[:3, 0])
    position = (position - world_from_display[:3, 3]) @ world_from_display[:3, :3] / unit**2
    normal = normal @ world_from_display[:3, :3] / unit
    hit, position = hit.reshape(5, n), position.reshape(5, n, 3)
    jump = np.abs(position - position[0]).max(axis=(0, 2))
    stable = (hit == hit[0]).all(axis=0) & (~hit[0] | (jump < JUMP))
    return Direct(hit[0], position[0], normal[:n], emission[:n], stable), int(group.max()) + 1


def intersect(built, origin, direction):
    """Hit or not, point, shading normal and emitted light of the first surface, all by Mitsuba."""
    import drjit as dr
    import mitsuba as mi

    scene = built.mitsuba
    ray = mi.Ray3f(mi.Point3f(origin.T.astype(np.float32)), mi.Vector3f(direction.T.astype(np.float32)))
    si = scene.ray_intersect(ray)
    hit = si.is_valid()
    light = dr.select(hit, si.emitter(scene).eval(si), 0)
    return (np.array(hit), *(np.array(value).T for value in (dr.select(hit, si.p, 0), si.sh_frame.n, light)))


# ---- Scenes --------------------------------------------------------------------------------------------------------

SCENES = {
    "teapot": "teapot",
    "fancy teapot": "gltf/fancy_teapot/scene.gltf",
    "clear coat": "gltf/clearcoat_test/ClearCoatTest.gltf",
}


def glowing(scene):
    """The scene with every material unlit: its colours, textures and all, shine by themselves."""
    description = scene.description
    materials = [replace(material, unlit=True) for material in description.materials]
    return replace(scene, description=replace(description, materials=materials))


@pytest.fixture(scope="module")
def scenes(request):
    """Scenes by name, loaded once."""
    from lippmann.api import load_scene

    loaded = {}

    def get(name):
        if name not in loaded:
            file = SCENES[name]
            scene = load_scene(file if name == "teapot" else request.getfixturevalue("shared_scenes") / file)
            loaded[name] = glowing(scene)
        return loaded[name]

    return get


@pytest.fixture(autouse=True)
def built(monkeypatch):
    """Mitsuba's scene of a scene; each is built once for all tests."""
    from lippmann.render import pipeline

    build = pipeline._build

    def build_once(scene):
        if scene.name not in _BUILT:
            _BUILT[scene.name] = build(scene)
        return _BUILT[scene.name]

    monkeypatch.setattr(pipeline, "_build", build_once)
    return build_once


_BUILT: dict = {}


@pytest.fixture(scope="module", autouse=True)
def _forget_built():
    yield
    _BUILT.clear()


# ---- Comparison ----------------------------------------------------------------------------------------------------


def psnr(a, b, peak):
    return 10 * math.log10(peak**2 / max(float(np.mean(np.square(a - b, dtype=np.float64))), 1e-16))


def compare(scene, built, sheet, eyes, size=(31, 37), subpixels=False, **placement):
    """Replays to all eyes against the direct pictures; returns the worst figure of each kind in dB."""
    from lippmann.api import render

    placement = placement or {"place": "fit"}
    pictures = {
        kind: render(
            scene,
            sheet.display(),
            integrator=integrator,
            depth=1 if integrator == "path" else None,
            spp=1,
            pixel_filter="point",
            subpixels=subpixels,
            **placement,
        )
        for kind, integrator in (("position", "position"), ("normal", "normal"), ("emission", "path"))
    }
    matrix = pictures["position"].world_from_display
    depth = np.ptp(pictures["position"].provenance.options["depth_range"])
    worst = {}
    offsets = ((-1 / 3, 0.0), (0.0, 0.0), (1 / 3, 0.0)) if subpixels else ((0.0, 0.0),)
    for eye in eyes:
        seen = {kind: image.replay(eye, size=size).reshape(-1, 3) for kind, image in pictures.items()}
        for channel, offset in enumerate(offsets):
            samples = samples_of(sheet, lens_plane_points(sheet, *size), eye, offset)
            direct, cameras = direct_pictures(built(scene), matrix, sheet, samples)
            part = slice(channel, channel + 1) if subpixels else slice(0, 3)
            figures = figures_of(seen, samples, direct, depth, part) | {"cameras": -cameras}
            worst = {kind: min(value, worst.get(kind, math.inf)) for kind, value in figures.items()}
    return worst


def figures_of(seen, samples, direct, depth, part):
    usable = samples.clear & direct.stable
    assert usable[samples.clear].mean() > 0.93  # edges alone are left out
    assert samples.clear.mean() > 0.75  # not between lenses, nor past the panel
    hit = usable & direct.hit
    assert 0.1 < hit[usable].mean()
    # What is nothing to the one is nothing to the other.
    assert (seen["position"][usable & ~direct.hit, part] == 0).all()
    assert (np.abs(seen["position"][hit, part]).max(axis=1) > 0).all()
    position = seen["position"][:, part] - direct.position[:, part]
    assert np.abs(position[hit]).max() < 0.05 # no single lens may stand aside
    return {
        "hit": 100 * hit.mean(),
        "max_mm": -float(np.abs(position[hit]).max()),
        "stable": 100 * usable[samples.clear].mean(),
        "own": 100 * samples.own[samples.clear].mean(),
        "position": psnr(seen["position"][hit][:, part], direct.position[hit][:, part], depth),
        "normal": psnr(seen["normal"][hit][:, part], direct.normal[hit][:, part], 1.0),
        "emission": psnr(seen["emission"][hit][:, part], direct.emission[hit][:, part], 1.0),
    }


def eyes_of(sheet):
    d = sheet.distance if math.isfinite(sheet.distance) else 1e12
    s = PIXEL * d / GAP
    right, down = [x - (0.5 if sheet.across % 2 == 0 else 0.0) for x in (3, -2)]
    near = 500.0
    return {
        "shared": [(-right * s, (0 if sheet.layout == "lenticular" else 1) * down * s, d)],
        "general": [(7.3, -11.9, near), (-41.7, 23.1, near)],
    }


@pytest.mark.parametrize("distance", [math.inf, DISTANCE])
@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.parametrize("scene", SCENES)
def test_x(scene, name, distance, scenes, built):
    import time
    sheet = replace(SHEETS[name], distance=distance)
    for k, eyes in eyes_of(sheet).items():
        t = time.time()
        print(scene, name, distance, k, compare(scenes(scene), built, sheet, eyes, subpixels=name == "slanted"), time.time() - t)
