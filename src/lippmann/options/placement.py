"""Options of the display's place in the scene."""

import contextlib
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from lippmann.errors import UsageError
from lippmann.options import texts
from lippmann.options.option import Options, option

Mode = Literal["fit", "camera", "display"]
Vector = tuple[float, float, float]

#: Depth that is scaled by less, or by more than its inverse, leaves nothing that rays could tell apart.
_LEAST_DEPTH_SCALE = 1e-4
#: Factors and millimetres beyond which float32 coordinates of the scene overflow, or their squares do.
_MOST = 1e9

_placement = partial(option, group="Placement")


def _factor(least: float) -> dict[str, Any]:
    return {"low": least, "high": 1.0 / least, "rule": f"must be a factor from {least:g} to {1.0 / least:g}"}


@dataclass(frozen=True)
class PlacementOptions(Options):
    """Options of placing a display in a scene.

    Parameters
    ----------
    camera:
        Name of a camera of the scene; None takes its home camera, or its first.
    place:
        ``fit``: the scene's silhouette fills the panel, its depth what the display resolves. ``camera``: as ``camera``
        looks. ``display``: scene coordinates are millimetres of the display frame. None: ``camera`` if one is named,
        else the scene's home camera if it has one, else ``fit``.
    turn:
        Degrees by which the scene is turned: yaw about the display's y axis (positive: its front toward +x), then pitch
        about x (positive: its top toward the viewer), then roll about z (positive: counter-clockwise). One number is a
        yaw, two are yaw and pitch; kept as three.
    shift:
        Millimetres by which the scene is moved in the display frame, last of all.
    scale:
        Factor on the size at which the scene appears.
    depth_scale:
        Factor on its depth, about the lens plane, above 0. None: when fitting, what compresses the depth into what the
        display resolves, at most 1; otherwise 1, and the two pictures for an eye-tracked monitor that a camera places
        are taken so close together that the depth is comfortable.
    pop_out:
        Share of the scene's depth to lie in front of the lens plane, 0 to 1; with a camera, of the depth that it
        sees. None: a third when fitting, as the camera focuses otherwise.

    Raises
    ------
    UsageError
        A value is out of its range, or two options contradict each other.

    Examples
    --------
    >>> placement = lippmann.PlacementOptions(turn=(30.0, 0.0, 0.0), pop_out=0.5)
    >>> placement.pop_out
    0.5
    """

    noun = "placement"
    keyword = "placement"

    camera: str | None = _placement(
        None, "Place the display by this camera of the scene file.", first=True, metavar="NAME"
    )
    place: Mode | None = _placement(
        None,
        "fit: the scene fills the panel; camera: as the scene's camera looks; display: scene units are its mm. By "
        "default a bundled scene's own camera, else fit.",
    )
    turn: Vector = _placement(
        (0.0, 0.0, 0.0),
        "Turn the scene, in degrees: about the upright axis, then tip it, then roll it.",
        first=True,
        metavar="YAW[,PITCH[,ROLL]]",
        read=texts.turn,
    )
    shift: Vector = _placement(
        (0.0, 0.0, 0.0),
        "Move the scene, in mm: right, up, toward the viewer.",
        first=True,
        metavar="X,Y,Z",
        read=texts.triple,
    )
    scale: float = _placement(1.0, "Enlarge the scene about the display's centre.", first=True, **_factor(1.0 / _MOST))
    depth_scale: float | None = _placement(
        None,
        "Scale the scene's depth about the lens plane: 1 shows it whole, auto as much as the display resolves.",
        first=True,
        default_text="auto",
        read=texts.depth_scale,
        **_factor(_LEAST_DEPTH_SCALE),
    )
    pop_out: float | None = _placement(
        None,
        "Share of the scene's depth in front of the lens plane, 0 to 1; by default a third, or as the camera focuses.",
        first=True,
        low=0.0,
        high=1.0,
        rule="must be a share of the depth, 0 to 1",
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "turn", _three_numbers("turn", self.turn, least=1))
        object.__setattr__(self, "shift", _three_numbers("shift", self.shift, least=3))
        super().__post_init__()
        if self.camera is not None and not isinstance(self.camera, str):
            raise UsageError(f"{self.camera!r}", parameter="camera", rule="must be the name of a camera")
        if self.camera is not None and self.place not in (None, "camera"):
            raise UsageError(
                f"camera '{self.camera}' beside placement '{self.place}'", parameter="camera", rule="only one"
            )
        if self.pop_out is not None and self.place == "display":
            raise UsageError(
                "coordinates of the display leave nothing to choose", parameter="pop_out", fix="use shift=0,0,Z instead"
            )


def _three_numbers(name: str, value: Any, *, least: int) -> Vector:
    """Three numbers of at least ``least``, the others 0."""
    try:
        parts = list(value)
    except TypeError:  # a number, or an array without axes
        parts = [value]
    numbers: list[float] = []
    with contextlib.suppress(TypeError, ValueError):
        numbers += [float(each) for each in parts]
    if not least <= len(numbers) <= 3 or not all(abs(each) <= _MOST for each in numbers):
        count = "three numbers" if least == 3 else "one to three numbers"
        raise UsageError(f"{value!r}", parameter=name, rule=f"must be {count}, none beyond {_MOST:g}")
    x, y, z = (*numbers, *([0.0] * (3 - len(numbers))))
    return x, y, z
