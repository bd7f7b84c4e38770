"""The measured figures as tables for other programs: CSV, and LaTeX with ``booktabs``."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from lippmann.reproduce.experiment import Results
from lippmann.reproduce.tables import comparison, decibels, in_words

#: Characters with a meaning in LaTeX, escaped.
_LATEX = str.maketrans({"&": r"\&", "%": r"\%", "_": r"\_", "#": r"\#", "$": r"\$", "{": r"\{", "}": r"\}"})

HEAD = (
    "light",
    "scene",
    "method",
    "seconds",
    "time",
    "pixels traced, %",
    "rays, %",
    "mean PSNR of lenses, dB",
)


def rows_of(results: Results) -> list[tuple[str, ...]]:
    """One row of text for each way in which a scene was rendered, under :data:`HEAD`."""
    rows: list[tuple[str, ...]] = []
    for light, part in (("cheap", results), ("physically based", results.physical)):
        for scene, runs in ({} if part is None else part.runs).items():
            for run in runs.values():
                quality = "" if run.comparison is None else decibels(comparison(run).paper.mean_psnr)
                figures = (f"{run.seconds:.4g}", in_words(run.time_share), f"{100 * run.traced_share:.1f}")
                rows.append((light, scene, run.variant.title, *figures, f"{100 * run.ray_share:.1f}", quality))
    return rows


def csv_table(rows: Sequence[Sequence[str]]) -> str:
    """The rows below :data:`HEAD`, comma-separated."""
    written = io.StringIO()
    writer = csv.writer(written, lineterminator="\n")
    writer.writerow(HEAD)
    writer.writerows(rows)
    return written.getvalue()


def latex_table(rows: Sequence[Sequence[str]]) -> str:
    """A ``tabular`` of the rows below :data:`HEAD`, for a document that uses the package ``booktabs``."""
    lines = [" & ".join(cell.translate(_LATEX) for cell in row) + r" \\" for row in (HEAD, *rows)]
    body = [
        r"\begin{tabular}{lllrrrrr}",
        r"\toprule",
        lines[0],
        r"\midrule",
        *lines[1:],
        r"\bottomrule",
        r"\end{tabular}",
    ]
    return "\n".join(body) + "\n"
