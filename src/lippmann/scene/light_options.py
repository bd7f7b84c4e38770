"""A scene's light with the direction and strength that were asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lippmann.options.light import LightOptions
from lippmann.scene.matrices import rotation
from lippmann.scene.values.description import Environment, Light, Matrix


def light_rotation(options: LightOptions) -> Matrix:
    """The turn of light as a rotation ``(4, 4)``: elevation about x first, then azimuth about y."""
    azimuth, elevation = options.light_turn
    return rotation((azimuth, 0.0, 0.0)) @ rotation((0.0, -elevation, 0.0))


def change_environment(original: Environment, options: LightOptions) -> Environment:
    """An environment as the options have it."""
    if options.environment_strength != 1.0:
        pixels = np.asarray(original.pixels, np.float32) * np.float32(options.environment_strength)
        original = replace(original, pixels=pixels)
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
