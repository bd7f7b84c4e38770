"""How the light of a scene differs from what its file says."""

from dataclasses import dataclass
from functools import partial
from typing import Any

from lippmann.options import texts
from lippmann.options.option import Options, option

#: The largest factor on light.
MOST_STRENGTH = 1e6

_light = partial(option, group="Light")
_STRENGTH: dict[str, Any] = {
    "metavar": "FACTOR",
    "low": 0.0,
    "high": MOST_STRENGTH,
    "rule": f"must be a factor from 0 to {MOST_STRENGTH:g}",
}


@dataclass(frozen=True)
class LightOptions(Options):
    """How the light of a scene differs from what its file says.

    Parameters
    ----------
    light_turn:
        Azimuth and elevation in degrees by which light from far away is turned: the environment, the built-in studio,
        and directional light sources. Azimuth swings light from the front to the right, elevation lifts it.
    light_strength:
        Factor on the scene's light sources, 0 or more. Glowing surfaces keep their radiance.
    environment_strength:
        Factor on the radiance of the environment, or of the built-in studio, 0 or more.

    Raises
    ------
    UsageError
        A value is out of its range.

    Examples
    --------
    >>> light = lippmann.LightOptions(light_turn=(30.0, 10.0), light_strength=2.0)
    >>> scene = lippmann.load_scene("teapot", light=light)
    """

    noun = "light"
    keyword = "light"

    light_turn: tuple[float, float] = _light(
        (0.0, 0.0),
        "Turn light from far away, degrees to the right and up: the environment, the studio, directional lights.",
        first=True,
        metavar="AZIMUTH[,ELEVATION]",
        rule="must be two finite angles in degrees",
        read=texts.light_turn,
    )
    light_strength: float = _light(1.0, "Factor on the scene's own light sources.", **_STRENGTH)
    environment_strength: float = _light(1.0, "Factor on light of the environment or the studio.", **_STRENGTH)
