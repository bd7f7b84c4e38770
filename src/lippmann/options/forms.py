"""Options that mean nothing in a form of picture: neither the command line nor Python takes them there."""

from collections.abc import Mapping
from typing import Literal

#: The form of a request's result: a picture in one piece, one in tiles, a quilt, a forecast, a camera's plain picture.
Form = Literal["picture", "tiles", "quilt", "forecast", "preview"]

_GOALS = ("quality", "quality_worst", "max_time")
_REUSE = ("order", "respect_gloss")

#: Forms that reuse no points of one micro-image in others.
REUSES_NOTHING: tuple[Form, ...] = ("tiles", "quilt", "forecast")

#: The options of a render that a form does not have.
LEFT_OUT: Mapping[Form, tuple[str, ...]] = {
    "picture": (),
    "tiles": (*_REUSE, *_GOALS, "layers"),
    "quilt": (*_REUSE, "subpixels", "layers"),
    "forecast": (*_REUSE, *_GOALS, "layers"),
    "preview": ("method", *_REUSE, *_GOALS, "layers"),
}
