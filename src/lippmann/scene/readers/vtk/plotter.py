"""Plotters of PyVista: what they show, in their colours, by their camera and before their background."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.readers.vtk.data_set import COLORED, Surface, color_table, image_of, mesh_of, surface_of
from lippmann.scene.values.description import Camera, Color, Instance, Material, Mesh, SceneDescription
from lippmann.scene.values.volume import TransferFunction, Volume
from lippmann.scene.volumes.grid import storable

if TYPE_CHECKING:
    import pyvista

#: Name of the plotter's camera in the scene.
CAMERA = "plotter"

#: VTK's numbers of ways to shade.
_FLAT, _PBR = 0, 3

_COLORS = "colours of the plotter"


def from_plotter(plotter: pyvista.Plotter) -> SceneDescription:
    """Surfaces and a volume of a plotter's first renderer, its camera and its background.

    Actors keep their places, colours, colour maps and opacities. Edges, points, text and other annotations are not
    shown; light sources are not taken over.

    Raises
    ------
    SceneError
        The plotter shows no surface and no volume, or several volumes.
    """
    renderer = plotter.renderers[0]
    notes: list[str] = []
    if len(plotter.renderers) > 1:
        notes.append(f"of {len(plotter.renderers)} renderers the first is shown")
    meshes: list[Mesh] = []
    materials: list[Material] = []
    instances: list[Instance] = []
    volumes: list[Volume] = []
    ignored = 0
    for name, actor in renderer.actors.items():
        mapper = getattr(actor, "mapper", None)
        if mapper is not None and mapper.GetInputAlgorithm() is not None:
            mapper.GetInputAlgorithm().Update()  # data are made of others when they are first drawn
        source = getattr(mapper, "dataset", None)
        if source is None or not actor.GetVisibility():
            ignored += 1
            continue
        if actor.IsA("vtkVolume"):
            volumes.append(_volume(actor, source, str(name)))
            continue
        try:
            surface = _surface(mapper, source)
        except SceneError:
            notes.append(f"'{str(name)[:40]}' has no surface, and is not shown")
            continue
        if actor.prop.GetInterpolation() == _FLAT:
            surface = replace(surface, normals=None)
        meshes.append(mesh_of(surface, str(name), len(materials)))
        materials.append(_material(actor.prop, str(name), has_colors=surface.colors is not None))
        instances.append(Instance(len(meshes) - 1, _matrix(actor.GetMatrix())))
    if ignored:
        notes.append(f"{ignored} annotations and hidden objects of the plotter are not shown")
    if len(volumes) > 1:
        raise SceneError(f"the plotter shows {len(volumes)} volumes", rule="one is rendered")
    if not meshes and not volumes:
        raise SceneError("the plotter shows no surface and no volume", rule="there must be something to see")
    notes.append("the plotter's light sources are not taken over")
    return SceneDescription(
        "pyvista",
        meshes,
        materials,
        instances,
        cameras=[_camera(renderer)],
        background=_linear(renderer.background_color.float_rgb),
        notes=notes,
        volume=volumes[0] if volumes else None,
    )


def _surface(mapper: Any, source: Any) -> Surface:
    """The surface of an actor's data, with the colours that its mapper gives them."""
    shown = source.copy(deep=False)
    shown.set_active_scalars(None)
    name = mapper.array_name
    of_cells = mapper.scalar_map_mode == "cell"
    table = source.cell_data if of_cells else source.point_data
    if mapper.scalar_visibility and name in table:
        values = np.asarray(table[name])
        own = shown.cell_data if of_cells else shown.point_data
        own[_COLORS] = _colors(mapper, values)
        shown.set_active_scalars(_COLORS, preference="cell" if of_cells else "point")
    return surface_of(shown)


def _colors(mapper: Any, values: NDArray[np.generic]) -> NDArray[np.uint8]:
    if mapper.color_mode == "direct":
        return np.asarray(values if values.dtype == np.uint8 else np.clip(values, 0, 1) * 255, np.uint8)
    numbers = np.asarray(values, np.float64)
    if numbers.ndim > 1:
        numbers = np.linalg.norm(numbers, axis=1)
    low, high = mapper.scalar_range
    lookup = mapper.lookup_table
    return color_table(numbers, low, high, np.asarray(lookup.values), logarithmic=bool(lookup.log_scale))


def _material(look: Any, name: str, *, has_colors: bool) -> Material:
    opacity = float(look.opacity)
    is_physical = look.GetInterpolation() == _PBR
    # With colours of its own a surface may let light through where they say so.
    blends = opacity < 1.0 or has_colors
    return Material(
        name=name,
        base_color=(1.0, 1.0, 1.0) if has_colors else _linear(look.color.float_rgb),
        alpha=opacity,
        alpha_mode="blend" if blends else "opaque",
        metallic=float(look.metallic) if is_physical else 0.0,
        roughness=float(look.roughness) if is_physical else COLORED.roughness,
        double_sided=True,
        unlit=not look.lighting,
    )


def _volume(actor: Any, source: Any, name: str) -> Volume:
    """A volume with its plotter's colours and opacities, those of the ends beyond them."""
    image = image_of(source) if hasattr(source, "direction_matrix") else None
    if image is None:
        raise SceneError(f"the volume '{name[:40]}' is no image of numbers", rule="images with one scalar are shown")
    grid, matrix = image
    stored, _ = storable(grid)
    look = actor.prop
    color, opacity = look.GetRGBTransferFunction(), look.GetScalarOpacity()
    low, high = color.GetRange()
    if not high > low:
        low, high = float(stored.min()), float(stored.min()) + 1.0
    values = np.linspace(low, high, 256)
    codes = np.array([color.GetColor(value) for value in values])
    alphas = np.clip([opacity.GetValue(value) for value in values], 0.0, 1.0)
    # VTK's opacities count over a length of their own.
    per_unit = 1.0 - (1.0 - np.minimum(alphas, 1.0 - 1e-6)) ** (1.0 / max(look.GetScalarOpacityUnitDistance(), 1e-9))
    shading = 1.0 if look.GetShade() else 0.0
    transfer = TransferFunction(values, decode_srgb(codes), per_unit, "mm", shading, name)
    return Volume(stored, _matrix(actor.GetMatrix()) @ matrix, transfer)


def _camera(renderer: Any) -> Camera:
    """The camera as it is set; else as the plotter would set it when it is shown, around all that it holds."""
    camera = renderer.camera
    eye, focus, up = (np.array(value, float) for value in (camera.position, camera.focal_point, camera.up))
    if not renderer.camera_set:
        start, focus, up = (np.array(value, float) for value in renderer.get_default_cam_pos())
        low, high = np.reshape(renderer.bounds, (3, 2)).T
        toward = (start - focus) / (np.linalg.norm(start - focus) or 1.0)
        radius = float(np.linalg.norm(high - low)) / 2.0
        eye = focus + toward * radius / np.sin(np.radians(camera.view_angle) / 2.0)
    back = eye - focus
    distance = float(np.linalg.norm(back)) or 1.0
    back /= distance
    right = np.cross(up, back)
    right /= np.linalg.norm(right) or 1.0
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(back, right), back, eye
    if camera.parallel_projection:
        return Camera(CAMERA, pose, height=2.0 * float(camera.parallel_scale), focus_distance=distance)
    return Camera(CAMERA, pose, fov_y=float(np.radians(camera.view_angle)), focus_distance=distance)


def _matrix(matrix: Any) -> NDArray[np.float64]:
    return np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])


def _linear(color: tuple[float, ...]) -> Color:
    red, green, blue = decode_srgb(np.array(color[:3], float)).tolist()
    return red, green, blue
