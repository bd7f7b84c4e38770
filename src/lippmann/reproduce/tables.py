"""The paper's Tables I to III with what was measured beside what it prints."""

from __future__ import annotations

import math
from collections.abc import Sequence

from markupsafe import Markup

from lippmann.display import Display
from lippmann.metrics import Comparison
from lippmann.reproduce import paper_values
from lippmann.reproduce.experiment import COMPARED, Manner, Results, Run, Variant
from lippmann.reproduce.html import element, table

#: Stands where there is nothing to say.
NOTHING = "-"


def table_1(display: Display) -> Markup:
    """The display: the paper's, and the one rendered for."""
    panel, grid = display.panel, display.lens_grid
    across = display.pixels_per_lens[0]
    distance = "infinite" if math.isinf(display.viewing_distance) else f"{display.viewing_distance:g} mm"
    here = (
        f"{panel.width} x {panel.height} at {25.4 / panel.pixel_pitch:g} dpi",
        f"{grid.columns} cylindrical, of {across:g} pixels",
        f"{display.lens_array.pitch:.7g} mm",
        f"{display.gap:g} mm",
        f"{display.field_of_view:.1f} degrees",
        f"{display.aperture_distance:g} mm",
        distance,
        f"{paper_values.RAY_DEPTH}",
    )
    rows = [(name, value, ours) for (name, value), ours in zip(paper_values.TABLE_I, here, strict=True)]
    caption = f"The display of the experiments; here the preset {display.name}."
    return table(("", "Paper", "Here"), rows, caption=caption, wrap=True)


def table_2(results: Results, manner: Manner) -> Markup:
    """Seconds of every scene by full tracing and by the methods of one manner, and what these save."""
    variants = results.of_manner(manner)
    head = ["Scene", "s", *("s", "time", "pixels traced", "rays") * len(variants)]
    spans = [("", 1), ("full", 1), *((variant.method, 4) for variant in variants)]
    if manner is Manner.PAPER:
        head.append("interpolation saves, %")
        spans.append(("the paper", 1))
    rows = []
    for scene in results.runs:
        cells = [scene, seconds(results.full(scene).seconds)]
        for variant in variants:
            run = results.of(scene, variant.key)
            cells += [seconds(run.seconds), in_words(run.time_share)]
            cells += [percent(run.traced_share), percent(run.ray_share)]
        if manner is Manner.PAPER:
            cells.append(_printed_saving(scene))
        rows.append(cells)
    note = ""
    if manner is Manner.PAPER and paper_values.TREE in results.runs:
        note = f". * The paper's own seconds come to {paper_values.TREE_COMPUTED_PERCENT} %"
    return table(head, rows, caption=manner.value + note, spans=spans)


def _printed_saving(scene: str) -> str:
    if scene == paper_values.TREE:
        return f"{paper_values.TREE_PRINTED_PERCENT} *"
    low, high = paper_values.SAVED_PERCENT
    return f"{low} to {high}"


def lenses_of_table_3(display: Display) -> tuple[int, ...]:
    """Columns of evenly spread lenses, as many as the paper's: each the second of a pair, which the odd/even method
    interpolates."""
    columns = display.lens_grid.columns
    count = min(paper_values.TEAPOT_LENSES, columns)
    middles = (int((k + 0.5) * columns / count) for k in range(count))
    return tuple(sorted({min(column | 1, columns - 1) for column in middles}))


def table_3(results: Results, scene: str) -> Markup:
    """The paper's PSNR of some lenses of one scene, and its averages."""
    lenses = lenses_of_table_3(results.experiment.display)
    head = ("Method", *(str(lens) for lens in lenses), f"mean of {len(lenses)}", "mean of all")
    rows = []
    for variant in COMPARED:
        quality = comparison(results.of(scene, variant.key))
        row = quality.paper.psnr[0]
        cells = [float(row[lens]) for lens in lenses]
        mean = element("b", decibels(finite_mean(cells)))
        rows.append([variant.title, *map(decibels, cells), mean, decibels(quality.paper.mean_psnr)])
    if scene == paper_values.TEAPOT:
        blank = [NOTHING] * len(lenses)
        rows.append(["the paper prints", *blank, f"{paper_values.TEAPOT_PSNR:g}", NOTHING])
    caption = (
        f"PSNR in dB of micro-images of the {scene} against full tracing, by the paper's formula. Lenses are counted "
        "from 0 at the left; a micro-image without error (=) has no part in the means."
    )
    return table(head, rows, caption=caption, spans=[("", 1), ("lens", len(lenses)), ("", 2)])


def quality_table(results: Results, manner: Manner) -> Markup:
    """All scenes: the paper's mean beside the figures that show what a mean hides."""
    variants = results.of_manner(manner)
    head = ["Scene", *("paper's mean", "PSNR", "1st percentile", "worst lens", "SSIM") * len(variants)]
    rows = []
    for scene in results.runs:
        cells = [scene]
        for variant in variants:
            quality = comparison(results.of(scene, variant.key))
            figures = (quality.paper.mean_psnr, quality.psnr, quality.percentile_1.psnr, quality.worst.psnr)
            cells += [*map(decibels, figures), f"{quality.views.mean:.4f}"]
        rows.append(cells)
    spans = [("", 1), *((variant.method, 5) for variant in variants)]
    return table(head, rows, caption=manner.value, spans=spans)


def gloss_table(results: Results, method: str) -> Markup:
    """Cost and gain of respecting gloss in the default order, for one method."""
    keys = [Variant(method, manner).key for manner in (Manner.DEFAULT, Manner.GLOSS)]
    rows = []
    for scene in results.runs:
        before, after = (results.of(scene, key) for key in keys)
        rows.append(
            [
                scene,
                _change(decibels(comparison(before).psnr), decibels(comparison(after).psnr)),
                _change(decibels(comparison(before).worst.psnr), decibels(comparison(after).worst.psnr)),
                _change(percent(before.traced_share), percent(after.traced_share)),
                _change(seconds(before.seconds), seconds(after.seconds)),
            ]
        )
    head = ("Scene", "PSNR, dB", "worst lens, dB", "pixels traced", "s")
    return table(head, rows, caption=f"{method}: gloss not respected → respected, in the default order")


def comparison(run: Run) -> Comparison:
    """The comparison of a run that is not full tracing itself."""
    assert run.comparison is not None
    return run.comparison


def finite_mean(values: Sequence[float]) -> float:
    """The mean of the finite values; infinite if there are none."""
    finite = [value for value in values if math.isfinite(value)]
    return sum(finite) / len(finite) if finite else math.inf


def decibels(value: float) -> str:
    """A PSNR; ``=`` where there is no error."""
    return f"{value:.2f}" if math.isfinite(value) else "="


def percent(share: float) -> str:
    """A share in percent."""
    return f"{100 * share:.1f} %"


def seconds(value: float) -> str:
    """Seconds with three significant digits or milliseconds, whichever is coarser."""
    return f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}"


def in_words(time_share: float) -> str:
    """A share of full tracing's time: a saving in percent, or how many times as long."""
    if time_share <= 1:
        return f"{100 * (1 - time_share):.0f} % saved"
    return f"{time_share:.{1 if time_share < 10 else 0}f} times as long"


def _change(before: str, after: str) -> Markup:
    return Markup("{} <span class=soft>→</span> {}").format(before, after)
