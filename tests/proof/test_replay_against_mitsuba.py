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
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

#: Millimetres in front of the lens plane: where rays begin, and where orthographic cameras stand.
APERTURE, CAMERA_START = 60.0, 100.0

#: How far (mm in the lens plane) a stable sample may be moved, and how far (mm) its surface point may jump then.
NUDGE, JUMP = 1e-4, 1e-2

#: The least agreement (dB), and the largest distance (mm) between what any one lens shows and what the camera sees.
LEAST_PSNR, LARGEST_ERROR = 45.0, 5e-3

NO_OFFSET = ((0.0, 0.0),)
RGB_STRIPE = ((-1 / 3, 0.0), (0.0, 0.0), (1 / 3, 0.0))


# ---- Displays by hand ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sheet:
    """A display in numbers, mm: ``across`` (and ``down``) pixels from lens to lens, counted along the panel."""

    layout: str
    across: float
    width: int
    height: int
    down: float = math.inf
    distance: float = math.inf
    tangent: float = 0.0
    pixel: float = 0.5
    gap: float = 10.0

    @property
    def stretch(self):
        """Size of a micro-image over that of its lens."""
        return 1 + self.gap / self.distance

    @property
    def pitch(self):
        return self.across * self.pixel / self.stretch * math.cos(math.atan(self.tangent))

    @property
    def row_pitch(self):
        return self.down * self.pixel / self.stretch

    def display(self):
        from lippmann.display import Display, LensArray, Panel

        slant = math.degrees(math.atan(self.tangent))
        lenses = {
            "lenticular": lambda: LensArray("lenticular", self.pitch, slant=slant),
            "square": lambda: LensArray("square", self.pitch),
            "hexagonal": lambda: LensArray("hexagonal", self.pitch, row_pitch=self.row_pitch, offset=(0.0, 0.0)),
        }[self.layout]()
        panel = Panel(self.width, self.height, self.pixel)
        return Display(
            "proof", panel, lenses, self.gap, viewing_distance=self.distance, aperture_distance=APERTURE
        )

    def centers(self):
        """``(n, 2)`` lens centres, more than the panel needs; of a lenticular sheet x is across, y is 0."""
        reach = math.ceil(self.width / self.across) + 1
        i = np.arange(-reach, reach + 1)
        # Whole lenses tile the panel; a slanted sheet and a hexagonal array here have a lens in the very middle.
        first = 0.5 if self.tangent == 0 and self.width / self.across % 2 == 0 else 0.0
        if self.layout == "lenticular":
            return np.stack([(i + first) * self.pitch, 0.0 * i], axis=-1)
        reach = math.ceil(self.height / self.down) + 1
        j = np.arange(-reach, reach + 1)
        if self.layout == "square":
            x, y = np.meshgrid(i + first, j + (0.5 if self.height / self.down % 2 == 0 else 0.0))
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
        order = np.argpartition(distances, 1, axis=1)[:, :2]
        first, second = np.take_along_axis(distances, order, axis=1).T
        return centers[np.where(first < second, order[:, 0], order[:, 1])], np.abs(second - first) > 1e-6


STRAIGHT = Sheet("lenticular", across=9, width=24 * 9, height=160)
# Three rows down is one pixel across: sub-pixels of neighbouring rows stand behind the same places of their lenses.
SLANTED = Sheet("lenticular", across=8, width=20 * 8, height=120, tangent=1 / 3)
SQUARE = Sheet("square", across=8, down=8, width=24 * 8, height=20 * 8)
HEXAGONAL = Sheet("hexagonal", across=8, down=7, width=24 * 8, height=24 * 7)
SHEETS = {"straight": STRAIGHT, "slanted": SLANTED, "square": SQUARE, "hexagonal": HEXAGONAL}
DISTANCES = [math.inf, 400.0]


@dataclass
class Samples:
    """What an eye sees, worked out by hand.

    ``points`` ``(n, 2)``: where the recorded lines meet the lens plane; ``viewpoints`` ``(n, 2)``: the camera that sees
    the same, as x, y at the viewing distance, or as the slopes dx/dz, dy/dz of a direction. ``clear`` is False past the
    panel, and where a line between two lenses decides; ``own`` says if the pixel belongs to the lens looked at.
    """

    points: np.ndarray
    viewpoints: np.ndarray
    clear: np.ndarray
    own: np.ndarray


def lens_plane_points(sheet, width, height):
    """``(n, 2)`` places of the pixels of a replayed picture, whose frame is the panel's own, row by row."""
    w, h = sheet.width * sheet.pixel, sheet.height * sheet.pixel
    x, y = (np.arange(width) + 0.5) / width * w - w / 2, h / 2 - (np.arange(height) + 0.5) / height * h
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def samples_of(sheet, points, eye, offset=(0.0, 0.0)):
    """What an eye at ``eye`` sees when it looks at ``points``; ``offset`` is that of the sub-pixel, right and down."""
    lens, clear = sheet.nearest_lens(points)
    looked_at = lens
    if sheet.layout == "lenticular":
        along = sheet.to_axes(points)[:, 1]
        looked_at = sheet.from_axes(np.stack([lens[:, 0], along], axis=-1))
    seen = looked_at + (looked_at - np.array(eye[:2])) * (sheet.gap / eye[2])
    # The (sub-)pixel there; on a line between two it is the right or lower one.
    column = np.floor(seen[:, 0] / sheet.pixel + sheet.width / 2 - offset[0] + 1e-6)
    row = np.floor(sheet.height / 2 - seen[:, 1] / sheet.pixel - offset[1] + 1e-6)
    inside = (column >= 0) & (column < sheet.width) & (row >= 0) & (row < sheet.height)
    x = (column + 0.5 + offset[0] - sheet.width / 2) * sheet.pixel
    y = (sheet.height / 2 - row - 0.5 - offset[1]) * sheet.pixel
    pixel = np.stack([x, y], axis=-1)
    # The line that it recorded.
    owner, owner_clear = sheet.nearest_lens(pixel / sheet.stretch)
    own = inside & (np.abs(owner - lens).max(axis=1) < 1e-6)
    if sheet.layout == "lenticular":
        across, along = sheet.to_axes(pixel).T
        slope = sheet.from_axes(np.stack([(owner[:, 0] - across) / sheet.gap, 0 * along], axis=-1))
        level = sheet.from_axes(owner)
        point = sheet.from_axes(np.stack([owner[:, 0], along / sheet.stretch], axis=-1))
    else:
        slope = (owner - pixel) / sheet.gap
        level = point = owner
    viewpoint = slope if math.isinf(sheet.distance) else level + slope * sheet.distance
    return Samples(point, viewpoint, inside & clear & owner_clear, own)


# ---- Mitsuba's cameras ---------------------------------------------------------------------------------------------


def camera_rays(world_from_display, distance, viewpoint, points):
    """Rays of the Mitsuba camera at one viewpoint through ``points`` ``(n, 2)`` of the lens plane."""
    import mitsuba as mi

    def in_world(point):
        return (world_from_display @ [*point, 1.0])[:3]

    unit = float(np.linalg.norm(world_from_display[:3, 0]))
    direction = np.array([0.0, 0.0, -1.0]) if math.isfinite(distance) else np.array([*-viewpoint, -1.0])
    direction /= np.linalg.norm(direction)
    origin = np.array([*viewpoint, distance]) if math.isfinite(distance) else -direction * CAMERA_START
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
    """What the direct cameras see, ``(n, 3)`` each; positions (mm) and normals in the display's frame."""

    hit: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    emission: np.ndarray
    stable: np.ndarray
    cameras: int


def direct_pictures(built, world_from_display, sheet, samples):
    """The direct pictures' samples; one camera for each viewpoint that occurs."""
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
    return Direct(hit[0], position[0], normal[:n], emission[:n], stable, int(group.max()) + 1)


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


def psnr(a, b, peak=1.0):
    return 10 * math.log10(peak**2 / max(float(np.mean(np.square(a - b, dtype=np.float64))), 1e-16))


@dataclass
class Pictures:
    """One integral image for each noise-free shading."""

    position: object
    normal: object
    emission: object
    sheet: Sheet
    subpixels: bool = False
    matrix: np.ndarray = field(init=False)
    depth: float = field(init=False)

    def __post_init__(self):
        self.matrix = self.position.world_from_display
        self.depth = float(np.ptp(self.position.provenance.options["depth_range"]))


def rendered(scene, sheet, subpixels=False, **placement):
    from lippmann.api import render

    common = {"spp": 1, "pixel_filter": "point", "subpixels": subpixels, "place": "fit"} | placement
    display = sheet.display()
    position, normal = (render(scene, display, integrator=name, **common) for name in ("position", "normal"))
    return Pictures(position, normal, render(scene, display, integrator="path", depth=1, **common), sheet, subpixels)


def compare(pictures, built, eye, size=(31, 37)):
    """The replay to an eye against the direct pictures, in dB, with ``error``, the largest one in mm."""
    sheet = pictures.sheet
    seen = {
        kind: getattr(pictures, kind).replay(eye, size=size).reshape(-1, 3) for kind in ("position", "normal", "emission")
    }
    figures = []
    for channel, offset in enumerate(RGB_STRIPE if pictures.subpixels else NO_OFFSET):
        samples = samples_of(sheet, lens_plane_points(sheet, *size), eye, offset)
        direct = direct_pictures(built, pictures.matrix, sheet, samples)
        channels = slice(channel, channel + 1) if pictures.subpixels else slice(0, 3)
        figures.append(agreement(seen, samples, direct, pictures.depth, channels))
    worst = {kind: min(figure[kind] for figure in figures) for kind in ("position", "normal", "emission", "own")}
    return worst | {kind: max(figure[kind] for figure in figures) for kind in ("error", "cameras")}


def agreement(seen, samples, direct, depth, channels):
    usable = samples.clear & direct.stable
    assert samples.clear.mean() > 0.75  # the rest lies past the panel or between lenses
    assert usable[samples.clear].mean() > 0.99  # the rest are edges
    hit = usable & direct.hit
    assert hit[usable].mean() > 0.15
    # Where one sees nothing the other sees nothing.
    assert (seen["position"][usable & ~direct.hit, channels] == 0).all()
    assert (np.abs(seen["position"][hit, channels]).max(axis=1) > 0).all()
    pairs = {kind: (seen[kind][hit, channels], getattr(direct, kind)[hit, channels]) for kind in seen}
    return {
        "position": psnr(*pairs["position"], depth),
        "normal": psnr(*pairs["normal"]),
        "emission": psnr(*pairs["emission"]),
        "error": float(np.abs(np.subtract(*pairs["position"])).max()),
        "own": float(samples.own[samples.clear].mean()),
        "cameras": direct.cameras,
    }


def check(figures, record_property):
    for kind, value in figures.items():
        record_property(kind, value)
    assert min(figures["position"], figures["normal"], figures["emission"]) >= LEAST_PSNR
    assert figures["error"] <= LARGEST_ERROR
