"""Background behind the surfaces, and fog between them."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.types import Color3f, Float, Point3f, Vector3f
from lippmann.scene.values.whitted_surfaces import Background, Fog


def background_color(background: Background, o: Point3f, d: Vector3f) -> Color3f:
    """Colour of the background for rays from ``o`` along ``d``."""
    if background.kind == "solid":
        return mi.Color3f(*background.color)
    along = dr.dot(d if background.kind == "sky-sphere" else o, mi.Vector3f(*background.up))
    span = background.top_value - background.bottom_value
    share = dr.clip((along - background.bottom_value) / span, 0, 1)
    return share * mi.Color3f(*background.top_color) + (1 - share) * mi.Color3f(*background.bottom_color)


def clearness(fog: Fog, distance: Float) -> Float:
    """Share of what lies at ``distance`` that is seen through the fog."""
    if fog.kind == "linear":
        share = (fog.end - distance) * (1 / (fog.end - fog.start))
    else:
        thickness = fog.density * (distance - fog.start)
        share = dr.exp(-thickness * thickness if fog.kind == "exp2" else -thickness)
    return dr.clip(share, 0, 1)
