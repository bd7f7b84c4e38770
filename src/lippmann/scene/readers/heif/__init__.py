"""HEIF photographs, read by the library ``pillow-heif``."""

from lippmann.scene.readers.heif.photo import read_heif_photo
from lippmann.scene.readers.heif.stereo_pair import read_heif_pair

__all__ = ["read_heif_pair", "read_heif_photo"]
