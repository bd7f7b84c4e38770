"""Classic scenes in the terms of physically based light: what the integrator ``path`` renders of them.

``docs/reference/whitted.md`` holds the mapping in words. Colours and pictures of classic scenes are display codes; they
are taken for sRGB, so that the physical picture, coded by that curve, looks alike; light adds up as numbers, so its
colours stay. Light sources get a radius and inverse-square falloff; in the middle of the scene they are as bright as
before.
Round shapes become fine meshes, endless ones large ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import pi, radians

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.scene.values.description import (
    Camera,
    Color,
    Environment,
    Image,
    Instance,
    Light,
    Material,
    Mesh,
    SceneDescription,
    Texture,
)
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import ClassicLight, ClassicMaterial
from lippmann.scene.whitted.tessellation import Patch, patches
from lippmann.scene.whitted.world_frame import world_bounds, world_from_scene

Numbers = NDArray[np.float64]

#: Radius of light sources that have none, as a fraction of their distance from the middle of the scene.
_LIGHT_RADIUS = 0.02
#: Highlights of this exponent and above count as a polish without blur.
_SHARP = 10000.0
_LEAST_ROUGHNESS = 0.03
_SKY_ROWS = 128


def to_physical(scene: ClassicScene, cameras: Sequence[Camera] = ()) -> SceneDescription:
    """The physical form of a classic scene, in the right-handed world."""
    bounds = _extent(scene)
    has_end = any(batch.bounds() is not None for batch in scene.batches())
    middle = (world_bounds(scene, world_from_scene(scene)) if has_end else bounds).mean(axis=0)
    meshes: list[Mesh] = []
    materials: list[Material] = []
    indices: dict[tuple[int, str], int] = {}
    images = [_ImageSource(image.name, image.texels) for image in scene.images]
    notes = list(scene.notes)
    for patch in patches(scene, bounds):
        source = scene.materials[patch.material]
        key = patch.material, patch.kind
        if key not in indices:
            indices[key] = len(materials)
            materials.append(_material(source, patch, images, scene.rules == "nff"))
        meshes.append(_mesh(patch, indices[key], world_from_scene(scene)))
    notes += _remarks(scene)
    return SceneDescription(
        name=scene.name,
        meshes=meshes,
        materials=materials,
        instances=[Instance(number, np.eye(4)) for number in range(len(meshes))],
        lights=[_convert_light(light, scene, middle) for light in scene.lights if max(light.color) > 0],
        cameras=tuple(cameras),
        environment=_surroundings(scene),
        background=_linear(scene.background.color) if scene.background.kind == "solid" else None,
        notes=tuple(notes),
    )


@dataclass(frozen=True, eq=False)
class _ImageSource:
    """A classic image as an :class:`Image`, and its mean colour."""

    name: str
    texels: NDArray[np.uint8]

    @property
    def image(self) -> Image:
        return Image(self.name, self.texels[0])

    @property
    def mean(self) -> Color:
        r, g, b = self.texels.reshape(-1, 3).mean(axis=0) / 255.0
        return float(r), float(g), float(b)


def _extent(scene: ClassicScene) -> Numbers:
    """Box around the scene, its camera and its light sources, in the file's own coordinates."""
    points = [np.array(scene.camera.center), *(np.array(light.center) for light in scene.lights)]
    if any(batch.bounds() is not None for batch in scene.batches()):
        points += list(world_bounds(scene, world_from_scene(scene)))
    return np.stack([np.min(points, axis=0), np.max(points, axis=0)])


def _linear(code: Sequence[float]) -> Color:
    """Linear colour of display codes, by the sRGB curve."""
    r, g, b = decode_srgb(np.maximum(code, 0.0))
    return float(r), float(g), float(b)


def _scale(color: Color, factor: float) -> Color:
    r, g, b = (min(factor * c, 1.0) for c in color)
    return r, g, b


def _material(source: ClassicMaterial, patch: Patch, images: Sequence[_ImageSource], refracts: bool) -> Material:
    texture, code = None, source.color
    if source.texture.image is not None:
        picture = images[source.texture.image]
        code = picture.mean
        if patch.uvs is not None:
            texture, code = Texture(picture.image, srgb=True), (1.0, 1.0, 1.0)
    elif source.texture.kind != "constant":
        code = _MEAN_COLORS.get(source.texture.kind, source.color)
    if patch.colors is not None:
        code = (1.0, 1.0, 1.0)
    color = _linear(code)
    diffuse, mirror = max(source.diffuse, 0.0), min(max(source.specular, 0.0), 1.0)
    glows = source.ambient > source.diffuse
    whole = diffuse + mirror
    opaque = Material(
        base_color=_scale(color, whole),
        base_color_texture=texture if whole > 0 else None,
        metallic=mirror / whole if whole > 0 else 0.0,
        roughness=0.0 if mirror > 0 else _roughness(source),
        specular=1.0 if source.phong > 0 or mirror > 0 else 0.0,
        emission=_scale(color, source.ambient) if glows else (0.0, 0.0, 0.0),
        emission_texture=texture if glows else None,
        double_sided=True,
    )
    if source.opacity >= 1.0:
        return opaque
    if refracts and source.ior > 1.0:
        return replace(
            opaque,
            ior=source.ior,
            transmission=1.0 - source.opacity,
            thickness=1.0,
            roughness=0.0,
            metallic=0.0,
            specular=1.0,
        )
    return replace(opaque, alpha=max(source.opacity, 0.0), alpha_mode="blend")


#: Mean colours of procedural textures, as display codes.
_MEAN_COLORS: dict[str, Color] = {
    "checker": (0.5, 0.2, 0.5),
    "cylindrical-checker": (0.5, 0.2, 0.5),
    "wood": (0.53, 0.67, 0.13),
    "marble": (0.5, 0.5, 0.5),
}


def _roughness(source: ClassicMaterial) -> float:
    """glTF roughness, sqrt(alpha), of a highlight of exponent n: alpha = sqrt(2 / (n + 2)) (Walter et al. 2007)."""
    if source.phong <= 0 or source.phong_size >= _SHARP:
        return 1.0 if source.phong <= 0 else _LEAST_ROUGHNESS
    return float(max((2.0 / (source.phong_size + 2.0)) ** 0.25, _LEAST_ROUGHNESS))


def _mesh(patch: Patch, material: int, matrix: Numbers) -> Mesh:
    turn = matrix[:3, :3]
    mirrored = np.linalg.det(turn) < 0
    faces = patch.faces[:, ::-1] if mirrored else patch.faces
    colors = None
    if patch.colors is not None:
        colors = decode_srgb(np.maximum(patch.colors, 0.0)).astype(np.float32)
    return Mesh(
        name=patch.kind,
        positions=(patch.positions @ turn.T).astype(np.float32),
        faces=np.ascontiguousarray(faces, dtype=np.uint32),
        material=material,
        normals=None if patch.normals is None else (patch.normals @ turn.T).astype(np.float32),
        uvs=() if patch.uvs is None else (patch.uvs.astype(np.float32),),
        colors=colors,
    )


def _convert_light(light: ClassicLight, scene: ClassicScene, middle: Numbers) -> Light:
    """The physical light that illuminates a surface in the middle of the scene as the classic model does."""
    scale = scene.shading.light_scale
    matrix = np.eye(4)
    matrix[:3, :3] = _looking_along(world_from_scene(scene)[:3, :3] @ np.array(light.direction))
    matrix[:3, 3] = world_from_scene(scene)[:3, :3] @ np.array(light.center)
    color = light.color
    if light.kind == "directional":
        return Light("directional", _times(color, pi * scale), matrix)
    distance = max(float(np.linalg.norm(np.array(light.center) - middle)), 1e-6)
    c, q1, q2 = light.attenuation or (1.0, 0.0, 0.0)
    intensity = pi * scale * distance**2 / (c + (q1 + q2 * distance) * distance)
    radius = max(light.radius, _LIGHT_RADIUS * distance)
    if light.kind == "point":
        return Light("point", _times(color, intensity), matrix, radius=radius)
    outer = min(radians(light.falloff_end), pi / 2)
    inner = min(radians(light.falloff_start), 0.999 * outer)
    return Light("spot", _times(color, intensity), matrix, inner_angle=inner, outer_angle=outer, radius=radius)


def _times(color: Color, factor: float) -> Color:
    r, g, b = color
    return r * factor, g * factor, b * factor


def _looking_along(direction: Numbers) -> Numbers:
    """A rotation whose -z runs along ``direction``."""
    back = -direction / np.linalg.norm(direction)
    aside = np.cross((0.0, 1.0, 0.0) if abs(back[1]) < 0.9 else (1.0, 0.0, 0.0), back)
    aside /= np.linalg.norm(aside)
    return np.stack([aside, np.cross(back, aside), back], axis=1)


def _surroundings(scene: ClassicScene) -> Environment | None:
    """Light from all around in place of the ambient terms; where the background is a gradient, that gradient."""
    if scene.background.kind == "sky-sphere":
        return Environment(_gradient(scene), name="background gradient")
    shares = [m.ambient / m.diffuse for m in scene.materials if 0 < m.ambient <= m.diffuse]
    if not shares:
        return None
    return Environment(np.full((2, 4, 3), np.median(shares), np.float32), name="ambient light")


def _gradient(scene: ClassicScene) -> NDArray[np.float32]:
    """The background as an equirectangular picture, row 0 at +y, with the world's axes."""
    sky = scene.background
    theta = (np.arange(_SKY_ROWS) + 0.5) / _SKY_ROWS * pi
    phi = (np.arange(2 * _SKY_ROWS) + 0.5) / _SKY_ROWS * pi - pi  # the middle column lies at -z, +x to its right
    x = np.sin(theta)[:, None] * np.sin(phi)[None]
    y = np.broadcast_to(np.cos(theta)[:, None], x.shape)
    z = -np.sin(theta)[:, None] * np.cos(phi)[None]
    up = world_from_scene(scene)[:3, :3] @ np.array(sky.up)
    along = x * up[0] + y * up[1] + z * up[2]
    share = np.clip((along - sky.bottom_value) / (sky.top_value - sky.bottom_value), 0.0, 1.0)[..., None]
    top, bottom = np.array(_linear(sky.top_color)), np.array(_linear(sky.bottom_color))
    return np.asarray(share * top + (1.0 - share) * bottom, np.float32)


def _remarks(scene: ClassicScene) -> Iterator[str]:
    """Features that the physical form ignores, one line each."""
    kinds = sorted({m.texture.kind for m in scene.materials} - {"constant", "planar-image"})
    if kinds:
        yield f"textures of kind {', '.join(kinds)} show their mean colour in physically based light"
    if scene.fog is not None:
        yield "fog is left out of physically based light"
    if scene.clip_groups:
        yield "clip groups cut whole triangles in physically based light"
    if scene.background.kind == "sky-plane":
        yield "the background gradient over a plane is left out of physically based light"
    if scene.ambient_occlusion is not None:
        yield "sky light is left out: the surroundings shed light by themselves"
