"""Changes to a scene's light: its direction and its strength."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from lippmann.errors import UsageError
from lippmann.scene.matrices import rotation
from lippmann.scene.values.description import Environment, Light, Matrix

#: The largest factor on light.
MOST_STRENGTH = 1e6


@dataclass(frozen=True)
class LightOptions:
    """How the light of a scene differs from what its file says.

    Parameters
    ----------
    turn:
        Azimuth and elevation in degrees by which light from far away is turned: the environment, the built-in studio,
        and directional light sources. Azimuth swings light from the front to the right, elevation lifts it.
    strength:
        Factor on the scene's light sources, 0 or more. Glowing surfaces keep their radiance.
    environment_strength:
        Factor on the radiance of the environment, or of the built-in studio, 0 or more.

    Raises
    ------
    UsageError
        A value is out of its range.
    """

    turn: tuple[float, float] = (0.0, 0.0)
    strength: float = 1.0
    environment_strength: float = 1.0

    def __post_init__(self) -> None:
        if len(self.turn) != 2 or not all(map(math.isfinite, self.turn)):
            raise UsageError(f"{self.turn!r}", parameter="light_turn", rule="two finite angles in degrees")
        for name in ("strength", "environment_strength"):
            value = getattr(self, name)
            if not 0.0 <= value <= MOST_STRENGTH:
                parameter = "light_strength" if name == "strength" else name
                raise UsageError(f"{value:g}", parameter=parameter, rule=f"a factor from 0 to {MOST_STRENGTH:g}")

    @property
    def rotation(self) -> Matrix:
        """The turn as a rotation ``(4, 4)``: elevation about x first, then azimuth about y."""
        azimuth, elevation = self.turn
        return rotation((azimuth, 0.0, 0.0)) @ rotation((0.0, -elevation, 0.0))

    def environment(self, original: Environment) -> Environment:
        """An environment in this light."""
        if self.environment_strength != 1.0:
            pixels = np.asarray(original.pixels, np.float32) * np.float32(self.environment_strength)
            original = replace(original, pixels=pixels)
        if any(self.turn):
            original = replace(original, world_from_environment=self.rotation @ original.world_from_environment)
        return original

    def source(self, original: Light) -> Light:
        """A light source in this light."""
        if self.strength != 1.0:
            red, green, blue = (value * self.strength for value in original.color)
            original = replace(original, color=(red, green, blue))
        if any(self.turn) and original.kind == "directional":
            original = replace(original, world_from_light=self.rotation @ original.world_from_light)
        return original
