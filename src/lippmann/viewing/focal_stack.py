"""Focal stacks: a picture focused on several planes, as an array or as files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from lippmann.codecs.tiff import write_tiff_pages
from lippmann.color.transfer import Transfer
from lippmann.errors import OutputError
from lippmann.image.encoding import converted_values
from lippmann.image.integral_image import IntegralImage
from lippmann.image.stored_values import FloatArray
from lippmann.image.streamed import LargePicture
from lippmann.image.write import check_finite, format_for, write_plain_picture
from lippmann.options.option import checked
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.atomic_write import check_folder_writable, check_writable, replacing, replacing_folder
from lippmann.viewing.refocus import focal_planes
from lippmann.viewing.video_file import check_animation_path, film_suffixes, is_film, write_animation

#: Frames per second of a stack as an animation: slow enough to see the focus move through a dozen planes.
_FRAMES_PER_SECOND = 8.0


@checked
def focal_stack(
    image: IntegralImage | LargePicture,
    planes: Sequence[float],
    *,
    size: tuple[int, int] | None = None,
    progress: ProgressCallback = silent,
) -> FloatArray:
    """Pictures focused on several planes.

    Parameters
    ----------
    image:
        The native picture.
    planes:
        Heights of the planes over the lens plane in mm, positive toward the viewer, below the viewing distance.
    size:
        Width and height of a picture in pixels, 1 to 65535. None: the panel's, at most 1024 wide.
    progress:
        Called after every plane.

    Returns
    -------
    ``(planes, height, width, 3)`` float32 linear RGB; black where no line of sight meets the panel.

    Raises
    ------
    UsageError
        If a plane is not finite or not below the viewing distance, or the size is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> display = lippmann.load_display("mla-square")
    >>> image = lippmann.IntegralImage(np.zeros((510, 510, 3), dtype=np.float32), display)
    >>> lippmann.focal_stack(image, [-10.0, 0.0, 10.0], size=(34, 34)).shape
    (3, 34, 34, 3)
    """
    return np.stack(list(_report(focal_planes(image, planes, size=size), len(planes), progress)))


def check_stack_path(path: Path, bits: int | None = None) -> None:
    """Raise :class:`OutputError` unless a focal stack of so many bits can be written to ``path``; writes nothing.

    Names end in ``.tif`` (pages), ``.png``, ``.apng`` or ``.mp4`` (an animation), or in nothing (a folder).
    """
    if not path.suffix:
        format_for(path / "plane.png", bits)
        check_folder_writable(path)
        return
    if path.suffix.lower() in (".tif", ".tiff"):
        format_for(path, bits)
    else:
        if not is_film(path):
            rule = f"a focal stack is a folder, a .tif or an animation ({', '.join(film_suffixes())})"
            raise OutputError.unknown("ending", path.suffix, (".tif", *film_suffixes()), where=str(path), rule=rule)
        if bits not in (None, 8):
            raise OutputError(f"{bits} bits per channel are not possible", where=str(path), rule="animations have 8")
        check_animation_path(path)
    check_writable(path)


def write_planes(
    pictures: Iterator[FloatArray],
    planes: Sequence[float],
    path: Path,
    *,
    bits: int | None = None,
    transfer: Transfer = "srgb",
    progress: ProgressCallback = silent,
) -> None:
    """Write the pictures of a focal stack, one at a time.

    Parameters
    ----------
    pictures:
        ``(height, width, 3)`` linear RGB, one for each of the ``planes``.
    path:
        ``.tif``: one page per plane. ``.png``, ``.apng`` or ``.mp4``: an animation. Without an ending: a folder with
        one PNG per plane, whose names say the plane in mm.
    bits:
        Bits per channel of a TIFF (8, 16, 32) or PNG (8, 16); 8 by default.
    transfer:
        Coding of the values.
    """
    check_stack_path(path, bits)
    checked = _report(_finite(pictures, path), len(planes), progress)
    if not path.suffix:
        _write_folder(checked, planes, path, bits, transfer)
    elif is_film(path):
        write_animation(checked, path, frames_per_second=_FRAMES_PER_SECOND, transfer=transfer)
    else:
        stored = format_for(path, bits)[1]
        with replacing(path) as temporary:
            write_tiff_pages(temporary, (converted_values(picture, stored, transfer) for picture in checked))


def _write_folder(
    pictures: Iterable[FloatArray], planes: Sequence[float], folder: Path, bits: int | None, transfer: Transfer
) -> None:
    digits = len(str(len(planes) - 1))
    with replacing_folder(folder) as temporary:
        for number, (plane, picture) in enumerate(zip(planes, pictures, strict=True)):
            name = temporary / f"plane_{number:0{digits}}_{plane:+g}mm.png"
            write_plain_picture(picture, name, bits=bits, transfer=transfer)


def _finite(pictures: Iterable[FloatArray], path: Path) -> Iterator[FloatArray]:
    for picture in pictures:
        check_finite(picture, path)
        yield picture


def _report(pictures: Iterable[FloatArray], count: int, progress: ProgressCallback) -> Iterator[FloatArray]:
    for number, picture in enumerate(pictures, start=1):
        progress(Progress("refocus", number, count))
        yield picture
