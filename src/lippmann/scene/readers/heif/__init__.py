"""HEIF photographs, read by the library ``pillow-heif``."""

from lippmann.scene.readers.heif.photo import read_heif_photo

__all__ = ["read_heif_photo"]
