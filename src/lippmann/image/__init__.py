"""The integral image, its micro-images and views, and its files; knows nothing of the renderer."""

from lippmann.image.folders import compose, write_micro_images, write_views
from lippmann.image.formats import PictureInfo, read_info, read_metadata, read_picture, write_picture
from lippmann.image.integral_image import IntegralImage
from lippmann.image.large import LargePicture, open_picture
from lippmann.image.metadata import Metadata
from lippmann.image.provenance import Provenance

__all__ = [
    "IntegralImage",
    "LargePicture",
    "Metadata",
    "PictureInfo",
    "Provenance",
    "compose",
    "open_picture",
    "read_info",
    "read_metadata",
    "read_picture",
    "write_micro_images",
    "write_picture",
    "write_views",
]
