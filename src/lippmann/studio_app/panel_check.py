"""The pattern that a panel's window shows to be photographed, and the answer to a photograph of it.

GET  /check.png   the pattern, native pixels
POST /check       {"photograph": base64 of a JPEG or PNG file}: {"line": the result}
"""

from __future__ import annotations

import base64
import io
import json
from http import HTTPStatus
from pathlib import Path

from lippmann.calibration.panel_photograph import check_photograph, draw_photograph_pattern
from lippmann.codecs.photograph import open_photograph
from lippmann.display import Display
from lippmann.errors import LippmannError, PictureError
from lippmann.viewer.responses import RefusedError, Response, json_response
from lippmann.viewing.replay import default_eye

#: Most pixels of a photograph; the page makes it smaller.
_MOST_PIXELS = 1 << 24


def camera_distance(display: Display) -> float | None:
    """Distance of the camera from the lenses in mm; None for displays whose lenses are not known."""
    return None if display.stereo is not None else default_eye(display)[2]


def pattern_response(display: Display) -> Response:
    """The pattern as PNG."""
    from PIL import Image

    if display.stereo is not None:
        raise RefusedError(HTTPStatus.NOT_FOUND, "there is no pattern for this display")
    file = io.BytesIO()
    Image.fromarray(draw_photograph_pattern(display)).save(file, "PNG", compress_level=1)
    return Response(file.getvalue(), "image/png")


def check_response(display: Display, body: bytes) -> Response:
    """The line that a photograph gives; what is wrong with it is a line, too."""
    distance = camera_distance(display)
    if distance is None:
        raise RefusedError(HTTPStatus.NOT_FOUND, "there is no pattern for this display")
    try:
        data = base64.b64decode(json.loads(body)["photograph"], validate=True)
    except (ValueError, TypeError, KeyError, RecursionError):
        raise RefusedError(HTTPStatus.BAD_REQUEST, "this is no photograph") from None
    try:
        with open_photograph(io.BytesIO(data), Path("photograph"), ("JPEG", "PNG")) as photograph:
            if photograph.size[0] * photograph.size[1] > _MOST_PIXELS:
                raise PictureError(f"it has more than {_MOST_PIXELS} pixels", where="photograph")
            codes = photograph.srgb_codes()
        if codes.dtype != "uint8" or codes.shape[-1] != 3:
            raise PictureError("it has no colours of 8 bits", where="photograph")
        line = check_photograph(codes, display, distance)
    except LippmannError as error:
        line = str(error)
    except (OSError, SyntaxError) as error:
        line = f"photograph: cannot be read: {error}"
    return json_response({"line": line})
