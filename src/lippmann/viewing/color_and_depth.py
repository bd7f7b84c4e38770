"""Colour and depth side by side (RGB-D), and depth maps, of what an eye sees of a picture with the layer ``depth``.

Depth is the distance from the eye along the axis of the display. Its grey codes are linear in inverse depth: by their
difference neighbouring views differ, and pictures with such depth are read as photographs (:mod:`depth_photo`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.exr import write_exr
from lippmann.codecs.pfm import write_pfm
from lippmann.codecs.png import encode_png
from lippmann.codecs.rgbd_names import RgbdForm, White, rgbd_of_name
from lippmann.codecs.tiff import write_tiff
from lippmann.codecs.types import Pixels
from lippmann.color.transfer import quantize
from lippmann.errors import OutputError, UsageError
from lippmann.image.integral_image import IntegralImage
from lippmann.image.stored_values import FloatArray
from lippmann.runtime.atomic_write import check_writable, replacing
from lippmann.viewing.replay import Eye, default_eye, default_size, replay, replay_points
from lippmann.viewing.stereo import half_width

#: Endings of the files that hold colour beside depth, and depth alone.
RGBD_FILES, DEPTH_FILES = (".png", ".tif", ".tiff"), (".exr", ".tif", ".tiff", ".png", ".pfm")


def visible_distance(image: IntegralImage, eye: Eye | None = None, size: tuple[int, int] | None = None) -> FloatArray:
    """Distance ``(h, w)`` in mm from the eye along the display's axis; infinite where nothing is hit.

    Raises
    ------
    UsageError
        The picture has no depth.
    """
    depth = image.maps.get("depth")
    if depth is None:
        raise UsageError("has no depth", rule="that is one of its layers", fix="render it with layers=True")
    eye = default_eye(image.display) if eye is None else eye
    size = default_size(image.display) if size is None else size
    is_hit = np.isfinite(depth)
    # A line of sight that misses the panel is black: no hit there.
    parts = np.stack([np.where(is_hit, depth, 0.0), is_hit, is_hit], axis=-1)
    height, hit, _ = np.moveaxis(replay_points(image.with_pixels(parts, maps={}), eye, size, subpixels=False), -1, 0)
    return np.where(hit > 0.0, np.float32(eye[2]) - height, np.inf).astype(np.float32)


def range_of(distance: FloatArray) -> tuple[float, float]:
    """Nearest and farthest finite distance.

    Raises
    ------
    UsageError
        Nothing is seen.
    """
    finite = distance[np.isfinite(distance)]
    if not len(finite):
        raise UsageError("nothing is seen", rule="depth lies between something near and something far")
    return float(finite.min()), float(finite.max())


def depth_codes(distance: FloatArray, near: float, far: float, bits: int, white: White) -> Pixels:
    """Codes ``(h, w)`` of distances, linear in inverse depth from ``near`` to ``far``."""
    span = 1.0 / near - 1.0 / far
    # All that is seen may be at one distance; what is not is at infinity.
    share = (1.0 / distance.astype(np.float64) - 1.0 / far) / span if span else np.isfinite(distance).astype(np.float64)
    share = np.clip(share, 0.0, 1.0)
    values: FloatArray = (share if white == "near" else 1.0 - share).astype(np.float32)
    return quantize(values, bits, "linear")


def rgbd_codes(
    image: IntegralImage,
    form: RgbdForm,
    eye: Eye | None = None,
    *,
    between: tuple[float, float] | None = None,
    bits: int = 8,
    size: tuple[int, int] | None = None,
) -> Pixels:
    """Colour on the left and depth on the right, as codes of 8 or 16 bits.

    Parameters
    ----------
    between:
        Nearest and farthest distance in mm; None for those that are seen.
    size:
        Of the colour picture at full width.
    """
    width, height = default_size(image.display) if size is None else size
    width += width % 2  # so that halves are whole columns
    color = replay(image, eye, size=(width, height))
    distance = visible_distance(image, eye, (width, height))
    near, far = range_of(distance) if between is None else between
    depth = depth_codes(distance, near, far, bits, form.white)
    if form.half:
        color = half_width(color)
        depth = depth[:, ::2]  # a mean of two depths is that of no surface
    gray: NDArray[np.generic] = np.repeat(depth[..., None], 3, axis=2)
    return np.ascontiguousarray(np.concatenate([quantize(color, bits, image.provenance.transfer), gray], axis=1))


def named(path: Path, form: RgbdForm) -> Path:
    """``path`` with the ending of its form.

    Raises
    ------
    OutputError
        The name says another form.
    """
    said = rgbd_of_name(path)
    if said is None:
        return path.with_name(f"{path.stem}{form.ending}{path.suffix}")
    if said != form:
        raise OutputError("the name says another form", where=str(path), rule=f"this one's ends in {form.ending}")
    return path


def write_rgbd(codes: Pixels, path: Path) -> None:
    """Write colour beside depth as PNG or TIFF."""
    with replacing(path) as temporary:
        if path.suffix.lower() == ".png":
            temporary.write_bytes(encode_png(codes, text={}))
        else:
            write_tiff(temporary, codes, description="")


def write_depth(distance: FloatArray, path: Path) -> None:
    """Write distances as a depth map: OpenEXR (channel ``Z``), TIFF and PFM in mm, PNG in 65534 steps of the farthest.

    Where nothing is hit, depth is infinite; in a PNG 65535.
    """
    with replacing(path) as temporary:
        match path.suffix.lower():
            case ".exr":
                write_exr(temporary, {"Z": distance}, text={})
            case ".pfm":
                write_pfm(temporary, distance)
            case ".png":
                steps = distance * np.float32(65534.0 / range_of(distance)[1])
                codes = np.where(np.isfinite(distance), np.rint(steps), 65535).astype(np.uint16)
                temporary.write_bytes(encode_png(codes, text={}, srgb=False))
            case _:
                write_tiff(temporary, distance, description="depth in mm")


def check_depth_path(path: Path, ours: tuple[str, ...]) -> None:
    """Raise :class:`OutputError` unless the file's ending is one of ``ours``, and it can be written."""
    if path.suffix.lower() not in ours:
        raise OutputError.unknown("ending", path.suffix, ours, where=str(path))
    check_writable(path)
