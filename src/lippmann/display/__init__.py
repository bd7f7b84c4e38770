"""Panels, lens arrays and the displays made of them; pure NumPy, knows nothing of the renderer."""

from lippmann.display.array_ops import NUMPY, ArrayOps
from lippmann.display.display import Display
from lippmann.display.formats.load import list_displays, load_display
from lippmann.display.lens_array import LensArray, LensGrid
from lippmann.display.micro_image_layout import (
    covers_whole_pixels,
    micro_image_extent,
    micro_image_shape,
    pixel_indices_under_lens,
    pixel_lenses,
)
from lippmann.display.panel import Panel

__all__ = [
    "NUMPY",
    "ArrayOps",
    "Display",
    "LensArray",
    "LensGrid",
    "Panel",
    "covers_whole_pixels",
    "list_displays",
    "load_display",
    "micro_image_extent",
    "micro_image_shape",
    "pixel_indices_under_lens",
    "pixel_lenses",
]
