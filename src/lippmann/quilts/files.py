"""Quilt files, and folders with one picture per view.

Values keep the type in which they are stored: the largest quilts take 0.8 GB with 8 bits, four times that as floats.
The size of a picture is checked before memory is allocated for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from lippmann.codecs.photograph import open_photograph, report_errors
from lippmann.codecs.picture_notes import FileNotes
from lippmann.codecs.stereo_pairs import HEIF, PAIRS
from lippmann.codecs.types import FILMS
from lippmann.errors import OutputError, PictureError
from lippmann.image.encoding import FORMATS, STORED, FormatName, converted_values, encode_values
from lippmann.image.part_folders import MANIFEST
from lippmann.image.read import MOST_PIXELS, opaque_colors, open_file
from lippmann.image.stored_values import Stored, Values
from lippmann.image.write import format_for, replacing_output
from lippmann.options.option import checked
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quilts.quilt import (
    MOST_SIDE,
    Quilt,
    QuiltLayout,
    check_size,
    layout_of_name,
    names_half_pair,
    names_layout,
)
from lippmann.quilts.quilt_metadata import metadata_of_text, quilt_text
from lippmann.quilts.view_names import list_views, middle_row, places_of_views
from lippmann.runtime.atomic_write import replacing_folder
from lippmann.runtime.regular_file import check_kind, unreadable

#: Formats by Pillow's names, with their endings, that are read and not written.
_KINDS = ("JPEG", "WEBP", "AVIF", "BMP", "PPM", "GIF", "TGA")
_PHOTOGRAPHS = (".jpg", ".jpeg", ".webp", ".avif", ".bmp", ".ppm", ".gif", ".tga")
READ = (*FORMATS, *_PHOTOGRAPHS)
#: End of the names of four views in the shape of the whole picture, the leftmost at the top left: Leia's.
_FROM_TOP = "_2x2"
#: A layout that no quilt has: stereo pairs one above the other, the left eye's on top.
_PAIR_FROM_TOP = (1, 2)


def is_quilt(path: Path) -> bool:
    """Whether a file is a quilt: by its metadata, or by its name if there is none.

    Raises
    ------
    PictureError
        If the file is missing or damaged.
    """
    if path.suffix.lower() in (*PAIRS, *HEIF):
        return True
    text = "" if path.suffix.lower() in _PHOTOGRAPHS else open_file(path).text
    if not text:
        return names_layout(path) or path.stem.endswith(_FROM_TOP)
    return metadata_of_text(text, str(path)) is not None


@checked
def read_quilt(path: Path, layout: QuiltLayout | None = None) -> Quilt:
    """Read a quilt: PNG, OpenEXR, TIFF, JPEG, WebP, AVIF, BMP, PPM, GIF or TGA; transparent parts lie on black.

    A stereo pair in one file (JPS, MPO, HEIF) is a quilt of two views, whatever the layout.

    Parameters
    ----------
    path:
        The file.
    layout:
        Columns, rows and aspect ratio. None: as the file's name says, such as ``_qs8x6a0.75``, or else its metadata.
        Leia's four views, ``_2x2``, begin at the top left, and 1 x 2 views that only ``layout`` tells of at the top.

    Raises
    ------
    PictureError
        If the file is missing or damaged, nothing says its layout, or the layout does not fit its size.
    """
    if path.suffix.lower() in (*PAIRS, *HEIF):
        from lippmann.quilts.photos import quilt_of_pair

        return quilt_of_pair(path)
    _check_ending(path)
    with open_view(path) as file:
        metadata = metadata_of_text(file.text, str(path))
        is_unnamed = metadata is None and not names_layout(path)
        from_top = is_unnamed and (path.stem.endswith(_FROM_TOP) if layout is None else layout[:2] == _PAIR_FROM_TOP)
        if from_top and layout is None:
            layout = QuiltLayout(2, 2, file.size[0] / file.size[1])
        elif layout is None:
            # A name that says nothing is refused only where the metadata says nothing either.
            layout = metadata.layout if metadata and not names_layout(path) else layout_of_name(path)
        if layout.aspect is None and metadata is not None:
            layout = layout._replace(aspect=metadata.layout.aspect)
        if layout.aspect is None and names_half_pair(path):
            layout = layout._replace(aspect=file.size[0] / file.size[1])
        check_size(*file.size, layout, str(path))
        values = file.read()
    if from_top:
        values = np.concatenate(np.split(values, 2)[::-1])
    stored = cast("Stored", values.dtype.name)
    if metadata is None:
        return Quilt(values, layout, stored, notes=file.notes)
    return Quilt(values, layout, stored, metadata.provenance, metadata.display, file.notes)


@checked
def read_views(folder: Path, layout: QuiltLayout | None = None, *, progress: ProgressCallback = silent) -> Quilt:
    """Read a quilt from a folder with one picture per view.

    Parameters
    ----------
    folder:
        The folder. Views are numbered in their file names, that of the leftmost camera first; of a grid of cameras,
        named by row and column, the middle row is taken.
    layout:
        Columns, rows and aspect ratio of the quilt. None: one row of all views.
    progress:
        Called after every view.

    Raises
    ------
    PictureError
        If a view is missing or damaged, or differs from the first in size.
    """
    paths, taken = _list_numbered(folder)
    if layout is None:
        layout = QuiltLayout(len(paths), 1, None)
    if len(paths) != layout.views:
        rule = f"{layout.columns}x{layout.rows} views are {layout.views}"
        raise PictureError(f"it holds {len(paths)} views", where=str(folder), rule=rule)
    quilt, notes = None, FileNotes()
    for number, path in enumerate(paths):
        with open_view(path) as file:
            if quilt is None:
                _check_held(file.size, layout.views, folder)
                quilt = _blank_quilt(file.size, layout, file.stored())
            if file.size != quilt.view_size:
                width, height = quilt.view_size
                rule = f"the first view, {paths[0].name}, has {width} x {height}"
                raise PictureError(f"has {file.size[0]} x {file.size[1]} pixels", where=str(path), rule=rule)
            if quilt.stored not in (file.stored(), "float32"):
                quilt = _linear_quilt(quilt, number)
            values = file.read()
        quilt.view_values(number)[...] = converted_values(values, quilt.stored, "srgb")
        notes.add(path.name, file.notes)
        progress(Progress("read", number + 1, layout.views))
    assert quilt is not None  # there are views
    return replace(quilt, notes=taken + notes.lines())


def read_film(path: Path, layout: QuiltLayout) -> Quilt:
    """A quilt of frames of a film, evenly spaced, the first as the leftmost view.

    Raises
    ------
    PictureError
        If the film is damaged, or has fewer frames than the layout views.
    """
    from lippmann.codecs.film_views import read_frames

    frames = read_frames(path, layout.views)
    if len(frames) < layout.views:
        rule = f"{layout.columns}x{layout.rows} views are {layout.views}"
        raise PictureError(f"it holds {len(frames)} frames", where=str(path), rule=rule)
    quilt = replace(_blank_quilt(frames[0].size, layout, "uint8"), notes=frames[0].notes)
    for number, frame in enumerate(frames):
        quilt.view_values(number)[...] = frame.codes()
    return quilt


def ending_of_views(source: Path) -> str:
    """The ending ``_qsCxRaA`` of the quilt of a folder's views, or a film's frames, that is nearest to a square; errors
    as of :func:`read_views` and :func:`read_film`.
    """
    if source.is_file():
        from lippmann.codecs.film_views import MOST_FRAMES, count_frames, read_frames

        count, (width, height) = min(count_frames(source), MOST_FRAMES), read_frames(source, 1)[0].size
        aspect = width / height
        columns = max(1, round(math.sqrt(count / aspect)))  # a few frames may be left out
        return QuiltLayout(columns, max(1, count // columns), float(f"{aspect:.6g}")).ending
    paths, _ = _list_numbered(source)
    with open_view(paths[0]) as file:
        count, aspect = len(paths), file.size[0] / file.size[1]
    # Columns a row more than a square quilt has are as far from it as so many times fewer.
    columns = min(
        (each for each in range(1, count + 1) if count % each == 0), key=lambda c: abs(math.log(c * c * aspect / count))
    )
    return QuiltLayout(columns, count // columns, float(f"{aspect:.6g}")).ending


def _check_held(view_size: tuple[int, int], views: int, folder: Path) -> None:
    """Raise :class:`PictureError` if so many views of ``(width, height)`` pixels are more than one picture can have."""
    width, height = view_size
    if width * height * views > MOST_PIXELS:
        rule = f"together they have at most {MOST_PIXELS} pixels"
        raise PictureError(f"it holds {views} views of {width} x {height} pixels", where=str(folder), rule=rule)


def _blank_quilt(view_size: tuple[int, int], layout: QuiltLayout, stored: Stored) -> Quilt:
    """A quilt whose values are not yet set."""
    width, height = view_size
    return Quilt(np.empty((height * layout.rows, width * layout.columns, 3), dtype=stored), layout, stored)


def _linear_quilt(quilt: Quilt, views: int) -> Quilt:
    """The quilt as linear floats, of which the first ``views`` views are set: they are of several depths."""
    linear = _blank_quilt(quilt.view_size, quilt.layout, "float32")
    for number in range(views):
        linear.view_values(number)[...] = converted_values(quilt.view_values(number), "float32", "srgb")
    return linear


@checked
def write_quilt(quilt: Quilt, path: Path, *, bits: int | None = None) -> Quilt:
    """Write a quilt to a file.

    Parameters
    ----------
    quilt:
        The quilt.
    path:
        The file, ``.png``, ``.exr`` or ``.tif``; its name states the quilt's columns and rows.
    bits:
        Bits per value: 8 or 16 for PNG, 16 or 32 for OpenEXR, 8, 16 or 32 for TIFF. None: as the quilt is stored.

    Returns
    -------
    The quilt with the values that the file holds, as :func:`read_quilt` gives them.

    Raises
    ------
    PictureError
        If the name states no layout or another one, the size does not fit it, or a value is not finite.
    OutputError
        If the format is unknown or has no such bits, or the file cannot be written.
    """
    layout = layout_of_name(path, to_write=True)
    if layout[:2] != quilt.layout[:2]:
        rule = f"the quilt has {quilt.layout.columns}x{quilt.layout.rows} views"
        raise PictureError(f"the name says {layout.columns}x{layout.rows}", where=str(path), rule=rule)
    check_size(*quilt.size, layout, str(path))
    name, stored = format_for(path, bits, source=quilt.stored)
    if quilt.values.dtype.kind == "f" and not np.isfinite(quilt.values).all():
        raise PictureError("the quilt holds values that are not finite", where=str(path))
    transfer = quilt.provenance.transfer
    values = converted_values(quilt.values, stored, transfer)
    with replacing_output(path, name) as temporary:
        encode_values(temporary, name, {"": values}, transfer=transfer, text=quilt_text(quilt))
    return replace(quilt, values=values, layout=layout, stored=stored)


def write_views(
    quilt: Quilt,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> None:
    """Write a folder with one picture per view; ``view_00`` is that of the leftmost camera.

    Parameters
    ----------
    quilt:
        The quilt.
    folder:
        The folder; appears whole or not at all.
    format:
        ``png``, ``exr`` or ``tiff``. None: the one that holds the quilt's values without loss.
    bits:
        Bits per value. None: as the quilt is stored.
    progress:
        Called after every view.

    Raises
    ------
    OutputError
        If the format is unknown or has no such bits, or the folder cannot be written.
    """
    if format is None:
        format = "png" if quilt.stored in STORED["png"].values() else "exr"
    if format not in STORED:
        raise OutputError.unknown("format", format, STORED, where=str(folder))
    ending = next(ending for ending, name in FORMATS.items() if name == format)
    _, stored = format_for(folder / f"view{ending}", bits, source=quilt.stored)
    digits = len(str(quilt.layout.views - 1))
    with replacing_folder(folder) as temporary:
        for number in range(quilt.layout.views):
            path = temporary / f"view_{number:0{digits}}{ending}"
            values = converted_values(quilt.view_values(number), stored, "srgb")
            encode_values(path, format, {"": values}, transfer="srgb")
            progress(Progress("write", number + 1, quilt.layout.views))


def _list_numbered(folder: Path) -> tuple[Sequence[Path], tuple[str, ...]]:
    """The views of a folder in order, and notes; a gap, a double or a name without a number raises
    :class:`PictureError`."""
    if (folder / MANIFEST).exists():
        rule = "its pictures have one pixel for every lens"
        raise PictureError("is a folder of integral views", where=str(folder), rule=rule, fix="compose it")
    by_number, rows = middle_row(places_of_views(list_views(folder, READ)))
    first = min(by_number)
    notes: tuple[str, ...] = ()
    if missing := _first_missing(by_number, first):
        raise PictureError(f"view {missing} is missing", where=str(folder), rule=f"views run to {max(by_number)}")
    if rows > 1:
        notes += (f"of {rows} rows of cameras the middle one is taken: the views of a quilt stand side by side",)
    if first > 1:
        notes += (f"views are numbered from {first}: that is the leftmost",)
    return [by_number[number] for number in sorted(by_number)], notes


def _first_missing(numbers: Iterable[int], first: int) -> int | None:
    for expected, number in enumerate(sorted(numbers), start=first):
        if number != expected:
            return expected
    return None


def _check_ending(path: Path) -> None:
    if path.suffix.lower() in FILMS:
        fix = "take a quilt out of it: ffmpeg -i in.mp4 -frames:v 1 out_qs8x6a0.75.png; "
        fix += "frames of a camera that moves to the right are views for 'interlace' and 'quilt pack'"
        raise PictureError("is a film", where=str(path), rule="pictures are read", fix=fix)
    if not path.suffix and not path.exists():
        raise unreadable(path, FileNotFoundError(), PictureError)
    if path.suffix.lower() not in READ:
        raise PictureError.unknown("ending", path.suffix, READ, where=str(path))


class OpenView(NamedTuple):
    """A picture file whose header is read: width and height, type of its values, their decoder, notes, text."""

    size: tuple[int, int]
    stored: Callable[[], Stored]
    read: Callable[[], Values]
    notes: tuple[str, ...]
    text: str = ""


@contextmanager
def open_view(path: Path) -> Iterator[OpenView]:
    """The opened file with its header; errors of libraries about the file become :class:`PictureError`."""
    if path.suffix.lower() not in _PHOTOGRAPHS:
        file = open_file(path)
        size = file.width, file.height
        yield OpenView(
            size, lambda: file.check_stored(file.stored), lambda: file.decode(as_srgb=True)[0], file.notes, file.text
        )
        return
    check_kind(path, PictureError)
    with report_errors(path), path.open("rb") as stream, open_photograph(stream, path, _KINDS) as photograph:
        if max(photograph.size) > MOST_SIDE:
            raise PictureError(f"it has {photograph.size[0]} x {photograph.size[1]} pixels", where=str(path))

        def codes() -> Values:
            return opaque_colors(photograph.srgb_codes(), path, on_black=True)

        yield OpenView(photograph.size, lambda: "uint8", codes, photograph.notes)
