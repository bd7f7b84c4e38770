"""HEIF photographs, read by the library ``pillow-heif``."""

from lippmann.scene.readers.heif.photo import open_heif_photograph, read_heif_photo
from lippmann.scene.readers.heif.stereo_pair import has_depth, read_heif_pair

__all__ = ["has_depth", "open_heif_photograph", "read_heif_pair", "read_heif_photo"]
