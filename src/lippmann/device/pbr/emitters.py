"""Light sources, glowing surfaces and environments as Mitsuba emitters."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr.materials import Emission
from lippmann.device.pbr.textures import Place, Signal, Table, numbers
from lippmann.device.types import (
    Bool,
    BoundingBox3f,
    Color3f,
    DirectionSample3f,
    Emitter,
    Float,
    Interaction3f,
    MitsubaScene,
    Point2f,
    Properties,
    SurfaceInteraction3f,
    Vector3f,
)
from lippmann.errors import SceneError
from lippmann.scene.studio_light import Studio
from lippmann.scene.values.description import Environment, Light, Matrix

#: A spot's inner half-angle stays this much (radians) below its outer one: Mitsuba divides by the difference.
MIN_PENUMBRA = 1e-3
#: Environments of more rows are taken as they are: Mitsuba places their rows up to half a row off, 0.2 degrees or less.
MAX_EXACT_ROWS = 512

#: Mitsuba puts column 0 of an environment, not the middle, at -z: half a turn between.
_HALF_TURN = np.diag([-1.0, 1.0, -1.0, 1.0])


def active_lights(lights: Sequence[Light]) -> list[Light]:
    """The light sources that give light; the builder calls their emitters ``light_0``, ``light_1``, ..."""
    return [light for light in lights if max(light.color) > 0]


def light_object(light: Light) -> Emitter:
    """The Mitsuba object of a light source: an emitter, or a glowing sphere where it has a radius.

    Raises
    ------
    SceneError
        The light has no direction, or a negative or infinite colour.
    """
    import mitsuba as mi

    color = np.asarray(light.color, dtype=np.float64)
    name = light.name or light.kind
    if not np.all(np.isfinite(color)) or np.any(color < 0):
        raise SceneError(f"light '{name}' has colour {tuple(light.color)}", rule="colours are finite and not negative")
    position, axis = _placement(light, name)
    rgb = {"type": "rgb", "value": color.tolist()}
    if light.kind == "directional":
        return mi.load_dict({"type": "directional", "direction": axis.tolist(), "irradiance": rgb})
    outer = min(light.outer_angle, math.pi / 2)
    inner = min(light.inner_angle, outer - MIN_PENUMBRA)
    if light.radius > 0:
        cone = None if light.kind == "point" else Cone((float(axis[0]), float(axis[1]), float(axis[2])), inner, outer)
        radiance = Signal(numbers(color[None] / (math.pi * light.radius**2)))
        emitter = _surface_emitter(radiance, two_sided=False, cone=cone)
        return mi.load_dict({"type": "sphere", "center": position.tolist(), "radius": light.radius, "emitter": emitter})
    if light.kind == "point":
        return mi.load_dict({"type": "point", "position": position.tolist(), "intensity": rgb})
    up = np.eye(3)[np.argmin(np.abs(axis))]
    frame = mi.ScalarTransform4f().look_at(position.tolist(), (position + axis).tolist(), up.tolist())
    angles = {"cutoff_angle": math.degrees(outer), "beam_width": math.degrees(inner)}
    return mi.load_dict({"type": "spot", "to_world": frame, "intensity": rgb, **angles})


def _placement(light: Light, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    matrix = np.asarray(light.world_from_light, dtype=np.float64)
    axis = -matrix[:3, 2]
    length = float(np.linalg.norm(axis))
    if not np.all(np.isfinite(matrix)) or length == 0:
        raise SceneError(
            f"light '{name}' has a placement without direction", rule="its matrix must be finite and regular"
        )
    return matrix[:3, 3], axis / length


def environment_object(environment: Environment) -> Emitter:
    """The Mitsuba emitter of the surroundings.

    The picture's middle column lies in direction -z of the environment's frame and u grows towards +x, as for a viewer
    in its middle; the top row lies at +y.

    Raises
    ------
    SceneError
        A pixel is negative, infinite or not a number, or the picture is not ``(h, w, 3)``.
    """
    import mitsuba as mi

    pixels = np.asarray(environment.pixels, dtype=np.float32)
    where = environment.name or "environment"
    if pixels.ndim != 3 or pixels.shape[2] != 3 or 0 in pixels.shape:
        raise SceneError(f"the picture has shape {pixels.shape}", where=where, rule="an environment is (h, w, 3)")
    if not np.all(np.isfinite(pixels)) or pixels.min() < 0:
        raise SceneError("a pixel is negative or not finite", where=where, rule="radiance is finite and not negative")
    if (pixels == pixels[0, 0]).all():
        return mi.load_dict({"type": "constant", "radiance": {"type": "rgb", "value": pixels[0, 0].tolist()}})
    to_world = mi.ScalarTransform4f(environment_to_world(environment.world_from_environment).tolist())
    if isinstance(environment, Studio):
        from lippmann.device.pbr.studio_emitter import studio_emitter

        return studio_emitter(environment.scale, to_world)
    if len(pixels) <= MAX_EXACT_ROWS:
        pixels = _rows_for_mitsuba(pixels)
    bitmap = mi.Bitmap(np.require(pixels, requirements=["C", "W"]))  # it refuses read-only arrays
    return mi.load_dict({"type": "envmap", "bitmap": bitmap, "to_world": to_world})


def turn_environment(emitter: Emitter, world_from_environment: Matrix) -> None:
    """Turn the surroundings of :func:`environment_object`; an even colour looks the same from everywhere."""
    import mitsuba as mi

    parameters = mi.traverse(emitter)
    if "to_world" in parameters:
        parameters["to_world"] = mi.Transform4f(environment_to_world(world_from_environment).tolist())
        parameters.update()


def place_lights(scene: MitsubaScene, lights: Sequence[Light]) -> None:
    """Place the light sources of a built scene anew, those without a radius: ``lights`` are the same ones elsewhere."""
    import mitsuba as mi

    emitters = {emitter.id(): emitter for emitter in scene.emitters()}
    for number, light in enumerate(active_lights(lights)):
        parameters, elsewhere = mi.traverse(emitters[f"light_{number}"]), mi.traverse(light_object(light))
        place = "position" if light.kind == "point" else "to_world"
        parameters[place] = elsewhere[place]
        parameters.update()


def environment_to_world(world_from_environment: Matrix) -> Matrix:
    """The ``to_world`` ``(4, 4)`` of an emitter of :func:`environment_object` whose surroundings stand so."""
    return np.asarray(world_from_environment, np.float64) @ _HALF_TURN


def _rows_for_mitsuba(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rows between and beyond those of ``pixels``, so that interpolation gives the same picture as before.

    Mitsuba spreads rows from pole to pole, the first and last upon them; a picture's rows are the middles of bands.
    """
    rows = np.empty((2 * len(pixels) + 1, *pixels.shape[1:]), np.float32)
    rows[1::2] = pixels
    rows[2:-1:2] = (pixels[:-1] + pixels[1:]) / 2
    rows[0], rows[-1] = pixels[0], pixels[-1]
    return rows


def glow(emission: Emission) -> Emitter:
    """The emitter of a glowing surface, to be attached to its shape."""
    return _surface_emitter(emission.radiance, emission.two_sided, emission=emission)


@dataclass(frozen=True)
class Cone:
    """Limits a light to directions near an axis: full inside ``inner`` (radians), none outside ``outer``."""

    axis: tuple[float, float, float]
    inner: float
    outer: float

    def share(self, direction: Vector3f) -> Float:
        """Share of light in a world direction, falling evenly with the angle as Mitsuba's ``spot`` does."""
        import drjit as dr
        import mitsuba as mi

        angle = dr.safe_acos(dr.dot(direction, mi.Vector3f(*self.axis)))
        return dr.clip((self.outer - angle) / (self.outer - self.inner), 0, 1)


def _surface_emitter(
    radiance: Signal, two_sided: bool, cone: Cone | None = None, emission: Emission | None = None
) -> Emitter:
    import mitsuba as mi

    plain = emission is None or (emission.model is None and not emission.tinted)
    if plain and cone is None and not two_sided and radiance.lookup is None:
        assert radiance.factor is not None
        assert not isinstance(radiance.factor, Table)
        value = [float(channel[0]) for channel in radiance.factor]
        return mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": value}})
    return _emitter_class(mi.variant())(mi.Properties("lippmann_glow"), radiance, two_sided, cone, emission)


@functools.cache
def _emitter_class(variant: str) -> type[Emitter]:
    """The plugin class of one variant: Mitsuba's base classes differ between them."""
    import drjit as dr
    import mitsuba as mi

    assert variant == mi.variant()

    class GlowEmitter(mi.Emitter):  # type: ignore[misc, unused-ignore]
        """Area light with texture, two sides, holes or a cone.

        Mitsuba's ``area`` samples points of a textured light by its texels, which goes wrong where texture coordinates
        overlap or leave the unit square; this one samples them evenly over the surface. Radiance that depends on more
        than texture coordinates cannot be evaluated at sampled points: scattered rays alone find such lights.
        """

        def __init__(
            self, props: Properties, radiance: Signal, two_sided: bool, cone: Cone | None, emission: Emission | None
        ) -> None:
            super().__init__(props)
            self.m_flags = mi.EmitterFlags.Surface | mi.EmitterFlags.SpatiallyVarying
            self.radiance = radiance
            self.two_sided = two_sided
            self.cone = cone
            self.tinted = emission is not None and emission.tinted
            self.model = None if emission is None else emission.model
            covered = self.model is None or (
                self.model.opacity is not None and self.model.opacity.follows_uv_only and not self.model.faded
            )
            self.is_sampled = radiance.follows_uv_only and covered and not self.tinted

        def _radiance(self, si: SurfaceInteraction3f, cosine: Float, direction: Vector3f, active: Bool) -> Color3f:
            place = Place(si, active)
            value = self.radiance.eval(place)
            if self.tinted:
                value = value * place.color
            if self.model is not None:
                value = value * self.model.coverage(place)
            if self.cone is not None:
                value = value * self.cone.share(direction)
            return mi.Color3f(value) & (active & ((cosine != 0) if self.two_sided else (cosine > 0)))

        def eval(self, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            return self._radiance(si, si.wi.z, si.to_world(si.wi), active)

        def sample_direction(
            self, it: Interaction3f, sample: Point2f, active: Bool = True
        ) -> tuple[DirectionSample3f, Color3f]:
            if not self.is_sampled:
                return dr.zeros(mi.DirectionSample3f), mi.Color3f(0)
            ds = self.get_shape().sample_direction(it, sample, active)
            ds.emitter = mi.EmitterPtr(self)
            value = self.eval_direction(it, ds, active & (ds.pdf > 0))
            return ds, dr.select(ds.pdf > 0, value / ds.pdf, 0)

        def pdf_direction(self, it: Interaction3f, ds: DirectionSample3f, active: Bool = True) -> Float:
            if not self.is_sampled:
                return mi.Float(0)
            facing = dr.dot(ds.d, ds.n)
            pdf = self.get_shape().pdf_direction(it, ds, active)
            return pdf & (active & ((facing != 0) if self.two_sided else (facing < 0)))

        def eval_direction(self, it: Interaction3f, ds: DirectionSample3f, active: Bool = True) -> Color3f:
            del it
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.uv = ds.uv
            return self._radiance(si, -dr.dot(ds.d, ds.n), -ds.d, active)

        def bbox(self) -> BoundingBox3f:
            return self.get_shape().bbox()

        def to_string(self) -> str:
            return "GlowEmitter[]"

    return GlowEmitter
