"""The scene, the display, the sheet and the output that a command names, with what its options say of them."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.errors import DisplayError, LippmannError, OutputError, UsageError
from lippmann.options.light import LightOptions
from lippmann.options.option import changed_options, flag_of
from lippmann.options.outputs import AccessOptions
from lippmann.options.prints import FinishOptions, PrintOptions
from lippmann.options.scene import SceneOptions

if TYPE_CHECKING:
    from lippmann.calibration.finish import Finish
    from lippmann.display import Display
    from lippmann.display.formats.print_sheet import Print
    from lippmann.scene.scene import Scene

#: The word for a display that the options of a print describe.
PRINT = "print"


@dataclass(frozen=True)
class SceneSource:
    """A scene's file or name, and the options that change what is read of it."""

    name: str
    asked: SceneOptions
    light: LightOptions
    access: AccessOptions

    def load(self) -> Scene:
        """The scene.

        Raises
        ------
        SceneError
            As :func:`lippmann.load_scene`.
        """
        from lippmann.scene.readers.load import read_scene

        return read_scene(self.name, self.asked, self.light, allow_outside=self.access.allow_outside)

    def load_timed(self) -> tuple[Scene, float]:
        """The scene, and the seconds that loading it took; errors as :meth:`load`."""
        started = time.perf_counter()
        return self.load(), time.perf_counter() - started


def print_of(printed: PrintOptions) -> Print:
    """The print that the options describe.

    Raises
    ------
    DisplayError
        If a value is missing or invalid; names the option.
    """
    from lippmann.display.formats.print_sheet import print_of_texts

    try:
        return print_of_texts({key.replace("_", "-"): text for key, text in changed_options(printed).items()})
    except DisplayError as error:
        raise DisplayError(error.what, where=f"--{error.where}", rule=error.rule, fix=error.fix) from None


def display_of(name: str, printed: PrintOptions) -> Display:
    """The display ``name``; ``print`` is described by its options.

    Raises
    ------
    DisplayError
        If the display is unknown, or a print option is missing or invalid.
    UsageError
        If print options are given for another display.
    """
    from lippmann.display import load_display

    if name == PRINT:
        return print_of(printed).display()
    for key in changed_options(printed):
        rule = f"it applies to --display {PRINT} only"
        raise UsageError(f"does not apply to the display {name}", where=flag_of(key), rule=rule)
    return load_display(name)


def planned_display(name: str, printed: PrintOptions) -> tuple[Display, tuple[int, int] | None]:
    """The display ``name``, and the size in pixels of an eye-tracked monitor's pair where ``printed`` says it.

    Raises
    ------
    DisplayError, UsageError
        As :func:`display_of`.
    PictureError
        If the size has not the shape of a pair.
    """
    if printed.size is None or name == PRINT:
        return display_of(name, printed), None
    display = display_of(name, replace(printed, size=None))
    if display.stereo is None:
        return display_of(name, printed), None  # which refuses the size
    from lippmann.cli.shared import parse
    from lippmann.quilts.quilt import quilt_of_display

    pair = quilt_of_display(display, size=parse.size(printed.size, "--size"))
    return display, (pair.width, pair.height)


def sheet_of(display: Display, finishing: FinishOptions, *, in_frames: bool = False) -> tuple[Display, Finish | None]:
    """The display with its bleed, and what is done to its picture afterwards; None for nothing.

    Raises
    ------
    UsageError
        If an option is given for a display that is no print or for frames of a moving scene, or a length is out of
        range.
    PictureError
        If the profile cannot be used.
    """
    asked = [flag_of(name) for name in changed_options(finishing)]
    if not asked:
        return display, None
    if display.sheet is None:
        rule = f"it applies to prints only: --display {PRINT}"
        raise UsageError(f"does not apply to the display {display.name}", where=asked[0], rule=rule)
    if in_frames:
        raise UsageError("does not apply to frames of a moving scene", where=asked[0], fix="leave it out")
    from lippmann.calibration.finish import Finish
    from lippmann.codecs.icc import read_profile
    from lippmann.display.sheet_layout import with_bleed
    from lippmann.display.validation import length

    bleed, marks, icc = finishing.bleed, finishing.marks, finishing.icc
    display = with_bleed(display, 0.0 if bleed is None else length(bleed, "--bleed", unit=""))
    margin = None if marks is None else length(marks, "--marks", unit="")
    finish = Finish(margin, finishing.mirror, None if icc is None else read_profile(icc))
    finish.display(display)  # which checks the margin
    return display, finish


def output_of(given: Path | None, source: str | Path, ending: str) -> Path:
    """The file to write: ``given``, or in the working folder the source's name with ``ending``, such as ``-seen.png``.

    The picture of a photograph ``photo.png`` in this folder is ``photo-native.png``.

    Raises
    ------
    OutputError
        There is such a file already, and it is no picture of this program's.
    """
    if given is not None:
        return given
    name = Path(source)
    # Folders of views are named after their quilts, such as chair_qs8x6a0.75-views.
    stem = (name.name if name.is_dir() and name.suffix != ".zarr" else name.stem) or "picture"
    # A dot would make the folder's name that of a file.
    path = Path(f"{stem.replace('.', '-') if ending == '-frames' else stem}{ending}")
    # With a word in its name the file is this program's; a model's plain name may be that of its texture.
    if ending.startswith(".") and path.exists() and not _is_ours(path):
        if os.path.exists(source) and path.samefile(source):
            return path.with_stem(f"{path.stem}-native")
        raise OutputError(
            "exists, and is no picture that Lippmann wrote", where=str(path), fix="name another file: -o FILE"
        )
    return path


def _is_ours(path: Path) -> bool:
    from lippmann.image import open_file

    try:
        return open_file(path).metadata is not None
    except LippmannError:
        return False
