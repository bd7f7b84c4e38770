"""The page: one self-contained HTML file, for a screen of any width, in light and dark."""

from __future__ import annotations

import math
import statistics

from markupsafe import Markup

from lippmann.reproduce import charts, tables
from lippmann.reproduce import paper_values as printed
from lippmann.reproduce.experiment import COMPARED, METHODS, Manner, Results, Variant
from lippmann.reproduce.figures import gloss_figures, missed_figures, scene_figures
from lippmann.reproduce.html import element, join, paragraph, section, table
from lippmann.reproduce.style import STYLE

TITLE = "The paper's system, measured again"

#: The manners whose figures stand at the top.
_AT_THE_TOP = (Manner.PAPER, Manner.GLOSS)

#: How a mark of a chart tells the manner by its shape and the method by its colour, in Matplotlib's words.
_MARKS = {Manner.PAPER: "o", Manner.DEFAULT: "s", Manner.GLOSS: "^"}
_COLORS = {"lens-view": "#2266b3", "interpolated": "#b8590a"}


def report_page(results: Results) -> str:
    """The whole page as HTML text; it refers to nothing outside itself."""
    sections = _sections(results)
    links = [element("li", element("a", title, href=f"#{id_}")) for id_, title, _ in sections]
    body = element(
        "body",
        element(
            "header",
            element("h1", TITLE),
            paragraph(_conditions(results), class_="soft"),
            *(_facts(results, manner) for manner in _AT_THE_TOP),
            element("nav", element("ul", *links), aria_label="contents"),
        ),
        element("main", *(section(title, *inside, id_=id_) for id_, title, inside in sections)),
    )
    head = element(
        "head",
        Markup('<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'),
        element("title", f"Lippmann: {TITLE}"),
        # A page without a picture of its own would ask the server for one.
        Markup('<link rel="icon" href="data:,">'),
        element("style", Markup(STYLE)),
    )
    return f"<!doctype html>\n{element('html', head, body, lang='en')}\n"


def _sections(results: Results) -> list[tuple[str, str, list[Markup]]]:
    first = results.experiment.scenes[0]
    return [
        ("promise", "What the paper promises", _promise(results)),
        ("display", "Table I: the display", [tables.table_1(results.experiment.display)]),
        ("time", "Table II: time", _time(results)),
        ("quality", "Table III: quality", _quality(results, first)),
        ("rays", "Rays against time", _ray_chart(results)),
        ("gloss", "What respecting gloss changes", _gloss(results)),
        ("missed", "Figures 5 to 8: missed pixels", missed_figures(results)),
        ("scenes", "Figures 9 to 13: the scenes", scene_figures(results)),
        ("method", "How it was measured", _method(results)),
    ]


def _conditions(results: Results) -> str:
    experiment = results.experiment
    made = results.full(experiment.scenes[0]).image.provenance
    panel = experiment.display.panel
    return (
        f"{', '.join(experiment.scenes)}: {panel.width} x {panel.height} pixels for {experiment.display.name}, one ray "
        f"per pixel, integrator {made.integrator}, ray depth {made.depth}. Lippmann {made.version} on {made.device}."
    )


def _facts(results: Results, manner: Manner) -> Markup:
    """Main results of interpolation in one manner."""
    runs = [results.of(scene, Variant("interpolated", manner).key) for scene in results.runs]
    qualities = [tables.comparison(run) for run in runs]
    least = min(one.paper.mean_psnr for one in qualities)
    worst = min(one.worst.psnr for one in qualities)
    entries = (
        ("of the pixels saved", _range([100 * (1 - run.traced_share) for run in runs], "%")),
        ("of the rays saved", _range([100 * (1 - run.ray_share) for run in runs], "%")),
        ("least mean PSNR of a scene", _decibels(least)),
        ("worst micro-image of all scenes", _decibels(worst)),
    )
    cards = (element("div", element("dt", text), element("dd", value)) for text, value in entries)
    heading = element("h3", f"{manner.value}: interpolation")
    return join(heading, element("dl", *cards, class_="facts"))


def _decibels(value: float) -> str:
    return f"{value:.1f} dB" if math.isfinite(value) else "no error"


def _range(values: list[float], unit: str) -> str:
    low, high = f"{min(values):.0f}", f"{max(values):.0f}"
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def _promise(results: Results) -> list[Markup]:
    """Pixels and rays that need not be traced, and what that costs each lens: the claims of the paper."""
    rows = []
    for variant in results.of_manner(Manner.PAPER):
        for scene in results.runs:
            run = results.of(scene, variant.key)
            quality = tables.comparison(run)
            rows.append(
                [
                    f"{scene}, {variant.method}",
                    tables.percent(1 - run.traced_share),
                    tables.percent(1 - run.ray_share),
                    tables.decibels(quality.paper.mean_psnr),
                    tables.decibels(quality.worst.psnr),
                ]
            )
    text = (
        "Neighbouring micro-images are nearly alike: points that were traced for one lens are shown by the next, and "
        "few pixels are left to trace, at little cost to the picture. So much of it holds here, scene by scene."
    )
    head = ("Scene", "pixels saved", "rays saved", "mean PSNR of lenses, dB", "worst lens, dB")
    return [paragraph(text), table(head, rows, caption=Manner.PAPER.value)]


def _slowdowns(results: Results) -> Markup:
    """Change in render time by each variant of reprojection, faster and slower ones alike."""
    lines = []
    for variant in COMPARED:
        shares = [results.of(scene, variant.key).time_share for scene in results.runs]
        said = dict.fromkeys((tables.in_words(min(shares)), tables.in_words(max(shares))))
        lines.append(element("li", f"{variant.title}: {' to '.join(said)}"))
    return element("ul", *lines)


def _frame(results: Results) -> str:
    panel = results.experiment.display.panel
    full = statistics.median(results.full(scene).seconds for scene in results.runs)
    return f"{panel.width} x {panel.height} pixels, {1000 * full:.0f} ms by full tracing"


def _time(results: Results) -> list[Markup]:
    low, high = printed.SAVED_PERCENT
    least, most = printed.FULL_SECONDS
    text = (
        f"The paper prints {least} to {most} s for full tracing of its scenes and {low} to {high} % saved by "
        f"interpolation. Its row of the tree says {printed.TREE_PRINTED_PERCENT} %, but the seconds beside it come to "
        f"{printed.TREE_COMPUTED_PERCENT} %. The scenes here are of the same kind and count as its own, not copies of "
        "them, and the machine is another: compare shares, not seconds."
    )
    cheap = (
        "One ray through each pixel and the light models of the paper cost a modern engine next to nothing, so that "
        "looking after points takes longer than tracing them would: every pixel is projected, ordered and checked on "
        "the way, whatever a ray costs."
    )
    parts = [
        paragraph(text),
        element("h3", f"Cheap light: {_frame(results)}"),
        paragraph(cheap),
        _slowdowns(results),
        *(tables.table_2(results, manner) for manner in Manner),
    ]
    physical = results.physical
    if physical is not None:
        samples = physical.full(physical.experiment.scenes[0]).image.provenance.spp
        costly = (
            f"Paths of physically based light, {samples} samples per pixel, on a larger frame. A pixel now costs many "
            "rays, and looking after a point what it cost before."
        )
        parts += [
            element("h3", f"Physically based light: {_frame(physical)}"),
            paragraph(costly),
            _slowdowns(physical),
            *(tables.table_2(physical, manner) for manner in Manner),
        ]
    return parts


def _quality(results: Results, scene: str) -> list[Markup]:
    text = (
        "The paper measures each micro-image by itself, on 8-bit codes, and averages the PSNR over lenses: "
        f"{printed.TEAPOT_PSNR:g} dB over {printed.TEAPOT_LENSES} lenses of its teapot. The lenses shown here are "
        "spread evenly and need not be the paper's. Its “RMSE” (equation 1) has no root: it is the mean squared error, "
        "and 13.5795 gives 36.802 dB."
    )
    return [
        paragraph(text),
        tables.table_3(results, scene),
        element("h3", f"Lens by lens: {scene}, interpolated"),
        _lens_chart(results, scene),
        element("h3", "All scenes"),
        paragraph("PSNR in dB against full tracing. Only the paper's mean is an average over lenses."),
        *(tables.quality_table(results, manner) for manner in Manner),
    ]


def _lens_chart(results: Results, scene: str) -> Markup:
    series = []
    for manner, color in zip(_AT_THE_TOP, _COLORS.values(), strict=True):
        row = tables.comparison(results.of(scene, Variant("interpolated", manner).key)).paper.psnr[0].tolist()
        series.append(charts.Series(list(enumerate(row)), ".-", color, manner.value))
    level = printed.TEAPOT_PSNR if scene == printed.TEAPOT else None
    last = results.experiment.display.lens_grid.columns - 1
    chart = charts.chart(
        series,
        ("lens", "PSNR of the micro-image, dB"),
        title=f"PSNR of every micro-image of the {scene}",
        dashed=() if level is None else [(0, level), (last, level)],
    )
    said = "" if level is None else f"Dashed: the paper's mean, {level:g} dB. "
    return join(chart, paragraph(f"{said}Gaps are micro-images without any error.", class_="soft"))


def _ray_chart(results: Results) -> list[Markup]:
    series = []
    for variant in COMPARED:
        assert variant.manner is not None
        runs = [results.of(scene, variant.key) for scene in results.runs]
        points = [(100 * run.ray_share, 100 * run.time_share) for run in runs]
        series.append(charts.Series(points, _MARKS[variant.manner], _COLORS[variant.method], variant.title))
    text = (
        "Each mark is a scene rendered in one way. On the dashed line a ray saved is its time saved; above it, looking "
        "after points costs more than the rays they spare."
    )
    titles = "rays, % of full tracing's", "seconds, % of full tracing's"
    title = "Share of rays against share of time"
    return [paragraph(text), charts.chart(series, titles, title=title, dashed=[(0, 0), (100, 100)])]


def _gloss(results: Results) -> list[Markup]:
    text = (
        "A mirror, glass or a highlight has another colour in every direction, so the colour that one lens saw is "
        "wrong for the next. The paper reuses it all the same; the mode that respects gloss traces such pixels anew."
    )
    quality_tables = (tables.gloss_table(results, method) for method in METHODS)
    return [paragraph(text), *quality_tables, *gloss_figures(results)]


def _method(results: Results) -> list[Markup]:
    experiment = results.experiment
    runs = f"the median of {experiment.runs} runs" if experiment.runs > 1 else "those of one run"
    warm = f" after {experiment.warm_up} to warm up" if experiment.warm_up else ""
    texts = (
        f"Seconds are {runs}{warm}, the ways of rendering one scene taking turns. They count tracing and reusing "
        "points: loading, building the scene, compiling kernels and writing files are left out. Every picture is "
        "compared with full tracing of the same rays.",
        "PSNR without a further word is that of the pooled mean squared error of coded values in [0, 1], all channels; "
        "the 1st percentile and the worst are of micro-images; SSIM is that of Wang et al. (2004), of each view, "
        "averaged.",
    )
    return [paragraph(text) for text in texts]
