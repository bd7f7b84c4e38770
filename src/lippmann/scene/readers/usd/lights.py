"""Light sources of a stage (UsdLux): lights without extent, glowing surfaces, and the surroundings.

UsdLux gives radiance: ``color * intensity * 2^exposure``, divided by the emitting area where ``normalize`` is set.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.readers.gltf.nodes import rigid
from lippmann.scene.readers.usd.assets import Assets
from lippmann.scene.readers.usd.records import Record
from lippmann.scene.reflectance import surface_area
from lippmann.scene.values.description import Camera, Color, Environment, Light, Material, Matrix, Mesh, Texture

_AROUND = 64
#: Half an angle of a distant light beyond which its sharp shadows are worth a note, degrees.
_WIDE = 1.0
#: A focal length or aperture is given in tenths of a scene unit.
_TENTH = 0.1

# In a stage the middle of a picture of the surroundings lies at +z and its columns run to -x (as OpenEXR has it).
_HALF_TURN = np.diag([-1.0, 1.0, -1.0, 1.0])
# A dome whose pole is the stage's z: its own y axis.
_Y_TO_Z = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class GlowingMesh:
    """A surface that is a light source, at its place in the world."""

    mesh: Mesh
    material: Material
    world: Matrix


@dataclass(eq=False)
class LightReader:
    """Makes light sources of records.

    Attributes
    ----------
    scene_from_stage:
        Turns a stage upright and brings it to metres.
    up:
        The stage's own up axis.
    """

    scene_from_stage: Matrix
    up: str
    assets: Assets
    notes: dict[str, None]
    lights: list[Light] = field(default_factory=list)
    meshes: list[GlowingMesh] = field(default_factory=list)
    environment: Environment | None = None

    def add(self, record: Record) -> None:
        """Take over one record.

        Raises
        ------
        SceneError
            A texture is damaged.
        """
        kind = record["kind"]
        if kind is None:
            return
        world = _world(record, self.scene_from_stage)
        if kind.startswith("DomeLight"):
            self._add_dome(record, world)
        elif kind == "DistantLight":
            self._add_distant(record, world)
        elif kind == "SphereLight":
            self._add_sphere(record, world)
        else:
            self._add_surface(record, world)

    def _add_distant(self, record: Record, world: Matrix) -> None:
        half = math.radians(min(max(record["angle"], 0.0), 360.0)) / 2.0
        solid = math.pi * math.sin(min(half, math.pi / 2.0)) ** 2
        if math.degrees(half) > _WIDE:
            self.notes[f"{record['name']}: a distant light's angle is not drawn: its shadows are sharp"] = None
        irradiance = 1.0 if record["normalize"] or half == 0.0 else solid
        self.lights.append(Light("directional", _times(record, irradiance), rigid(world), name=record["name"]))

    def _add_sphere(self, record: Record, world: Matrix) -> None:
        scale = float(np.cbrt(abs(np.linalg.det(world[:3, :3]))))
        radius = max(record["radius"], 0.0)
        # A sphere's intensity in any direction is its radiance times the area of its shadow.
        area = math.pi * radius**2
        if record["normalize"]:
            area = 0.25
        elif not record["is_point"]:
            area *= scale**2
        is_spot = record["cone"] < 90.0
        outer = math.radians(min(max(record["cone"], 0.1), 90.0))
        softness = min(max(record["softness"], 0.0), 1.0)
        self.lights.append(
            Light(
                "spot" if is_spot else "point",
                _times(record, area),
                rigid(world),
                inner_angle=outer * (1.0 - softness),
                outer_angle=outer,
                radius=0.0 if record["is_point"] else radius * scale,
                name=record["name"],
            )
        )

    def _add_surface(self, record: Record, world: Matrix) -> None:
        shape, area = _surface(record, world)
        if shape is None:
            self.notes[f"{record['name']}: a light source without area is left out"] = None
            return
        if record["cone"] < 90.0:
            self.notes[f"{record['name']}: the cone of an area light is not honoured"] = None
        texture = None
        if "texture" in record and record["kind"] == "RectLight":
            image = self.assets.image(record["texture"])
            texture = None if image is None else Texture(image, srgb=True, wrap_u="clamp", wrap_v="clamp")
        material = Material(
            record["name"],
            base_color=(0.0, 0.0, 0.0),
            specular=0.0,
            emission=_times(record, 1.0 / area if record["normalize"] else 1.0),
            emission_texture=texture,
        )
        self.meshes.append(GlowingMesh(shape, material, world))

    def add_mesh(self, record: Record, parts: Sequence[tuple[Mesh, Material]], worlds: Matrix) -> None:
        """A mesh that is a light source (MeshLightAPI), at ``worlds`` ``(k, 4, 4)``; ``parts`` have materials.

        Its surface is seen as bright as it shines. Where its material glows, the light's colour tints that.
        """
        light = record["light"]
        for world in worlds:
            area = sum(surface_area(mesh.positions @ world[:3, :3].T, mesh.faces) for mesh, _ in parts)
            color = _times(light, 1.0 / area if light["normalize"] and area > 0.0 else 1.0)
            for mesh, material in parts:
                glow, texture = color, None
                if light["material"] == "materialGlowTintsLight" and any(material.emission):
                    red, green, blue = (np.array(material.emission) * color).tolist()
                    glow, texture = (red, green, blue), material.emission_texture
                shown = replace(material, name=record["name"], emission=glow, emission_texture=texture)
                if light["material"] == "noMaterialResponse":
                    shown = Material(record["name"], base_color=(0.0, 0.0, 0.0), specular=0.0, emission=glow)
                self.meshes.append(GlowingMesh(mesh, shown, world))

    def _add_dome(self, record: Record, world: Matrix) -> None:
        if self.environment is not None:
            self.notes[f"{record['name']}: of several dome lights the first is taken"] = None
            return
        color = _times(record, 1.0)
        if record["format"] not in ("automatic", "latlong"):
            self.notes[f"{record['name']}: pictures of the format '{record['format']}' are not read"] = None
            pixels = np.ones((2, 4, 3), np.float32)
        elif "texture" in record:
            pixels = self.assets.environment(record["texture"])
        else:
            pixels = np.ones((2, 4, 3), np.float32)
        stands_on_z = record["pole"] == "Z" or (record["pole"] == "scene" and self.up == "Z")
        turn = rigid(world @ (_Y_TO_Z if stands_on_z else np.eye(4)))
        turn[:3, 3] = 0.0
        self.environment = Environment(
            np.asarray(pixels * np.array(color, np.float32), np.float32), turn @ _HALF_TURN, record["name"]
        )


def _world(record: Record, scene_from_stage: Matrix) -> Matrix:
    """A record's place in the scene; numbers of damaged files need not be finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(scene_from_stage @ np.array(record["world"], np.float64).reshape(4, 4), np.float64)


def camera_of(record: Record, scene_from_stage: Matrix) -> Camera | None:
    """A camera; None of one without extent."""
    world = _world(record, scene_from_stage)
    width, height, focal = record["width"], record["height"], record["focal_length"]
    unit = float(np.cbrt(np.linalg.det(scene_from_stage[:3, :3])))
    focus = record["focus_distance"] * unit
    sizes = np.array([width, height, focal, *record["offsets"]])
    if not (np.isfinite(sizes).all() and np.isfinite(world).all() and min(width, height) > 0.0 and focal > 0.0):
        return None
    camera = Camera(
        record["name"],
        rigid(world),
        aspect=width / height,
        focus_distance=focus if np.isfinite(focus) and focus > 0.0 else None,
        exposure=record["exposure"],
    )
    right, up = record["offsets"]
    if record["is_perspective"]:
        angle = 2.0 * math.atan2(height, 2.0 * focal)
        return replace(camera, fov_y=angle, shift=(right / focal, up / focal))
    tenth = _TENTH * unit
    return replace(camera, height=tenth * height, shift=(tenth * right, tenth * up))


def _times(record: Record, factor: float) -> Color:
    red, green, blue = (max(channel * record["strength"] * factor, 0.0) for channel in record["color"])
    return (red, green, blue)


def _surface(record: Record, world: Matrix) -> tuple[Mesh | None, float]:
    """The triangles of a rectangle, disk or cylinder, and their area in the world."""
    kind, name = record["kind"], record["name"]
    if kind == "RectLight":
        x, y = record["width"] / 2.0, record["height"] / 2.0
        # It shines along -z: counter-clockwise as seen from there. Its picture is upright as seen from there, too.
        points = np.array([[-x, -y, 0.0], [-x, y, 0.0], [x, y, 0.0], [x, -y, 0.0]])
        uvs = np.array([[1.0, 1.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]], np.float32)
        faces = np.array([[0, 1, 2], [0, 2, 3]])
        return _mesh(name, points, faces, world, uvs)
    angles = np.arange(_AROUND) * (2.0 * np.pi / _AROUND)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1) * record["radius"]
    here = np.arange(_AROUND)
    after = (here + 1) % _AROUND
    if kind == "DiskLight":
        points = np.concatenate([np.zeros((1, 3)), np.pad(ring, ((0, 0), (0, 1)))])
        return _mesh(name, points, np.stack([np.zeros(_AROUND, int), after + 1, here + 1], axis=1), world)
    half = record["length"] / 2.0
    points = np.concatenate([np.insert(ring, 0, side, axis=1) for side in (-half, half)])
    quads = np.stack([here, after, after + _AROUND, here + _AROUND], axis=1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return _mesh(name, points, faces, world)


def _mesh(
    name: str,
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
    world: Matrix,
    uvs: NDArray[np.float32] | None = None,
) -> tuple[Mesh | None, float]:
    area = surface_area(points @ world[:3, :3].T, faces)
    if not np.isfinite(area) or area <= 0.0:
        return None, 0.0
    sets = () if uvs is None else (uvs,)
    return Mesh(name, points.astype(np.float32), faces.astype(np.uint32), 0, uvs=sets), area
