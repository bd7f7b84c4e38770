"""Meshes and scenes of trimesh as plain values.

The library is not imported here: whoever has an object of it has loaded it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lippmann.errors import SceneError
from lippmann.scene.matrices import transform_points
from lippmann.scene.parsing.files import texels_of
from lippmann.scene.parsing.points_lines import thin_to_most
from lippmann.scene.parsing.vertex_colors import COLORED, GREY, linear_colors, material_of
from lippmann.scene.point_clouds import draw_thin
from lippmann.scene.values.description import (
    AlphaMode,
    Camera,
    Color,
    Image,
    Instance,
    Light,
    Material,
    Mesh,
    SceneDescription,
    Texture,
)

if TYPE_CHECKING:
    import trimesh
    from PIL import Image as Pillow

_LIGHT_KINDS: dict[str, Literal["point", "spot", "directional"]] = {
    "PointLight": "point",
    "SpotLight": "spot",
    "DirectionalLight": "directional",
}


def from_trimesh(source: trimesh.Scene | trimesh.parent.Geometry) -> SceneDescription:
    """A ``trimesh.Scene``, ``Trimesh``, ``PointCloud`` or ``Path``: geometry, instances, materials, camera, lights.

    Points become balls, paths rods, in their colours. Vertex normals are taken where the mesh already holds them;
    otherwise its facets are flat. Vertex and face colours are taken as sRGB-coded. A Phong (simple) material becomes a
    rough dielectric of its diffuse colour.

    Raises
    ------
    SceneError
        The scene holds no triangles, points or paths.
    """
    scene = source if hasattr(source, "graph") else source.scene()
    meshes: list[Mesh] = []
    materials: list[Material] = []
    index_of: dict[str, int] = {}
    notes: list[str] = []
    images: dict[int, Image] = {}
    thin: dict[str, Mesh] = {}
    for name, geometry in scene.geometry.items():
        if not hasattr(geometry, "faces") or len(geometry.faces) == 0:
            drawn = None if hasattr(geometry, "faces") else _thin(geometry, str(name), len(materials))
            if drawn is not None:
                thin[name] = drawn
                plain = GREY if drawn.colors is None else COLORED
                materials.append(replace(plain, name=str(name), unlit=drawn.colors is not None))
                continue
            notes.append(f"'{name}' has no faces and is not rendered")
            continue
        index_of[name] = len(meshes)
        mesh, material = _from_trimesh_mesh(geometry, str(name), len(materials), images)
        meshes.append(mesh)
        materials.append(material)
    if not meshes and not thin:
        raise SceneError(
            "the trimesh scene holds no triangles", rule="there must be a mesh with faces, points or a path"
        )
    instances: list[Instance] = []
    placed: list[Mesh] = []
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        if name in index_of:
            instances.append(Instance(index_of[name], np.asarray(matrix, np.float64)))
        elif name in thin:
            places = transform_points(np.asarray(matrix, np.float64), thin[name].positions.astype(np.float64))
            placed.append(replace(thin[name], positions=places.astype(np.float32)))
    for size in (1, 2):  # points, lines
        chosen = [mesh for mesh in placed if mesh.faces.shape[1] == size]
        if chosen:
            thinned, left_out = thin_to_most(chosen)
            solid, width = draw_thin(thinned)
            notes += [*left_out, width.note]
            instances += [Instance(len(meshes) + number, np.eye(4)) for number in range(len(solid))]
            meshes += solid
    cameras = [_from_trimesh_camera(scene)] if scene.has_camera else []
    # Asking for `lights` would invent some where there are none.
    lights = [_from_trimesh_light(scene, light) for light in getattr(scene, "_lights", None) or ()]
    name = str(scene.metadata.get("name") or "trimesh")
    return SceneDescription(name, meshes, materials, instances, lights, cameras, notes=notes)


def _thin(geometry: Any, name: str, material: int) -> Mesh | None:
    """Points, or the straight pieces of a path; None without any."""
    if hasattr(geometry, "entities"):
        every = (np.asarray(entity.discrete(geometry.vertices), np.float64) for entity in geometry.entities)
        lines = [line for line in every if len(line) > 1]
        pieces = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]
        points = np.concatenate(pieces).reshape(-1, lines[0].shape[1]) if pieces else np.zeros((0, 3))
        points, colors = np.pad(points, ((0, 0), (0, 3 - points.shape[1]))), None
    else:
        points, colors = np.asarray(geometry.vertices, np.float64), np.asarray(getattr(geometry, "colors", ()))
        finite = np.isfinite(points).all(axis=1)
        colors = linear_colors(colors[finite])[:, :3] if len(colors) == len(points) else None
        points = points[finite]
    places = np.arange(len(points), dtype=np.uint32).reshape(-1, 2 if hasattr(geometry, "entities") else 1)
    return Mesh(name, points.astype(np.float32), places, material, colors=colors) if len(points) else None


def _from_trimesh_mesh(
    geometry: trimesh.Trimesh, name: str, material: int, images: dict[int, Image]
) -> tuple[Mesh, Material]:
    positions = np.asarray(geometry.vertices, np.float64)
    faces = np.asarray(geometry.faces)
    visual = geometry.visual
    kind = getattr(visual, "kind", None)
    normals = np.asarray(geometry.vertex_normals) if "vertex_normals" in geometry._cache else None
    uvs: tuple[NDArray[np.float32], ...] = ()
    colors = None
    surface = GREY
    if kind == "texture":
        if visual.uv is not None and len(visual.uv) == len(positions):
            uvs = ((np.asarray(visual.uv)[:, :2] * (1.0, -1.0) + (0.0, 1.0)).astype(np.float32),)  # v runs upwards
        surface = _from_trimesh_material(visual.material, images)
    elif kind == "vertex":
        colors, surface = linear_colors(visual.vertex_colors), material_of(visual.vertex_colors)
    elif kind == "face":
        corners = faces.ravel()
        positions, normals = positions[corners], None if normals is None else normals[corners]
        colors, surface = np.repeat(linear_colors(visual.face_colors), 3, axis=0), material_of(visual.face_colors)
        faces = np.arange(len(corners)).reshape(-1, 3)
    mesh = Mesh(
        name=name,
        positions=positions.astype(np.float32),
        faces=faces.astype(np.uint32),
        material=material,
        normals=None if normals is None else normals.astype(np.float32),
        uvs=uvs,
        colors=colors,
    )
    return mesh, surface


def _from_trimesh_material(material: trimesh.visual.material.Material, images: dict[int, Image]) -> Material:
    if hasattr(material, "materials"):  # several in one mesh: trimesh itself falls back to the first
        material = material.materials[0] if len(material.materials) else None
    if material is None:
        return GREY

    def texture(picture: Pillow.Image | None, *, srgb: bool) -> Texture | None:
        if picture is None:
            return None
        if id(picture) not in images:
            images[id(picture)] = Image(str(material.name), texels_of(picture))
        return Texture(images[id(picture)], srgb=srgb)

    if hasattr(material, "glossiness"):
        return _from_phong(material, texture(material.image, srgb=True))
    factor = _fraction(material.baseColorFactor, (255, 255, 255, 255))
    emission = (0.0, 0.0, 0.0) if material.emissiveFactor is None else _color(material.emissiveFactor)
    if material.emissiveTexture is not None and material.emissiveFactor is None:
        emission = (1.0, 1.0, 1.0)
    modes: dict[str | None, AlphaMode] = {"MASK": "mask", "BLEND": "blend"}
    return Material(
        name=str(material.name or ""),
        base_color=_color(factor),
        base_color_texture=texture(material.baseColorTexture, srgb=True),
        alpha=float(factor[3]),
        alpha_mode=modes.get(material.alphaMode, "opaque"),
        alpha_cutoff=0.5 if material.alphaCutoff is None else material.alphaCutoff,
        # glTF's own defaults, whose terms the class says it uses
        metallic=1.0 if material.metallicFactor is None else material.metallicFactor,
        roughness=1.0 if material.roughnessFactor is None else material.roughnessFactor,
        metallic_roughness_texture=texture(material.metallicRoughnessTexture, srgb=False),
        normal_texture=texture(material.normalTexture, srgb=False),
        emission=emission,
        emission_texture=texture(material.emissiveTexture, srgb=True),
        double_sided=bool(material.doubleSided),
    )


def _from_phong(material: trimesh.visual.material.SimpleMaterial, texture: Texture | None) -> Material:
    factor = _fraction(material.diffuse, (255, 255, 255, 255))
    unset = bool((np.asarray(material.diffuse) == np.array([102, 102, 102, 255])).all())
    pbr = material.to_pbr()
    return Material(
        name=str(material.name or ""),
        # trimesh puts its own grey where a textured material gives no diffuse colour
        base_color=(1.0, 1.0, 1.0) if texture is not None and unset else _color(factor),
        base_color_texture=texture,
        alpha=float(factor[3]),
        alpha_mode="blend" if factor[3] < 1.0 else "opaque",
        roughness=float(min(max(pbr.roughnessFactor, 0.0), 1.0)),
        double_sided=True,
    )


def _from_trimesh_camera(scene: trimesh.Scene) -> Camera:
    fov_x, fov_y = (float(angle) for angle in np.radians(scene.camera.fov))
    return Camera(
        name=str(scene.camera.name or "camera"),
        world_from_camera=np.array(scene.camera_transform, np.float64),
        fov_y=fov_y,
        aspect=float(np.tan(fov_x / 2.0) / np.tan(fov_y / 2.0)),
    )


def _from_trimesh_light(scene: trimesh.Scene, light: trimesh.scene.lighting.Light) -> Light:
    intensity = 1.0 if light.intensity is None else float(light.intensity)
    red, green, blue = (float(value) * intensity for value in _fraction(light.color, (255, 255, 255, 255))[:3])
    return Light(
        kind=_LIGHT_KINDS[type(light).__name__],
        color=(red, green, blue),
        world_from_light=np.asarray(scene.graph[light.name][0], np.float64),
        inner_angle=float(getattr(light, "innerConeAngle", 0.0)),
        outer_angle=float(getattr(light, "outerConeAngle", np.pi / 4)),
        name=str(light.name),
    )


def adapter_for(source: object) -> Callable[[Any], SceneDescription] | None:
    """The function that reads an object of trimesh's; None for one that is no scene."""
    is_scene = any(hasattr(source, name) for name in ("graph", "faces", "entities"))
    return from_trimesh if is_scene or type(source).__name__ == "PointCloud" else None


def _fraction(color: ArrayLike | None, default: tuple[int, ...]) -> NDArray[np.float64]:
    return np.asarray(default if color is None else color, np.float64) / 255.0


def _color(values: ArrayLike) -> Color:
    red, green, blue = np.asarray(values, np.float64)[:3].tolist()
    return red, green, blue
