"""Plotters of PyVista: what they show, in their colours, by their camera and before their background."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.parsing.points_lines import POINTS_NOTE, Width
from lippmann.scene.parsing.vertex_colors import COLORED
from lippmann.scene.point_clouds import draw_thin
from lippmann.scene.readers.vtk.data_set import Surface, image_of, is_thin, mesh_of, surface_of
from lippmann.scene.values.description import (
    Camera,
    Color,
    Image,
    Instance,
    Material,
    Mesh,
    SceneDescription,
    Texture,
    Wrap,
)
from lippmann.scene.values.volume import TransferFunction, Volume
from lippmann.scene.volumes.grid import storable

if TYPE_CHECKING:
    import pyvista

#: Name of the plotter's camera in the scene.
CAMERA = "plotter"

#: VTK's numbers of ways to shade, to draw, and to composite volumes.
_FLAT, _PBR = 0, 3
_SURFACE = 2
_COMPOSITE = 0

_COLORS = "colours of the plotter"


def from_plotter(plotter: pyvista.Plotter) -> SceneDescription:
    """Surfaces and a volume of a plotter's first renderer, its camera and its background.

    Actors and the blocks of composite ones keep their places, colours, colour maps, textures and opacities. Edges,
    points, text and other annotations are not shown; light sources are not taken over.

    Raises
    ------
    SceneError
        The plotter shows no surface and no volume, or several volumes.
    """
    renderer = plotter.renderers[0]
    camera = _camera(renderer, plotter.window_size)
    height = camera.height or 2.0 * np.tan((camera.fov_y or 0.0) / 2.0) * (camera.focus_distance or 0.0)
    scene = _Plotted(float(height) / plotter.window_size[1])
    if len(plotter.renderers) > 1:
        scene.notes.append(f"of {len(plotter.renderers)} renderers the first is shown")
    ignored = 0
    for name, actor in renderer.actors.items():
        mapper = getattr(actor, "mapper", None)
        if mapper is not None and mapper.GetInputAlgorithm() is not None:
            mapper.GetInputAlgorithm().Update()  # data are made of others when they are first drawn
        if getattr(mapper, "dataset", None) is None or not actor.GetVisibility():
            ignored += 1
        else:
            scene.add(actor, str(name).partition("(Addr=")[0])
    if ignored:
        scene.notes.append(f"{ignored} annotations and hidden objects of the plotter are not shown")
    if len(scene.volumes) > 1:
        raise SceneError(f"the plotter shows {len(scene.volumes)} volumes", rule="one is rendered")
    if not scene.meshes and not scene.volumes:
        raise SceneError("the plotter shows no surface and no volume", rule="there must be something to see")
    if renderer.GetGradientBackground() or renderer.GetTexturedBackground():
        scene.notes.append("the plotter's background is shown in one colour")
    scene.notes.append("the plotter's light sources are not taken over")
    return SceneDescription(
        "pyvista",
        scene.meshes,
        scene.materials,
        scene.instances,
        cameras=[camera],
        background=_linear(renderer.background_color.float_rgb),
        notes=scene.notes,
        volume=scene.volumes[0] if scene.volumes else None,
    )


@dataclass(eq=False)
class _Plotted:
    """What is read of a plotter's actors; ``pixel`` is the side of a pixel at the focus of its camera."""

    pixel: float
    meshes: list[Mesh] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    volumes: list[Volume] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, actor: Any, title: str) -> None:
        """Read a volume, or the surfaces of an actor."""
        features = _left_out(actor, actor.mapper)
        if features:
            self.notes.append(f"'{title[:40]}': {', '.join(features)}: not taken over")
        source = actor.mapper.dataset
        if actor.IsA("vtkVolume"):
            self.volumes.append(_volume(actor, source, title))
            return
        for block in _blocks(actor.mapper, source, title):
            self._add_surface(actor, block)

    def _add_surface(self, actor: Any, block: _Block) -> None:
        try:
            surface, texture, is_mapped = _surface(actor.mapper, block, actor)
        except SceneError:
            self.notes.append(f"'{block.name[:40]}' has no surface, and is not shown")
            return
        self.notes += [f"'{block.name[:40]}': {note}" for note in surface.notes]
        if actor.prop.GetInterpolation() == _FLAT:
            surface = replace(surface, normals=None)
        meshes = [mesh_of(surface, block.name, len(self.materials))]
        material = _material(actor.prop, block, texture, is_mapped=is_mapped)
        if surface.faces.shape[1] < 3:
            width = self._width(actor.prop, is_line=surface.faces.shape[1] == 2)
            material = replace(material, unlit=width is None)
            meshes, width = draw_thin(meshes, width)
            self.notes.append(f"'{block.name[:40]}': {width.note}")
        self.materials.append(material)
        matrix = _matrix(actor.GetMatrix())
        self.instances += [Instance(len(self.meshes) + number, matrix) for number in range(len(meshes))]
        self.meshes += meshes

    def _width(self, prop: Any, *, is_line: bool) -> Width | None:
        """The width of points that are to be spheres, or of lines that are to be tubes; None of others."""
        solid = prop.GetRenderLinesAsTubes() if is_line else prop.GetRenderPointsAsSpheres()
        size = prop.GetLineWidth() if is_line else prop.GetPointSize()
        what = "lines are drawn as rods" if is_line else POINTS_NOTE
        return Width(size * self.pixel / 2.0, f"{what}, as wide as the plotter's at its focus") if solid else None


def _left_out(actor: Any, mapper: Any) -> list[str]:
    """Features of an actor that change its picture in the plotter and are not shown here."""
    features = []
    if mapper.GetClippingPlanes() is not None and mapper.GetClippingPlanes().GetNumberOfItems():
        features.append("clipping planes")
    if actor.IsA("vtkVolume"):
        if mapper.GetCropping():
            features.append("cropping")
        if mapper.GetBlendMode() != _COMPOSITE:
            features.append("its way of blending")
        return features
    prop = actor.prop
    if prop.GetRepresentation() != _SURFACE and not is_thin(mapper.dataset):
        features.append("lines or points in place of the surface")
    elif prop.GetEdgeVisibility():
        features.append("edges")
    if prop.GetBackfaceCulling() or prop.GetFrontfaceCulling():
        features.append("culling")
    if actor.GetBackfaceProperty() is not None:
        features.append("the look of its back")
    return features


@dataclass(frozen=True, eq=False)
class _Block:
    """Data that an actor draws: all of it, or a block with a colour and an opacity of its own, if it has any."""

    name: str
    data: Any
    color: tuple[float, float, float] | None = None
    opacity: float | None = None


def _blocks(mapper: Any, source: Any, name: str) -> Iterator[_Block]:
    """The data of an actor: of a composite one the visible leaves, with the attributes of the groups around them."""
    if not source.IsA("vtkCompositeDataSet"):
        yield _Block(name, source)
        return
    attributes = mapper.GetCompositeDataDisplayAttributes()

    def leaves(group: _Block) -> Iterator[_Block]:
        for number, data in enumerate(group.data):
            is_empty = data is None or not (data.IsA("vtkCompositeDataSet") or data.n_points)
            if is_empty or (attributes.HasBlockVisibility(data) and not attributes.GetBlockVisibility(data)):
                continue
            block = replace(group, name=f"{group.name}/{group.data.get_block_name(number) or number}", data=data)
            if attributes.HasBlockColor(data):
                color = [0.0, 0.0, 0.0]
                attributes.GetBlockColor(data, color)
                block = replace(block, color=(color[0], color[1], color[2]))
            if attributes.HasBlockOpacity(data):
                block = replace(block, opacity=float(attributes.GetBlockOpacity(data)))
            if data.IsA("vtkCompositeDataSet"):
                yield from leaves(block)
            else:
                yield block

    yield from leaves(_Block(name, source))


def _surface(mapper: Any, block: _Block, actor: Any) -> tuple[Surface, Texture | None, bool]:
    """The surface of an actor's data, its texture, and whether its colours are those of scalars."""
    data = block.data.copy(deep=False)
    texture = None
    if mapper.GetScalarVisibility() and block.color is None:
        texture = _map_scalars(mapper, data)
    else:
        data.set_active_scalars(None)
    surface = surface_of(data)
    is_mapped = texture is not None or surface.colors is not None
    return surface, texture if is_mapped else _texture(actor.GetTexture()), is_mapped


def _map_scalars(mapper: Any, data: Any) -> Texture | None:
    """Give data the colours that VTK's own mapper has for their scalars, or coordinates in the texture returned.

    Numbers at points are looked up in each pixel, by a texture of the colour map, with a row for what is no number.
    """
    of_cells = mapper.scalar_map_mode == "cell"
    name = getattr(mapper, "array_name", None)
    if name:
        data.set_active_scalars(name, preference="cell" if of_cells else "point")
    mapper.Modified()  # else it may return the colours of other data
    mapped = mapper.MapScalars(data, 1.0)
    coordinates, picture = mapper.GetColorCoordinates(), mapper.GetColorTextureMap()
    data.set_active_scalars(None)
    if mapped is not None:
        (data.cell_data if of_cells else data.point_data)[_COLORS] = _values(mapped)
        data.set_active_scalars(_COLORS, preference="cell" if of_cells else "point")
    elif coordinates is not None and picture is not None:
        # Where all scalars are one, VTK divides by the range: the texture has one colour then, but for its ends.
        places = np.nan_to_num(_values(coordinates), nan=0.5, posinf=1.0, neginf=0.0)
        data.point_data.active_texture_coordinates = places
        return Texture(_texels(picture), srgb=True, wrap_u="clamp", wrap_v="clamp", filter="nearest")
    return None


def _texture(texture: Any) -> Texture | None:
    if texture is None or texture.GetInput() is None:
        return None
    wrap: Wrap = "repeat" if texture.GetRepeat() else "clamp"
    smooth = bool(texture.GetInterpolate())
    return Texture(_texels(texture.GetInput()), True, wrap, wrap, "linear" if smooth else "nearest")


def _texels(picture: Any) -> Image:
    """A picture of VTK's, whose rows begin at the bottom."""
    width, height, _ = picture.GetDimensions()
    values = _values(picture.GetPointData().GetScalars())
    pixels = np.asarray(values, np.uint8).reshape(height, width, -1)[::-1]
    return Image("plotter", np.ascontiguousarray(pixels))


def _values(array: Any) -> NDArray[np.generic]:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return np.array(vtk_to_numpy(array))


def _material(prop: Any, block: _Block, texture: Texture | None, *, is_mapped: bool) -> Material:
    opacity = float(prop.opacity) if block.opacity is None else block.opacity
    is_physical = prop.GetInterpolation() == _PBR
    color = _linear(prop.color.float_rgb if block.color is None else block.color)
    # With colours of its own a surface may let light through where they say so.
    blends = opacity < 1.0 or is_mapped or texture is not None
    return Material(
        name=block.name,
        base_color=(1.0, 1.0, 1.0) if is_mapped else color,
        base_color_texture=texture,
        alpha=opacity,
        alpha_mode="blend" if blends else "opaque",
        metallic=float(prop.metallic) if is_physical else 0.0,
        roughness=float(prop.roughness) if is_physical else COLORED.roughness,
        double_sided=True,
        unlit=not prop.lighting,
    )


def _volume(actor: Any, source: Any, name: str) -> Volume:
    """A volume with its plotter's colours and opacities, those of the ends beyond them."""
    image = image_of(source) if hasattr(source, "direction_matrix") else None
    if image is None:
        raise SceneError(f"the volume '{name[:40]}' is no image of numbers", rule="images with one scalar are shown")
    grid, matrix = image
    stored, _ = storable(grid)
    prop = actor.prop
    color, opacity = prop.GetRGBTransferFunction(), prop.GetScalarOpacity()
    low, high = color.GetRange()
    if not high > low:
        low, high = float(stored.min()), float(stored.min()) + 1.0
    values = np.linspace(low, high, 256)
    codes = np.array([color.GetColor(value) for value in values])
    alphas = np.clip([opacity.GetValue(value) for value in values], 0.0, 1.0)
    # VTK's opacities count over a length of their own.
    per_unit = 1.0 - (1.0 - np.minimum(alphas, 1.0 - 1e-6)) ** (1.0 / max(prop.GetScalarOpacityUnitDistance(), 1e-9))
    shading = 1.0 if prop.GetShade() else 0.0
    transfer = TransferFunction(values, decode_srgb(codes), per_unit, "mm", shading, name)
    return Volume(stored, _matrix(actor.GetMatrix()) @ matrix, transfer)


def _camera(renderer: Any, window: tuple[int, int]) -> Camera:
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
    # The middle of the picture lies beside the axis by a share of its half sides.
    half = camera.parallel_scale if camera.parallel_projection else np.tan(np.radians(camera.view_angle) / 2.0)
    right, up = camera.GetWindowCenter()
    shift = float(right * half * window[0] / window[1]), float(up * half)
    if camera.parallel_projection:
        return Camera(CAMERA, pose, height=2.0 * float(half), focus_distance=distance, shift=shift)
    return Camera(CAMERA, pose, fov_y=float(np.radians(camera.view_angle)), focus_distance=distance, shift=shift)


def _matrix(matrix: Any) -> NDArray[np.float64]:
    return np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])


def _linear(color: tuple[float, ...]) -> Color:
    red, green, blue = decode_srgb(np.array(color[:3], float)).tolist()
    return red, green, blue
