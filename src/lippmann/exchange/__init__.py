"""Light fields in the layouts of other tools: 4D Light Field Benchmark, LFToolbox, ESLF, Zarr, folders of views."""

from lippmann.exchange.cameras import Cameras
from lippmann.exchange.layouts import Exported, export_image, import_image
from lippmann.exchange.light_field import LightField, light_field_of
from lippmann.exchange.registry import LAYOUTS

__all__ = ["LAYOUTS", "Cameras", "Exported", "LightField", "export_image", "import_image", "light_field_of"]
