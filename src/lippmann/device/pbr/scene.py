"""From a scene to a ``mi.Scene``: materials, shapes, lights, in this order; and the features of it that paths need."""

from __future__ import annotations

import itertools
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from lippmann.device.pbr.emitters import active_lights, environment_object, light_object
from lippmann.device.pbr.materials import Finish, Variant, follows_tangents, make_finishes
from lippmann.device.pbr.media import MEDIA_NOTE, has_media
from lippmann.device.pbr.shapes import Dress, has_volume, make_shapes
from lippmann.device.pbr.textures import TextureStore
from lippmann.device.types import BSDF, Color3f, Emitter, MitsubaScene, Shape, ShapePtr
from lippmann.errors import SceneError, UsageError
from lippmann.options.light import LightOptions
from lippmann.runtime import engine as engines
from lippmann.runtime import machine
from lippmann.runtime.engine_lock import EngineOwner
from lippmann.scene.matrices import transform_points
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Color, Matrix, SceneDescription

if TYPE_CHECKING:
    from lippmann.device.splats.table import SplatTable
    from lippmann.device.volumes.table import VolumeTable
    from lippmann.scene.mitsuba_source import MitsubaSource


@dataclass(frozen=True, eq=False)
class BuiltScene(EngineOwner):
    """A scene on the device.

    Attributes
    ----------
    mitsuba:
        The ``mi.Scene``.
    background:
        What camera rays see where nothing is hit; None for the environment itself (black without one).
    absorption:
        Beer-Lambert coefficients (RGB, per world unit) inside bodies of coloured glass, by the position of their
        shape in ``mitsuba.shapes()``.
    has_null:
        Whether some surface lets rays straight through: a cut-out, a blended surface, a thin pane.
    borrowed:
        Whether the ``mi.Scene`` is the caller's own, which nothing may change.
    has_media:
        Whether there are participating media.
    splats:
        Gaussian splats that can be seen, which are no part of the ``mi.Scene``.
    volume:
        A volume, which is no part of it, either.
    finishes:
        Materials on the device, by what of them meshes use.
    notes:
        What could not be honoured, one line each.
    seconds:
        Time spent on ``materials`` (with their textures), ``shapes``, ``lights`` and the ``acceleration`` structure,
        or on ``load`` for a scene of Mitsuba's own.
    """

    mitsuba: MitsubaScene
    background: Color | None
    absorption: Mapping[int, Color]
    has_null: bool
    notes: tuple[str, ...]
    seconds: Mapping[str, float]
    borrowed: bool = False
    has_media: bool = False
    splats: SplatTable | None = None
    volume: VolumeTable | None = None
    finishes: Mapping[Variant, Finish] = field(default_factory=dict)


@dataclass(frozen=True)
class SceneFeatures:
    """Features that switch parts of the path loop on.

    Attributes
    ----------
    background:
        Linear RGB that camera rays see where nothing is hit; None for the environment itself.
    has_null:
        Whether some surface lets rays straight through.
    absorption:
        ``mi.Color3f`` of absorption coefficients per world unit, indexed by a shape's place in Dr.Jit's registry; None
        where no shape absorbs.
    """

    background: Color | None = None
    has_null: bool = False
    absorption: Color3f | None = None

    def absorption_of(self, shape: ShapePtr) -> Color3f:
        """Absorption coefficients per world unit inside ``shape``."""
        import drjit as dr
        import mitsuba as mi

        return dr.gather(mi.Color3f, self.absorption, dr.reinterpret_array(mi.UInt32, shape))


def build(
    scene: Scene,
    engine: engines.Engine | None = None,
    *,
    memory: int | None = None,
    finishes: Mapping[Variant, Finish] | None = None,
) -> BuiltScene:
    """Make a Mitsuba scene under the variant of ``engine``, a running engine; None starts one.

    Parameters
    ----------
    memory:
        Bytes that the scene's shapes may take; None for all that is free.
    finishes:
        Those of another scene of the same materials, which are used again where meshes use the same of them.

    Raises
    ------
    SceneError
        Mitsuba refuses the scene, it shows nothing, it does not fit the memory, or a light or environment
        has values that mean nothing.
    EngineError
        The engine cannot be started.
    """
    if engine is None:
        engines.start()
    if not isinstance(scene.physical, SceneDescription):
        return _build_source(scene.physical, scene)
    description = replace(
        scene.physical, environment=scene.environment, background=scene.background, lights=scene.lights
    )
    return build_description(description, memory=memory, finishes=finishes)


def build_description(
    description: SceneDescription,
    *,
    memory: int | None = None,
    finishes: Mapping[Variant, Finish] | None = None,
) -> BuiltScene:
    """Make a Mitsuba scene of a description as it stands, under the variant that runs.

    ``memory`` and ``finishes`` are those of :func:`build`.

    Raises
    ------
    SceneError
        Nothing to see, no room in the memory, or a light or environment has values that mean nothing.
    """
    seconds: dict[str, float] = {}
    notes: list[str] = []
    placed = _placements(description, notes)
    if not placed and description.splats is None and description.volume is None:
        raise SceneError(
            "the scene has no geometry", where=description.name, rule="there must be at least one triangle"
        )
    with _time_stage(seconds, "materials"):
        variants = [_variant(description, mesh) for mesh in placed]
        if finishes is None or finishes.keys() != set(variants):
            finishes = _finishes(description, variants)
        notes += _texture_notes(description, finishes)
    with _time_stage(seconds, "shapes"):
        dressed = [(_dress(description, mesh, finishes), matrices) for mesh, matrices in placed.items()]
        available = machine.available_memory() if memory is None else memory
        shapes, shape_finishes = make_shapes(dressed, available, name=description.name)
    splats = None
    if description.splats is not None:
        with _time_stage(seconds, "splats"):
            from lippmann.device.splats.table import make_table

            splats = make_table(description.splats, available, name=description.name)
    volume = None
    if description.volume is not None:
        with _time_stage(seconds, "volume"):
            from lippmann.device.volumes.table import make_table as make_volume_table

            volume = make_volume_table(description.volume, available, name=description.name)
    with _time_stage(seconds, "lights"):
        lights = [light_object(light) for light in active_lights(description.lights)]
        if description.environment is not None:
            lights.append(environment_object(description.environment))
    with _time_stage(seconds, "acceleration"):
        scene = _assemble(shapes, lights)
    return BuiltScene(
        mitsuba=scene,
        background=description.background,
        absorption=_absorption(scene, shapes, shape_finishes),
        has_null=any(has_null(finish.bsdf) for finish in finishes.values()),
        notes=tuple(notes),
        seconds=seconds,
        splats=splats,
        volume=volume,
        finishes=finishes,
    )


def _build_source(source: MitsubaSource, scene: Scene) -> BuiltScene:
    from lippmann.scene.mitsuba_source import with_sky

    seconds: dict[str, float] = {}
    environment = scene.environment
    _check_light(scene.light, has_environment=environment is not None)
    with _time_stage(seconds, "load"):
        loaded = source.scene()
        if environment is not None:
            loaded = with_sky(loaded, environment_object(environment))
    passing = any(may_pass(shape) for shape in loaded.shapes())
    with_media = has_media(loaded)
    notes = (MEDIA_NOTE,) if with_media else ()
    return BuiltScene(loaded, scene.background, {}, passing, notes, seconds, source.is_borrowed, with_media)


def _check_light(light: LightOptions, *, has_environment: bool) -> None:
    """Refuse changes to the light sources that a scene of Mitsuba's brings."""
    rule = "a Mitsuba scene keeps its own light sources"
    if light.light_strength != 1.0:
        raise UsageError(f"{light.light_strength:g}", parameter="light_strength", rule=rule, fix="use exposure")
    if has_environment:
        return
    for parameter, changes in (
        ("light_turn", any(light.light_turn)),
        ("environment_strength", light.environment_strength != 1.0),
    ):
        if changes:
            raise UsageError("has nothing to change", parameter=parameter, rule=rule, fix="leave it out")


@contextmanager
def _time_stage(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - started


def _placements(description: SceneDescription, notes: list[str]) -> dict[int, Matrix]:
    """The places ``(k, 4, 4)`` of each mesh that has triangles and volume there."""
    placed: dict[int, Matrix] = {}
    flat = 0
    for mesh, matrices in description.placements.items():
        if len(description.meshes[mesh].faces) == 0:
            continue
        kept = has_volume(matrices)
        flat += int(np.count_nonzero(~kept))
        if kept.any():
            placed[mesh] = matrices if kept.all() else matrices[kept]
    if flat:
        notes.append(f"{flat} object(s) scaled to nothing along an axis are left out")
    return placed


def _variant(description: SceneDescription, mesh: int) -> Variant:
    colors = description.meshes[mesh].colors
    number = description.meshes[mesh].material
    material = description.materials[number]
    return Variant(
        number,
        tinted=colors is not None,
        faded=colors is not None and colors.shape[1] == 4 and material.alpha_mode != "opaque",
        alone=description.meshes[mesh].stands_for == "rod",
        tangents=description.meshes[mesh].tangents is not None and follows_tangents(material),
    )


def _finishes(description: SceneDescription, variants: Sequence[Variant]) -> dict[Variant, Finish]:
    compensates = description.multiple_scattering
    made = make_finishes(description.materials, variants, TextureStore(), compensates=compensates)
    return {variant: finish for finish in made for variant in finish.members}


def _dress(description: SceneDescription, mesh: int, finishes: Mapping[Variant, Finish]) -> Dress:
    variant = _variant(description, mesh)
    return Dress(description.meshes[mesh], variant, finishes[variant])


def _texture_notes(description: SceneDescription, finishes: Mapping[Variant, Finish]) -> list[str]:
    """Textures that a mesh has no coordinates for."""
    lacking: Counter[int] = Counter()
    for number in description.placements:
        finish = finishes.get(_variant(description, number))
        mesh = description.meshes[number]
        if finish is not None and any(uv_set >= len(mesh.uvs) for uv_set in finish.uv_sets):
            lacking[mesh.material] += 1
    return [
        f"{count} mesh(es) of material '{description.materials[material].name}' have no coordinates for its textures: "
        "their first texel is taken"
        for material, count in sorted(lacking.items())
    ]


def _assemble(shapes: Sequence[Shape], lights: Sequence[Emitter]) -> MitsubaScene:
    import mitsuba as mi

    # Embree's fast mode loses a quarter of the rays that run parallel to an axis but for rounding, along edges: as all
    # rays of a lenticular sheet may, across its height. The robust mode costs about a tenth of the rays' rate.
    parts: dict[str, object] = {"type": "scene", "embree_use_robust_intersections": True}
    parts |= {f"shape_{number}": shape for number, shape in enumerate(shapes)}
    parts |= {f"light_{number}": light for number, light in enumerate(lights)}
    return mi.load_dict(parts, optimize=False)


def _absorption(scene: MitsubaScene, shapes: Sequence[Shape], finishes: Sequence[Finish | None]) -> dict[int, Color]:
    # Mitsuba may order its shapes as it likes; equality of its Python objects is identity.
    positions = list(scene.shapes())
    return {
        positions.index(shape): finish.absorption
        for shape, finish in zip(shapes, finishes, strict=True)
        if finish is not None and finish.absorption is not None
    }


def make_scene_features(
    scene: MitsubaScene,
    *,
    background: Color | None = None,
    has_null: bool = True,
    absorption: Mapping[int, Color] | None = None,
) -> SceneFeatures:
    """The features of a scene, its absorption uploaded to the device.

    Parameters
    ----------
    scene:
        The scene.
    background:
        Linear RGB that camera rays see where nothing is hit; by default the environment itself.
    has_null:
        Whether some surface lets rays straight through. True is always correct, but slower.
    absorption:
        Absorption coefficients per world unit, by the index of a shape in ``scene.shapes()``.
    """
    if not absorption:
        return SceneFeatures(background, has_null)
    import drjit as dr
    import mitsuba as mi

    pointers = dr.reinterpret_array(mi.UInt32, scene.shapes_dr())
    indices = [int(pointers[i]) for i in range(len(pointers))]
    table = [[0.0, 0.0, 0.0] for _ in range(max(indices) + 1)]
    for position, coefficients in absorption.items():
        table[indices[position]] = list(coefficients)
    columns = [mi.Float([row[c] for row in table]) for c in range(3)]
    return SceneFeatures(background, has_null, mi.Color3f(*columns))


def is_instance(shape: Shape) -> bool:
    """Whether a shape shows a group of others, which are out of sight: it tells a surface that none of them has."""
    return bool(shape.class_name() == "Instance")


def may_pass(shape: Shape) -> bool:
    """Whether a shape may let rays straight through; an instance may."""
    return is_instance(shape) or has_null(shape.bsdf())


def has_null(surface: BSDF) -> bool:
    """Whether a surface has a null lobe."""
    import mitsuba as mi

    return bool(mi.has_flag(surface.flags(), mi.BSDFFlags.Null))


def scene_corners(built: BuiltScene, display_from_world: Matrix) -> Matrix:
    """``(8, 3)`` corners in mm of a box around everything that a ray can hit, emitters included."""
    box = built.mitsuba.bbox()
    low, high = np.array(box.min, dtype=np.float64), np.array(box.max, dtype=np.float64)
    if built.splats is not None:
        low, high = np.minimum(low, built.splats.bounds[0]), np.maximum(high, built.splats.bounds[1])
    if built.volume is not None:
        low, high = np.minimum(low, built.volume.bounds[0]), np.maximum(high, built.volume.bounds[1])
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    return transform_points(display_from_world, corners)
