"""Participating media of a Mitsuba scene: whether there are any, and which one surrounds all shapes."""

from __future__ import annotations

from lippmann.device.types import Medium, MitsubaScene

MEDIA_NOTE = (
    "light in participating media is found by volumetric path tracing: a scattering event counts as a surface of the "
    "ray depth; layers and the denoiser's features are those of the surfaces in and behind a medium"
)


def has_media(scene: MitsubaScene) -> bool:
    """Whether a shape of ``scene``, instanced ones included, bounds a medium, or a sensor stands in one."""
    return bool(_interior_media(scene) or _other_media(scene) or _has_instanced_media(scene))


def surrounding_medium(scene: MitsubaScene) -> Medium | None:
    """The medium around all shapes; None where there is none.

    It is the first of a sensor's that no shape has in its interior.
    """
    interiors = _interior_media(scene)
    sensors = (sensor.get_medium() for sensor in scene.sensors())
    return next((medium for medium in sensors if medium is not None and medium not in interiors), None)


def _interior_media(scene: MitsubaScene) -> list[Medium]:
    media = (shape.interior_medium() for shape in scene.shapes())
    return [medium for medium in media if medium is not None]


def _other_media(scene: MitsubaScene) -> list[Medium]:
    exteriors = (shape.exterior_medium() for shape in scene.shapes())
    sensors = (sensor.get_medium() for sensor in scene.sensors())
    return [medium for medium in (*exteriors, *sensors) if medium is not None]


def _has_instanced_media(scene: MitsubaScene) -> bool:
    """Whether a shape bounds a medium that only instances show: such shapes are known by their parameters alone."""
    import mitsuba as mi

    if not any(shape.class_name() == "Instance" for shape in scene.shapes()):
        return False
    return any({"interior_medium", "exterior_medium"} & set(key.split(".")) for key, _ in mi.traverse(scene))
