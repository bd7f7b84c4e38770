"""Photographs as views: any names, upright by their EXIF orientation, cut to the shape of a print, of one colour space.

A photograph moves against the one before by ``shift``: the plane whose things move by as much the other way then has
no parallax. The part that all photographs have in common is what is fitted.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args

import numpy as np

from lippmann.codecs.icc import Profile, convert_picture
from lippmann.codecs.photograph import Photograph, open_photograph, report_errors
from lippmann.codecs.picture_notes import FileNotes
from lippmann.codecs.pillow_formats import BYTES_PER_PIXEL, open_picture
from lippmann.codecs.stereo_pairs import HEIF, PAIRS, read_pair
from lippmann.codecs.types import FILMS, Pixels
from lippmann.color.transfer import quantize
from lippmann.errors import PictureError, UsageError
from lippmann.image.read import MOST_PIXELS
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quilts.quilt import Quilt, QuiltLayout
from lippmann.runtime.machine import check_input
from lippmann.runtime.regular_file import check_kind, unreadable

if TYPE_CHECKING:
    from PIL import Image

Fit = Literal["cover", "contain", "stretch"]

#: Endings of the pictures in a folder of photographs.
ENDINGS = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".avif", ".bmp", ".ppm", ".gif", ".tga", *PAIRS, *HEIF)

#: Endings of files that may hold several frames.
_ANIMATIONS = (".gif", ".webp", ".png", ".avif", *FILMS)

#: The code of white paper.
_PAPER = 255


class Shift(NamedTuple):
    """Displacement of each photograph against the one before, to the right (down for lenses across).

    Attributes
    ----------
    amount:
        The displacement; negative to the left.
    unit:
        ``px``, pixels of the photographs, or ``mm`` on the print.
    """

    amount: float = 0.0
    unit: Literal["px", "mm"] = "px"


NO_SHIFT = Shift()


@dataclass(frozen=True)
class Photos:
    """Photographs as views.

    Parameters
    ----------
    quilt:
        The views in one row, 8-bit codes.
    icc:
        ICC profile of the codes; empty: sRGB.
    cropped:
        Fraction of a photograph's width and of its height that is cut off, 0 to 1; the largest of all photographs.
    notes:
        What was decided, each in one line.
    """

    quilt: Quilt
    icc: bytes
    cropped: tuple[float, float]
    notes: tuple[str, ...]


def natural_order(paths: Iterable[Path]) -> list[Path]:
    """Paths in natural order: numbers in names count as numbers, ``frame2`` before ``frame10``; case does not count."""

    def key(path: Path) -> tuple[list[tuple[int, int, str]], str]:
        parts = re.findall(r"\d+|\D+", str(path))
        return [(0, int(part), "") if part.isdecimal() else (1, 0, part.casefold()) for part in parts], str(path)

    return sorted(paths, key=key)


def read_photos(
    paths: Sequence[Path],
    size: tuple[int, int],
    paper: tuple[float, float],
    *,
    fit: Fit | None = None,
    shift: Shift = NO_SHIFT,
    turned: bool = False,
    profile: Profile | None = None,
    keeps_profile: bool = True,
    progress: ProgressCallback = silent,
) -> Photos:
    """Read photographs as views of a print.

    Parameters
    ----------
    paths:
        The photographs, at least 2, in the order of the views; a file of a stereo pair (JPS, MPO, HEIF) is two, and
        one animation (GIF, WebP, PNG, AVIF) or film alone is its frames.
    size:
        Largest width and height of a view in pixels.
    paper:
        Width and height of the print in mm.
    fit:
        ``cover`` crops what is too long, ``contain`` leaves white paper, ``stretch`` changes the proportions. None:
        ``cover``, and all photographs must have one size.
    shift:
        Displacement of each photograph against the one before.
    turned:
        Whether photographs are turned by 90 degrees to the left first, for lenses across; ``size``, ``paper`` and
        ``shift`` are those of turned photographs.
    profile:
        ICC profile to which all photographs are converted. None: the photographs' own.
    keeps_profile:
        Whether the photographs' own profile is kept; photographs of several profiles become sRGB in any case.
    progress:
        Called after every photograph.

    Raises
    ------
    UsageError
        If there are fewer than 2 photographs, the fit is unknown, or the shift leaves nothing in common.
    PictureError
        If a file is missing, damaged or no picture, a profile cannot be used, or photographs differ in size and no fit
        is given.
    """
    sources = [source for path in paths for source in _views_in(path)]
    if len(sources) == 1 and paths[0].suffix.lower() in _ANIMATIONS:
        sources = _frames_of(paths[0])
    if len(sources) < 2:
        what = "one photograph is given" if sources else "no photographs are given"
        rule = f"at least 2 are interlaced, of {', '.join(ENDINGS)}"
        fix = (
            "weave two that stand in it: lippmann weave --layout 2x1, or 1x2 with the left one on top; "
            "show one with a depth map by 'lippmann render'"
            if sources
            else ""
        )
        raise UsageError(what, rule=rule, fix=fix or "weave views of other formats")
    if fit is not None and fit not in get_args(Fit):
        raise UsageError.unknown("fit", fit, get_args(Fit), parameter="fit")
    headers = [_header(source) for source in sources]
    sizes = [header.size[::-1] if turned else header.size for header in headers]
    for source, header in zip(sources, headers, strict=True):
        if fit is None and header.size != headers[0].size:
            rule = f"{sources[0].path.name} has {headers[0].size[0]} x {headers[0].size[1]}"
            what = f"has {header.size[0]} x {header.size[1]} pixels"
            raise PictureError(what, where=str(source.path), rule=rule, fix='say fit="cover" to fit each by itself')
    windows = [
        fit_window(size, paper, number, len(sources), fit or "cover", shift) for number, size in enumerate(sizes)
    ]
    width, height = size[0], min(size[1], max(1, max(round(window.box[3] - window.box[1]) for window in windows)))
    if width * height * len(sources) > MOST_PIXELS:
        rule = f"together they have at most {MOST_PIXELS} pixels"
        raise PictureError(
            f"{len(sources)} views of {width} x {height} pixels", rule=rule, fix="take fewer photographs"
        )
    target, notes = _common_profile(headers, profile, keeps_profile)
    values = np.empty((height, width * len(sources), 3), dtype=np.uint8)
    quilt = Quilt(values, QuiltLayout(len(sources), 1, None), "uint8")
    for number, source in enumerate(sources):
        with _open_source(source) as photograph:
            colors = _in_profile(_on_paper(photograph.codes(), turned=turned), headers[number].icc, target, source.path)
            quilt.view_values(number)[...] = np.asarray(_fit(colors, windows[number], (width, height)))
        progress(Progress("read", number + 1, len(sources)))
    cropped = tuple(max(window.cropped[axis] for window in windows) for axis in (0, 1))
    of_files = FileNotes()
    for source, header in zip(sources, headers, strict=True):
        of_files.add(source.path.name, header.notes)
    return Photos(quilt, target, (cropped[0], cropped[1]), notes + of_files.lines())


def quilt_of_pair(path: Path, *, half: bool = False) -> Quilt:
    """The two views of a stereo pair in one file (JPS, MPO, HEIF), the left one first, in sRGB.

    The right view is fitted to the size of the left one; ``half`` halves the width of both.

    Raises
    ------
    PictureError
        The file is missing, damaged or holds one picture.
    """
    sources = _views_in(path)
    if len(sources) < 2:
        what, fix = "holds no stereo pair", ""
        if path.suffix.lower() in HEIF:
            from lippmann.scene.readers.heif import has_depth

            if has_depth(path):
                what, fix = "is a photograph with depth, no stereo pair", "show it by 'lippmann render'"
        elif path.suffix.lower() in FILMS:
            fix = "frames of a film are views for 'interlace' and 'quilt pack'; spatial ones need FFmpeg 7.1 (PyAV 14)"
        raise PictureError(what, where=str(path), rule="a pair is two views that are marked as such", fix=fix)
    (width, height), second = (_header(source).size for source in sources)
    size = (width + 1) // 2 if half else width, height
    read = read_photos([path], size, (width, height), fit="cover", keeps_profile=False)
    fitted = () if second == (width, height) else ("its views differ in size: the right one is fitted to the left one",)
    layout = QuiltLayout(2, 1, width / height if half else None)
    return replace(read.quilt, layout=layout, notes=fitted + read.notes)


class _Source(NamedTuple):
    """A photograph in a file of its own, or a ``view`` of the pair in the file."""

    path: Path
    view: Photograph | None = None


def _views_in(path: Path) -> list[_Source]:
    """The photograph of a file; of a stereo pair both views, the left one first."""
    check_kind(path, PictureError)
    if not path.exists():
        raise unreadable(path, FileNotFoundError(), PictureError)
    with report_errors(path):
        if path.suffix.lower() in HEIF:
            from lippmann.scene.readers.heif import read_heif_pair

            pair = read_heif_pair(path)
        else:
            pair = read_pair(path)
    return [_Source(path)] if pair is None else [_Source(path, view) for view in pair]


def _frames_of(path: Path) -> list[_Source]:
    """The frames of an animation or film."""
    if path.suffix.lower() in FILMS:
        from lippmann.codecs.film_views import read_frames

        return [_Source(path, frame) for frame in read_frames(path)]
    with report_errors(path), open_picture(path) as picture:
        count, (width, height) = getattr(picture, "n_frames", 1), picture.size
        check_input(
            BYTES_PER_PIXEL * width * height * count, f"{count} pictures of {width} x {height}", where=str(path)
        )
        return [_Source(path, Photograph.of_frame(picture, number)) for number in range(count)]


class _Header(NamedTuple):
    """Width and height of an upright photograph, its ICC profile (empty: sRGB), and what of it is not shown."""

    size: tuple[int, int]
    icc: bytes
    notes: tuple[str, ...]


class FitWindow(NamedTuple):
    """The rectangle of a photograph that becomes a view, and the part of it that is shown; left, top, right, bottom.

    ``cropped`` is the fraction of the photograph's width and height outside it.
    """

    box: tuple[float, float, float, float]
    visible: tuple[float, float, float, float]
    cropped: tuple[float, float]


def fit_window(
    size: tuple[float, float], paper: tuple[float, float], number: int, count: int, fit: Fit, shift: Shift
) -> FitWindow:
    """The window of photograph ``number`` of ``count`` that becomes a view; ``size`` and ``paper`` in any units."""
    width, height = size
    steps, in_mm = count - 1, shift.unit == "mm"
    pixels = 0.0 if in_mm else abs(shift.amount) * steps
    # Pixels of the photograph per mm of paper at which the common part is as wide as the paper, and as high.
    across = (width - pixels) / (paper[0] + (abs(shift.amount) * steps if in_mm else 0.0))
    down = height / paper[1]
    scales = {"cover": (min(across, down),) * 2, "contain": (max(across, down),) * 2, "stretch": (across, down)}[fit]
    step = shift.amount * (scales[0] if in_mm else 1.0)
    common = width - abs(step) * steps
    if common < 1:
        rule = f"{count} photographs of {width} pixels have nothing in common then"
        raise UsageError(f"{shift.amount:g}{shift.unit} is too far", parameter="shift", rule=rule)
    x, y = width / 2 + step * (steps / 2 - number), height / 2
    half = paper[0] * scales[0] / 2, paper[1] * scales[1] / 2
    box = x - half[0], y - half[1], x + half[0], y + half[1]
    visible = (
        max(box[0], x - common / 2, 0.0),
        max(box[1], 0.0),
        min(box[2], x + common / 2, float(width)),
        min(box[3], float(height)),
    )
    return FitWindow(box, visible, (1 - (visible[2] - visible[0]) / width, 1 - (visible[3] - visible[1]) / height))


def _fit(picture: Image.Image, window: FitWindow, size: tuple[int, int]) -> Image.Image:
    """The window of a picture as a view of ``size``, on white paper."""
    from PIL import Image

    left, top, right, bottom = window.box
    scale = size[0] / (right - left), size[1] / (bottom - top)
    edges = [round((edge - (left, top)[k % 2]) * scale[k % 2]) for k, edge in enumerate(window.visible)]
    part = max(1, edges[2] - edges[0]), max(1, edges[3] - edges[1])
    resized = picture.resize(part, Image.Resampling.LANCZOS, box=window.visible)
    if part == size:
        return resized
    view = Image.new("RGB", size, (_PAPER,) * 3)
    view.paste(resized, (edges[0], edges[1]))
    return view


@contextmanager
def _open_source(source: _Source) -> Iterator[Photograph]:
    """An opened photograph; errors of Pillow become :class:`PictureError`."""
    if source.view is not None:
        yield source.view
        return
    path = source.path
    if path.suffix.lower() in HEIF:
        from lippmann.scene.readers.heif import open_heif_photograph

        with report_errors(path):
            yield open_heif_photograph(path)
        return
    with report_errors(path), path.open("rb") as file, open_photograph(file, path) as photograph:
        yield photograph


def _header(source: _Source) -> _Header:
    with _open_source(source) as photograph:
        return _Header(photograph.size, photograph.icc, photograph.notes)


def _on_paper(codes: Pixels, *, turned: bool) -> Image.Image:
    """Codes ``(H, W, 1 to 4)`` as RGB on white paper, turned to the left if ``turned``."""
    from PIL import Image

    if codes.dtype == np.uint16:
        codes = ((codes.astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
    elif codes.dtype.kind == "f":
        codes = quantize(codes, 8, "srgb")
    channels = codes.shape[2]
    if channels in (2, 4):
        alpha = codes[..., -1:].astype(np.uint32)
        codes = ((codes[..., :-1] * alpha + _PAPER * (255 - alpha) + 127) // 255).astype(np.uint8)
    picture = Image.fromarray(np.ascontiguousarray(np.broadcast_to(codes, (*codes.shape[:2], 3))))
    return picture.transpose(Image.Transpose.ROTATE_90) if turned else picture


def _common_profile(
    headers: Sequence[_Header], profile: Profile | None, keeps_profile: bool
) -> tuple[bytes, tuple[str, ...]]:
    """Profile of the print (empty: sRGB), and notes."""
    if profile is not None:
        return profile.data, (f"colours are converted to the profile {profile.name}",)
    profiles = {header.icc for header in headers}
    if len(profiles) == 1 and keeps_profile:
        return headers[0].icc, ()
    if profiles == {b""}:
        return b"", ()
    several = "several colour profiles" if len(profiles) > 1 else "a colour profile"
    return b"", (f"the photographs have {several}: they are converted to sRGB",)


def _in_profile(picture: Image.Image, source: bytes, target: bytes, path: Path) -> Image.Image:
    try:
        return convert_picture(picture, source, target)
    except PictureError as error:
        raise PictureError(error.what, where=str(path), rule=error.rule) from None
