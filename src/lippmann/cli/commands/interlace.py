"""``lippmann interlace``: photographs or frames woven for a lens sheet."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.shared import options
from lippmann.cli.shared.command_options import with_options, without
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.scene_source import PRINT, output_of, print_of, sheet_of
from lippmann.errors import UsageError
from lippmann.options.option import changed_options, flag_of
from lippmann.options.prints import FinishOptions, PrintOptions

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.quilts.photos import Shift

FitOption = Annotated[
    Literal["cover", "contain", "stretch"] | None,
    typer.Option(
        "--fit",
        help="cover: crop; contain: leave white paper; stretch: change proportions. "
        "Default: cover, of photographs of one size; a quilt must have the display's shape.",
    ),
]


@with_options
def interlace(
    photos: Annotated[
        list[Path],
        typer.Argument(help="Photographs, in natural order, stereo pairs, an animation or a film; or their folder."),
    ],
    output: options.OptionalOutput = None,
    display: Annotated[
        str | None,
        typer.Option("--display", "-d", help="A lenticular display in place of a print, such as lkg-portrait."),
    ] = None,
    lenses: Annotated[
        Literal["along", "across"],
        typer.Option("--lenses", help="along: upright lenses; across: lying lenses, for flips."),
    ] = "along",
    views: Annotated[
        Literal["nearest", "linear"] | None,
        typer.Option(
            "--views",
            help="nearest: one photograph per pixel; linear: a mixture of two. "
            "Default: linear, nearest for two photographs and for lenses across.",
        ),
    ] = None,
    reverse: Annotated[bool, typer.Option("--reverse", help="Take the photographs in reverse order.")] = False,
    fit: FitOption = None,
    shift: Annotated[
        str | None,
        typer.Option(
            "--shift",
            help="Move each photograph against the one before, to choose the plane without "
            "parallax: 12px of the photographs, or 0.4mm on the print; to the right, or down for lenses "
            "across.",
        ),
    ] = None,
    icc: Annotated[
        Path | None,
        typer.Option(
            "--icc",
            help="Of a print: convert to this ICC profile (RGB). Default: the photographs' own is kept.",
            show_default=False,
        ),
    ] = None,
    correct: options.Correct = "none",
    headroom: options.Headroom = 0.0,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    printed: PrintOptions,
    finishing: Annotated[FinishOptions, without("icc")],
) -> None:
    """Interlace photographs or frames for a lenticular print or display.

    A print needs --lpi (or --print-lpi), --ppi and --size; a panel --display alone.
    """
    from lippmann.calibration.finish import NO_FINISH
    from lippmann.quilts.interlace import check_interlaced_path, view_size, write_interlaced
    from lippmann.quilts.photos import natural_order, read_photos
    from lippmann.quilts.view_names import line_of_grid
    from lippmann.quilts.weave import check_weavable, usual_choice

    console, across = Console(quiet, as_json), lenses == "across"
    target, asked_finish = sheet_of(_display(display, printed, turned=across), replace(finishing, icc=icc))
    output = output_of(output, photos[0], "-native.tif" if target.sheet else "-native.png")
    check_interlaced_path(output)
    check_weavable(target)  # before the photographs are read
    finish = asked_finish or NO_FINISH
    paths, of_grid = line_of_grid(natural_order(_pictures(photos)), down=across)
    if reverse:
        paths.reverse()
    with console.progress() as progress:
        read = read_photos(
            paths,
            view_size(target),
            target.size_mm,
            fit=fit,
            shift=_shift(shift),
            turned=across,
            profile=finish.profile,
            keeps_profile=target.sheet is not None,
            progress=progress,
        )
        console.remark(*of_grid, *read.notes, *fit_note(read.cropped[::-1] if across else read.cropped, fit))
        choice = views or ("nearest" if across else usual_choice(read.quilt))
        pixels, notes = write_interlaced(
            read,
            target,
            output,
            lenses=lenses,
            choice=choice,
            correct=correct,
            headroom=headroom,
            scene=paths[0].stem,
            finish=finish,
            progress=progress,
        )
    console.remark(*notes)
    result: dict[str, Any] = {
        "output": str(output),
        "size": list(pixels),
        "ppi": 25.4 / target.panel.pixel_pitch,
        "photos": [str(path) for path in paths],
        "fit": fit or "cover",
        "lenses": lenses,
        "view_choice": choice,
        "correct": correct,
        "pixels_per_lens": target.pixels_per_lens[0],
    }
    count = read.quilt.layout.views
    names = paths[0].name if len(paths) == 1 else f"{paths[0].name} to {paths[-1].name}"
    line = f"{output}: {count} photographs, {names}, on {pixels[0]}x{pixels[1]} pixels"
    console.result(result, f"{line}, {target.pixels_per_lens[0]:.4g} a lens")


def _display(name: str | None, printed: PrintOptions, *, turned: bool) -> Display:
    """The display, or the print; lying on its side if ``turned``."""
    if name in (None, PRINT):
        sheet = print_of(printed)
        return (replace(sheet, size=sheet.size[::-1]) if turned else sheet).display()
    for option in (*changed_options(printed), *(("lenses",) if turned else ())):
        rule = f"it applies to prints, and --display {name} is given"
        raise UsageError("does not apply", where=flag_of(option), rule=rule)
    from lippmann.display import load_display

    return load_display(name)


def _pictures(photos: list[Path]) -> list[Path]:
    """The photographs; a folder stands for its pictures, and a pattern that no shell resolved for its files."""
    from glob import glob  # as below: not for --help

    from lippmann.quilts.photos import ENDINGS

    paths: list[Path] = []
    for path in photos:
        if path.is_dir():
            paths += [file for file in path.iterdir() if file.suffix.lower() in ENDINGS and file.name[0] != "."]
        elif "*" in path.name and not path.exists():
            paths += [Path(name) for name in glob(str(path))] or [path]
        else:
            paths.append(path)
    return paths


def _shift(text: str | None) -> Shift:
    from lippmann.quilts.photos import Shift

    if text is None:
        return Shift()
    match = re.fullmatch(r"([+-]?\d{1,6}(?:\.\d{1,9})?)\s*(px|mm)", text.strip())
    if match is None:
        rule = "must be a number with its unit: 12px of the photographs, or 0.4mm on the print"
        raise UsageError(f"'{text}'", where="--shift", rule=rule)
    return Shift(float(match[1]), "mm" if match[2] == "mm" else "px")


def fit_note(cropped: tuple[float, float], fit: str | None) -> list[str]:
    """One line on the pictures' edges, by the shares of their width and height that are cut off."""
    if fit == "stretch":
        return ["the pictures are stretched to the panel's proportions"]
    parts = [
        f"{100 * part:.0f} % of the {side}"
        for part, side in zip(cropped, ("width", "height"), strict=True)
        if part >= 0.005
    ]
    return [f"{fit or 'cover'}: {' and '.join(parts)} of the pictures is cut off"] if parts else []
