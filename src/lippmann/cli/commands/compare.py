"""``lippmann compare`` and ``lippmann reproduce``: the error of a picture, and the paper's tables and figures."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.shared import options, parse
from lippmann.cli.shared.command_options import only, with_options
from lippmann.cli.shared.console import Console
from lippmann.errors import UsageError
from lippmann.options.quality import MachineOptions

if TYPE_CHECKING:
    from lippmann.metrics import Comparison, MicroImage


def compare(
    reference: Annotated[Path, typer.Argument(help="Reference picture: PNG, EXR, TIFF or Zarr.")],
    test: Annotated[Path, typer.Argument(help="Picture to compare, of the same display.")],
    table: Annotated[
        Path | None, typer.Option("--csv", help="Write the metrics of every micro-image to this CSV file.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--map", help="Write a map of the errors: .png, or .exr with layers.", show_default=False),
    ] = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare a picture with a reference: PSNR, worst micro-images, SSIM of views, the paper's metrics."""
    from lippmann.image import IntegralImage
    from lippmann.image.streamed import open_picture
    from lippmann.image.write import check_output
    from lippmann.metrics import compare as compare_pictures
    from lippmann.metrics import error_map
    from lippmann.runtime.atomic_write import check_writable

    console = Console(quiet, as_json)
    if picture is not None:
        check_output(picture)
    if table is not None:
        check_writable(table)
    target = parse.display(display)
    first, second = (open_picture(path, display=target) for path in (reference, test))
    if picture is not None and not (isinstance(first, IntegralImage) and isinstance(second, IntegralImage)):
        raise UsageError("needs pictures that fit in memory", where="--map", fix="leave it out")
    with console.progress() as progress:
        comparison = compare_pictures(first, second, progress)
    if table is not None:
        _write_table(comparison, table)
    if picture is not None:
        error_map(comparison).save(picture)
    console.remark(*comparison.notes)
    values = {"reference": str(reference), "test": str(test), **comparison.to_dict()}
    console.result(values, "\n".join(_lines(comparison)))


@with_options
def reproduce(
    output: options.Folder,
    quick: Annotated[
        bool, typer.Option("--quick", help="Take about a minute: two scenes, fewer pixels, one run.")
    ] = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    machine: Annotated[MachineOptions, only("device", "threads")],
) -> None:
    """Reproduce the paper's tables and figures and write a report."""
    from lippmann.reproduce.experiment import Manner, Variant
    from lippmann.reproduce.run import PAGE
    from lippmann.reproduce.run import reproduce as reproduce_paper
    from lippmann.reproduce.summary import summary
    from lippmann.reproduce.tables import comparison, in_words

    console = Console(quiet, as_json)
    with console.progress() as progress:
        results = reproduce_paper(
            output, quick=quick, device=machine.device, threads=machine.threads, progress=progress
        )
    page = output / PAGE
    lines = [f"{page}: {', '.join(results.runs)}"]
    for scene in results.runs:
        paper, gloss = (
            results.of(scene, Variant("interpolated", manner).key) for manner in (Manner.PAPER, Manner.GLOSS)
        )
        lines.append(
            f"{scene:<12} interpolated as in the paper: time {in_words(paper.time_share)}, "
            f"{_decibels(comparison(paper).paper.mean_psnr)}; gloss respected: time {in_words(gloss.time_share)}, "
            f"{_decibels(comparison(gloss).paper.mean_psnr)}"
        )
    console.result({"output": str(page), **summary(results)}, "\n".join(lines))


def _write_table(comparison: Comparison, path: Path) -> None:
    from lippmann.runtime.atomic_write import replacing

    rows = list(comparison.rows())
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _lines(comparison: Comparison) -> list[str]:
    views, paper, silhouettes = comparison.views, comparison.paper, comparison.silhouettes
    ky, kx = views.worst
    column, row, least = comparison.least_similar
    off = comparison.psnr_off_silhouettes
    source = "depths" if silhouettes.source == "depth" else "strong edges"
    lenses = int((comparison.micro_image_pixels > 0).sum())
    lines = ["the pictures are identical"] if comparison.identical else []
    lines += [
        f"PSNR                {_decibels(comparison.psnr)}",
        f"off silhouettes     {'no pixel' if off is None else _decibels(off)} "
        f"({100 * (1 - silhouettes.share):.1f} % of the pixels; silhouettes by {source})",
        f"worst micro-image   {_decibels(comparison.worst.psnr)} ({_lens(comparison.worst)} of {lenses})",
        f"1st percentile      {_decibels(comparison.percentile_1.psnr)} ({_lens(comparison.percentile_1)})",
        f"SSIM of lenses      {comparison.mean_similarity:.4f}, worst {least:.4f} (lens {column}, {row})",
        f"SSIM of views       {views.mean:.4f}, worst {views.values[ky, kx]:.4f} (view {kx}, {ky})",
        _flicker_line(comparison),
        f"the paper's PSNR    {_decibels(paper.mean_psnr)}, mean of micro-images"
        + (f" ({paper.unchanged} without error left out)" if paper.unchanged else ""),
        f'the paper\'s "RMSE"  {paper.mean_rmse:.4f}, mean of micro-images (a mean squared error of 8-bit codes)',
    ]
    return lines


def _flicker_line(comparison: Comparison) -> str:
    flicker = comparison.flicker
    if flicker is None:
        return "flicker of views    one view only"
    return f"flicker of views    {_decibels(flicker.psnr)} ({flicker.share:.2f} of the error changes from view to view)"


def _decibels(value: float) -> str:
    return "infinite" if math.isinf(value) else f"{value:.2f} dB"


def _lens(micro_image: MicroImage) -> str:
    return f"lens {micro_image.column}, {micro_image.row}"
