"""Test patterns as pictures of the whole panel, with the value of each field as a label."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lippmann._version import VERSION
from lippmann.calibration.labels import label_window, paint_label
from lippmann.calibration.patterns import FloatArray, Pattern, draw, fields, step_of
from lippmann.display.display import INFINITE
from lippmann.display.formats.monitor import Monitor
from lippmann.display.panel import PixelWindow
from lippmann.image import IntegralImage, Provenance
from lippmann.progress import Progress, ProgressCallback, silent

#: Height of a label over that of its field (over its width, if fields are side by side).
_LABEL = 0.65

#: Pixels drawn at a time.
_BLOCK = 1 << 20


def draw_labelled(pattern: Pattern, monitor: Monitor, window: PixelWindow) -> FloatArray:
    """Draw a test pattern with labels of its fields, white on black; parameters, result and errors as of :func:`draw`.

    Values lie between 0 and 1.
    """
    pixels = draw(pattern, monitor, window)
    if pattern.name == "stripes":
        return pixels
    is_horizontal = pattern.name != "slope"
    for field in fields(pattern, monitor):
        height = round(_LABEL * (field.window.height if is_horizontal else field.window.width))
        box = label_window(field.text, field.window, height, at="left" if is_horizontal else "bottom")
        paint_label(pixels, window, field.text, box)
    return pixels


def pattern_picture(pattern: Pattern, monitor: Monitor, *, progress: ProgressCallback = silent) -> IntegralImage:
    """The pattern on the whole panel, as an integral image with its display.

    Raises
    ------
    UsageError
        If a field has values that no monitor can have, or there are more fields than pixels.
    DisplayError
        If a lens is narrower than a pixel, or wider than the panel.
    """
    display = monitor.display()
    width, height = monitor.panel.width, monitor.panel.height
    pixels = np.empty((height, width, 3), dtype=np.float32)
    step = max(1, _BLOCK // width)
    for top in range(0, height, step):
        band = PixelWindow(0, top, width, min(step, height - top))
        pixels[band.rows] = draw_labelled(pattern, monitor, band)
        progress(Progress("draw", band.bottom, height))
    options: dict[str, Any] = {"pattern": pattern.name, "pitch": monitor.pitch, "center": monitor.center}
    options["slope"] = INFINITE if math.isinf(monitor.slope) else monitor.slope
    options |= {"views": pattern.views} if pattern.name == "stripes" else {"step": step_of(pattern, monitor)}
    provenance = Provenance(method="pattern", subpixels=True, scene=pattern.name, version=VERSION, options=options)
    return IntegralImage(pixels, display, provenance=provenance)
