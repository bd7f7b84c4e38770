"""The integral image, its micro-images and views, and its files; knows nothing of the renderer."""

from lippmann.image.integral_image import IntegralImage
from lippmann.image.metadata import Metadata
from lippmann.image.part_folders import compose, write_micro_images, write_views
from lippmann.image.picture import Picture
from lippmann.image.provenance import Provenance
from lippmann.image.read import PictureFile, open_file, read_metadata, read_picture
from lippmann.image.streamed import LargePicture, open_picture
from lippmann.image.write import write_picture

__all__ = [
    "IntegralImage",
    "LargePicture",
    "Metadata",
    "Picture",
    "PictureFile",
    "Provenance",
    "compose",
    "open_file",
    "open_picture",
    "read_metadata",
    "read_picture",
    "write_micro_images",
    "write_picture",
    "write_views",
]
