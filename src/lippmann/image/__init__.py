"""The integral image, its micro-images and views, and its files; knows nothing of the renderer."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lippmann.image.integral_image import IntegralImage, Picture
    from lippmann.image.metadata import Metadata, Provenance
    from lippmann.image.part_folders import compose, write_micro_images, write_views
    from lippmann.image.read import PictureFile, open_file, read_metadata, read_picture
    from lippmann.image.streamed import LargePicture, open_picture
    from lippmann.image.write import write_picture

#: Modules of the names, each loaded when one of its names is first used: to write a picture takes few of them.
_HOME = {
    "IntegralImage": "lippmann.image.integral_image",
    "Metadata": "lippmann.image.metadata",
    "compose": "lippmann.image.part_folders",
    "write_micro_images": "lippmann.image.part_folders",
    "write_views": "lippmann.image.part_folders",
    "Picture": "lippmann.image.integral_image",
    "Provenance": "lippmann.image.metadata",
    "PictureFile": "lippmann.image.read",
    "open_file": "lippmann.image.read",
    "read_metadata": "lippmann.image.read",
    "read_picture": "lippmann.image.read",
    "LargePicture": "lippmann.image.streamed",
    "open_picture": "lippmann.image.streamed",
    "write_picture": "lippmann.image.write",
}

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


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
