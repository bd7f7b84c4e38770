"""Scenes, ready to be placed and rendered: their content, light, cameras and bounds."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.options.light import LightOptions
from lippmann.options.option import checked
from lippmann.runtime.engine_lock import cached_property
from lippmann.scene.extent import bounds_of, box, box_corners, extreme_points_of, thin_axis
from lippmann.scene.matrices import rotation, rotation_of, transform_points
from lippmann.scene.reflectance import emitted_luminance
from lippmann.scene.splat_clouds import check_splats
from lippmann.scene.values.description import (
    Camera,
    Color,
    Environment,
    Light,
    Material,
    Matrix,
    Mesh,
    SceneDescription,
)
from lippmann.scene.volumes.grid import check_volume

if TYPE_CHECKING:
    from lippmann.scene.mitsuba_source import MitsubaSource
    from lippmann.scene.values.whitted_scene import ClassicScene

Bounds = NDArray[np.float64]

STUDIO_NOTE = "no lights in the scene: lit by the built-in studio"
MIRROR_NOTE = "the lights have no surroundings: metal and glass mirror a dim studio (environment=none: black)"

#: Radiance of even surroundings; surfaces that light a scene less than these would are no light sources.
_DIMMEST = 0.02

#: Radiance of a white surface that the studio adds to a file's lights, as a share of what these give it. Half: a chrome
#: ball beside a matt one under a lamp looks like dark metal; double: it is nearly white, the picture a third brighter.
_FILL = 0.25

_FRAMING_FOV = np.radians(30.0)


@checked
@dataclass(frozen=True, eq=False)
class Scene:
    """A scene ready to be placed and built.

    ``description`` is what was read, with the environment and background that the caller asked for in it. A scene made
    for the classic light models has a ``classic_form`` instead, with ``views`` for its cameras; its ``physical`` form
    is then derived when it is first needed. A scene with both has a form of its own for either kind of light;
    ``classic_form`` may be a function that makes it, which is called when :attr:`classic` is first needed.
    ``home_camera`` names the camera that the scene was made to be shown by (bundled scenes, files of Whitted tracers),
    None for all others; ``home_may_move`` says that it need not be kept to exactly where a display shows more or less.
    ``studio`` says whether the built-in studio may light a scene that has no lights. ``light`` changes the direction
    and the strength of its light: :attr:`environment` and :attr:`lights` are those after that change.
    ``light_moved`` is the rigid 4x4 matrix by which its light is moved after that, but for the studio's, which follows
    the viewer; None for light that stays.
    ``has_chosen_background`` says that the background is of a colour that the caller asked for; ``settings`` are the
    options that it was read with, a line each (:func:`lippmann.options.texts.settings_of`).

    A scene from Mitsuba knows its ``bounds``, ``cameras``, ``lights`` and hence ``environment``, ``background`` and
    ``notes`` only once the engine has started: asked before, they start it.

    Examples
    --------
    >>> lippmann.load_scene("teapot").name
    'teapot'
    """

    name: str
    description: SceneDescription | MitsubaSource | None = field(default=None, repr=False)
    home_camera: str | None = None
    home_may_move: bool = field(default=False, repr=False)
    studio: bool = True
    classic_form: ClassicScene | Callable[[], ClassicScene] | None = field(default=None, repr=False)
    views: tuple[Camera, ...] = field(default=(), repr=False)
    light: LightOptions = field(default_factory=LightOptions, repr=False)
    has_chosen_background: bool = field(default=False, repr=False)
    light_moved: Matrix | None = field(default=None, repr=False)
    settings: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.description is None and self.classic_form is None:
            raise SceneError(
                "a scene without any content", where=self.name, fix="lippmann.load_scene gives one with it"
            )

    @cached_property
    def classic(self) -> ClassicScene | None:
        """The scene in the terms of the classic light models; None where it has no such form."""
        form = self._own_classic
        if form is None or self.light_moved is None:
            return form
        from lippmann.scene.classic_light import move_light

        return move_light(form, self.light_moved)

    @cached_property
    def _own_classic(self) -> ClassicScene | None:
        """:attr:`classic` with its light where it was made."""
        return self.classic_form() if callable(self.classic_form) else self.classic_form

    @cached_property
    def physical(self) -> SceneDescription | MitsubaSource:
        """The scene in the terms of physically based light, which is not moved yet."""
        if self.description is not None:
            return self.description
        from lippmann.scene.whitted.to_pbr import to_physical

        assert self._own_classic is not None
        return to_physical(self._own_classic, self.views)

    @property
    def is_classic(self) -> bool:
        """Whether the classic light models are what the scene was made for."""
        return self.description is None

    @cached_property
    def bounds(self) -> Bounds:
        """Lowest and highest corner ``(2, 3)`` of the box around all geometry that has an end, world units."""
        if self.description is None:
            return self._classic_bounds()
        if isinstance(self.description, SceneDescription):
            return bounds_of(self.description)
        return self.description.bounds()

    def bounds_in(self, frame: Matrix) -> Bounds:
        """The box ``(2, 3)`` along the axes of another frame: ``frame`` is the 4x4 matrix that leads there from world.

        Tight around the vertices of a description; around the corners of the world's box for a scene of Mitsuba's.
        """
        if self.description is None:
            return self._classic_bounds(frame)
        if isinstance(self.description, SceneDescription):
            return bounds_of(self.description, frame)
        corners = transform_points(frame, box_corners(self.bounds))
        return np.stack([corners.min(axis=0), corners.max(axis=0)])

    def _classic_bounds(self, frame: Matrix | None = None) -> Bounds:
        from lippmann.scene.whitted.world_frame import world_bounds

        assert self.classic is not None
        return world_bounds(self.classic, frame)

    @cached_property
    def extreme_points(self) -> Bounds:
        """Points ``(n, 3)`` between which all geometry lies that has an end, world units.

        Tight around the vertices of a description; the corners of :attr:`bounds` for other scenes.
        """
        if isinstance(self.description, SceneDescription):
            return extreme_points_of(self.description)
        return box_corners(self.bounds)

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """The cameras that the scene brings, in its order."""
        if self.description is None:
            return self.views
        if isinstance(self.description, SceneDescription):
            return tuple(self.description.cameras)
        return self.description.cameras()

    @property
    def is_unbounded(self) -> bool:
        """Whether there are shapes without end, which :attr:`bounds` leaves out."""
        classic = self.classic if self.description is None else None
        return classic is not None and bool(len(classic.planes) + len(classic.cylinders))

    @property
    def display_camera(self) -> str | None:
        """Name of the camera that places a display where nothing else is said; None: the scene is fitted.

        That is the home camera, and for a scene of Mitsuba's the first sensor that it brings.
        """
        if self.home_camera is not None or self.description is None or isinstance(self.description, SceneDescription):
            return self.home_camera
        return self.cameras[0].name if self.cameras else None

    @property
    def facing_cameras(self) -> Sequence[Camera]:
        """Cameras whose direction of view a fit may take where nothing else is said: none beside a home camera."""
        return self.cameras if self.display_camera is None else ()

    @cached_property
    def has_lights(self) -> bool:
        """Whether the scene has light of its own, or an environment was asked for; see :func:`has_lights`."""
        if self.physical.environment is not None:
            return True
        if isinstance(self.physical, SceneDescription):
            return has_lights(self.physical)
        return self.physical.has_lights()

    @property
    def has_physical_lights(self) -> bool:
        """Whether the scene's light sources are told in physical units, so that its pictures need an exposure."""
        description = self.description
        return isinstance(description, SceneDescription) and description.physical_lights

    @property
    def has_splats(self) -> bool:
        """Whether there are Gaussian splats."""
        return isinstance(self.description, SceneDescription) and self.description.splats is not None

    @property
    def has_volume(self) -> bool:
        """Whether there is a volume."""
        return isinstance(self.description, SceneDescription) and self.description.volume is not None

    @property
    def fills_panel(self) -> bool:
        """Whether displays show no border of the scene, as of a photograph."""
        return isinstance(self.description, SceneDescription) and self.description.fills_panel

    @cached_property
    def is_unlit(self) -> bool:
        """Whether all that is seen are surfaces with colours of their own, which nothing lights."""
        description = self.description
        if not isinstance(description, SceneDescription) or self.lies_off_surfaces:
            return False
        return all(description.materials[description.meshes[mesh].material].unlit for mesh in description.placements)

    @property
    def lies_off_surfaces(self) -> bool:
        """Whether there is light that lies on no surface: Gaussian splats or a volume."""
        return self.has_splats or self.has_volume

    @property
    def is_off_surfaces_alone(self) -> bool:
        """Whether splats or a volume are all there is: their light has no noise."""
        description = self.description
        has_surfaces = not isinstance(description, SceneDescription) or bool(description.placements)
        return self.lies_off_surfaces and not has_surfaces

    @property
    def keeps_its_colors(self) -> bool:
        """Whether no light changes anything: the colours of unlit surfaces, splats and volumes are their own."""
        return self.is_unlit or self.is_off_surfaces_alone

    @property
    def in_studio(self) -> bool:
        """Whether the built-in studio lights the scene, for want of other light."""
        return self.studio and not self.has_lights

    @property
    def environment(self) -> Environment | None:
        """Light from far away: the scene's or the caller's; the studio where the scene has no light at all."""
        original = self._original_environment
        if original is None:
            return None
        changed = change_environment(original, self.light)
        if self.light_moved is None or changed.follows_viewer:
            return changed
        turned = rotation_of(self.light_moved) @ changed.world_from_environment
        return replace(changed, world_from_environment=turned)

    @cached_property
    def _original_environment(self) -> Environment | None:
        if not (self.in_studio or self._needs_surroundings):
            return self.physical.environment
        from lippmann.scene.studio_light import studio, studio_for

        if not self.in_studio:
            return studio(_FILL * self._irradiance() / math.pi)
        return studio_for(self.physical) if isinstance(self.physical, SceneDescription) else studio()

    @property
    def lights(self) -> tuple[Light, ...]:
        """The light sources of a description; none of a scene of Mitsuba's, which keeps its own."""
        if not isinstance(self.physical, SceneDescription):
            return ()
        changed = (change_source(light, self.light) for light in self.physical.lights)
        if self.light_moved is None:
            return tuple(changed)
        return tuple(
            replace(light, world_from_light=self.light_moved @ np.asarray(light.world_from_light)) for light in changed
        )

    def with_light_moved(self, matrix: Matrix) -> Scene:
        """The scene with its light sources, environment and background moved by a rigid ``matrix`` (4x4).

        Its shapes stay, and what was derived of them is kept. Light sources in a scene of Mitsuba's are parts of it and
        stay, too; an environment that was given instead moves.
        """
        _ = self.physical  # which all that are moved share
        moved = copy.copy(self)
        object.__setattr__(moved, "light_moved", matrix)
        vars(moved).pop("classic", None)
        return moved

    @property
    def background(self) -> Color | None:
        """Colour seen where nothing is hit; None for the environment itself (black without one)."""
        if self.physical.background is not None or not self.in_studio:
            return (0.0, 0.0, 0.0) if self._needs_surroundings else self.physical.background
        from lippmann.scene.studio_light import BACKDROP

        return BACKDROP

    @property
    def notes(self) -> tuple[str, ...]:
        """Features that the reader ignored, and its assumptions, one line each."""
        notes = tuple(self.physical.notes) if isinstance(self.physical, SceneDescription) else ()
        if self.in_studio:
            return (*notes, STUDIO_NOTE)
        return (*notes, MIRROR_NOTE) if self._needs_surroundings else notes

    @cached_property
    def _needs_surroundings(self) -> bool:
        """Whether smooth metals or glass have nothing to mirror: no sky, and light sources without a size alone."""
        if not (self.studio and self.has_physical_lights) or self.physical.environment is not None:
            return False
        assert isinstance(self.physical, SceneDescription)
        if not self.physical.lights:
            return False
        materials = {self.physical.meshes[mesh].material for mesh in self.physical.placements}
        return any(_mirrors(self.physical.materials[each]) for each in materials)

    def _irradiance(self) -> float:
        """What the file's lights send to a surface in the scene's middle that faces them all, W/m², mean of colours."""
        assert isinstance(self.physical, SceneDescription)
        low, high = self.bounds
        total = 0.0
        for light in self.physical.lights:
            way = np.asarray(light.world_from_light)[:3, 3] - (low + high) / 2
            nearest = float((high - low) @ (high - low)) / 4
            square = 1.0 if light.kind == "directional" else max(float(way @ way), nearest)
            total += sum(light.color) / 3 / square
        return total

    def camera(self, name: str | None = None) -> Camera:
        """A camera by name; without one the first, or for a scene without cameras one that frames it from +z.

        Raises
        ------
        SceneError
            No camera has that name.
        """
        if name is not None:
            return find_camera(self.cameras, name)
        if self.cameras:
            return next((camera for camera in self.cameras if camera.name == self.home_camera), self.cameras[0])
        return framing_camera(self.bounds)


def find_camera(cameras: Sequence[Camera], name: str) -> Camera:
    """The camera called ``name``.

    Raises
    ------
    SceneError
        There is none; the error lists those that there are.
    """
    for camera in cameras:
        if camera.name == name:
            return camera
    fix = "" if cameras else "leave it out"
    raise SceneError.unknown("camera", name, [camera.name for camera in cameras], parameter="camera", fix=fix)


def framing_camera(bounds: Bounds) -> Camera:
    """A camera on the +z side that sees the whole box in a square picture, focused on its middle.

    A flat scene that would be seen edge-on is looked at from +x or +y instead, whichever shows its face.

    Raises
    ------
    SceneError
        The box has no size, or is not finite.
    """
    center, size = box(bounds)
    thin = thin_axis(bounds)
    # The camera's axes x, y and z (toward it) in the world: from +z, from +x, or from +y with -z up.
    axes = {None: (0, 1, 2), 0: (2, 1, 0), 1: (0, 2, 1)}[thin]
    signs = {None: (1.0, 1.0, 1.0), 0: (-1.0, 1.0, 1.0), 1: (1.0, -1.0, 1.0)}[thin]
    across, up, toward = axes
    half = np.tan(_FRAMING_FOV / 2.0)
    distance = max(size[[across, up]].max() / 2.0 / half, 1e-3 * size.max()) * 1.05 + size[toward] / 2.0
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = np.eye(3)[:, axes] * signs
    world_from_camera[:3, 3] = center + distance * world_from_camera[:3, 2]
    return Camera("framing", world_from_camera, fov_y=float(_FRAMING_FOV), focus_distance=float(distance))


def has_lights(description: SceneDescription) -> bool:
    """Whether a description has emitters: an environment, a light, surfaces that light it, or only unlit ones.

    Surfaces of radiance 1 and below are labels and screens, which do not light a scene, unless the file has them as
    light sources. Neither do brighter ones so small, as an aircraft's landing lights, that all the rest is black.
    """
    if (
        description.environment is not None
        or description.physical_lights
        or any(max(light.color) > 0.0 for light in description.lights)
    ):
        return True
    indices = {description.meshes[mesh].material for mesh in description.placements}
    materials = [description.materials[index] for index in indices]
    if not materials:
        return description.splats is not None or description.volume is not None  # which nothing lights
    if all(material.unlit for material in materials):
        return True
    if max(max(material.emission) for material in materials) <= 1.0:
        return False
    low, high = bounds_of(description)
    return emitted_luminance(description) >= _DIMMEST * np.pi * float(((high - low) ** 2).sum())


def _mirrors(material: Material) -> bool:
    """Whether a quarter of a surface or more is smooth metal or glass.

    Of four published models with such textures, half the share would take in no other (porcelain flowers have 0.08),
    double would leave a helmet (0.496) black.
    """
    roughness, metallic = (np.array([value], np.float32) for value in (material.roughness, material.metallic))
    texture = material.metallic_roughness_texture
    if texture is not None:
        from lippmann.scene.parsing.texture_maps import scalar

        roughness, metallic = roughness * scalar(texture.image, "g"), metallic * scalar(texture.image, "b")
    return bool(np.mean((roughness < 0.5) & (np.maximum(metallic, material.transmission) > 0.5)) >= 0.25)


def light_rotation(options: LightOptions) -> Matrix:
    """The turn of light as a rotation ``(4, 4)``: elevation about x first, then azimuth about y."""
    azimuth, elevation = options.light_turn
    return rotation((azimuth, 0.0, 0.0)) @ rotation((0.0, -elevation, 0.0))


def change_environment(original: Environment, options: LightOptions) -> Environment:
    """An environment as the options have it."""
    if options.environment_strength != 1.0:
        original = original.brighten(options.environment_strength)
    if any(options.light_turn):
        original = replace(original, world_from_environment=light_rotation(options) @ original.world_from_environment)
    return original


def change_source(original: Light, options: LightOptions) -> Light:
    """A light source as the options have it."""
    if options.light_strength != 1.0:
        red, green, blue = (value * options.light_strength for value in original.color)
        original = replace(original, color=(red, green, blue))
    if any(options.light_turn) and original.kind == "directional":
        original = replace(original, world_from_light=light_rotation(options) @ original.world_from_light)
    return original


def check_description(description: SceneDescription, where: str) -> SceneDescription:
    """Check a description and return it.

    Raises
    ------
    SceneError
        Nothing to see; a number that is not finite; an index that is out of range.
    """
    for material in description.materials:
        _check_material(material, where)
    for mesh in description.meshes:
        _check_mesh(mesh, len(description.materials), where)
    for number, instance in enumerate(description.instances):
        if not 0 <= instance.mesh < len(description.meshes):
            raise SceneError(f"instance {number} uses mesh {instance.mesh} of {len(description.meshes)}", where=where)
        if np.shape(instance.world_from_mesh)[-2:] != (4, 4):
            raise _no_matrix(number, where)
    matrices = [np.reshape(instance.world_from_mesh, (-1, 16)) for instance in description.instances]
    if matrices and not np.isfinite(np.concatenate(matrices)).all():  # all at once: there may be a million
        raise _no_matrix(next(number for number, own in enumerate(matrices) if not np.isfinite(own).all()), where)
    if description.splats is not None:
        check_splats(description.splats, where)
    if description.volume is not None:
        check_volume(description.volume, where)
        if description.splats is not None:
            raise SceneError("has both Gaussian splats and a volume", where=where, rule="one of them is rendered")
    elif description.splats is None and not any(
        len(places) and len(description.meshes[mesh].faces) for mesh, places in description.placements.items()
    ):
        raise SceneError("the scene has no geometry", where=where, rule="there must be at least one triangle")
    return description


def _no_matrix(number: int, where: str) -> SceneError:
    return SceneError(f"instance {number} has a matrix that is not 4x4 finite numbers", where=where)


def _check_mesh(mesh: Mesh, materials: int, where: str) -> None:
    count = len(mesh.positions)
    tables = {"vertices": mesh.positions, "normals": mesh.normals, "vertex colours": mesh.colors}
    tables |= {"tangents": mesh.tangents}
    tables |= {f"uv set {number}": uvs for number, uvs in enumerate(mesh.uvs)}
    for what, table in tables.items():
        if table is None:
            continue
        if len(table) != count:
            raise SceneError(f"mesh '{mesh.name}' has {len(table)} {what} for {count} vertices", where=where)
        bad = ~np.isfinite(table).all(axis=1)
        if bad.any():
            raise SceneError(
                f"mesh '{mesh.name}' has {int(bad.sum())} {what} that are not finite (first: number {np.argmax(bad)})",
                where=where,
                rule="coordinates must be finite numbers",
            )
    if len(mesh.faces) and int(mesh.faces.max()) >= count:
        raise SceneError(f"mesh '{mesh.name}' uses vertex {int(mesh.faces.max())} of {count}", where=where)
    if not 0 <= mesh.material < materials:
        raise SceneError(f"mesh '{mesh.name}' uses material {mesh.material} of {materials}", where=where)


def _check_material(material: Material, where: str) -> None:
    numbers = (*material.base_color, *material.emission, material.alpha, material.metallic, material.roughness)
    if not np.isfinite(numbers).all() or min(numbers) < 0.0:
        raise SceneError(
            f"material '{material.name}' has a factor that is negative or not finite",
            where=where,
            rule="factors are numbers of 0 or more",
        )


def override_light(
    description: SceneDescription | MitsubaSource, environment: Environment | None, background: Color | None
) -> SceneDescription | MitsubaSource:
    """The description with its environment and background replaced, where others are given."""
    if environment is not None:
        description = replace(description, environment=environment)
        if isinstance(description, SceneDescription):
            description = replace(description, notes=(*description.notes, *environment.notes))
    if background is not None:
        description = replace(description, background=background)
    return description
