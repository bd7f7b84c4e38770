"""The proof of a display as one page with plots: HTML, PDF or PNG."""

from __future__ import annotations

import html
import math
import textwrap
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lippmann._version import VERSION
from lippmann.display.display import Display
from lippmann.errors import OutputError
from lippmann.optics.crosstalk import ANNOYING, VISIBLE, crosstalk, independent_directions
from lippmann.optics.directions import true_directions
from lippmann.optics.lens import Lens, Real
from lippmann.optics.light_table import light_table
from lippmann.optics.proof import Proof, edge_slope, is_print, zone_of
from lippmann.runtime.atomic_write import check_writable, replacing
from lippmann.runtime.plotting import plain_matplotlib, svg_of
from lippmann.wording import html_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase

ENDINGS = (".html", ".pdf", ".png")

#: A4 in inches, the height that the plots take of it, and the letters of a line of text.
_PAGE, _PLOTS, _LINE = (8.27, 11.69), 6.2, 92

#: Angles of a plot, and most strips a lens.
_ANGLES, _STRIPS = 81, 32

#: Farthest distance of a plot, in viewing distances or, where views are parallel, in nearest distances.
_FAR = 3.0


def check_proof_page(path: Path) -> None:
    """Raise :class:`OutputError` unless ``path`` is a page that can be written."""
    if path.suffix.lower() not in ENDINGS:
        rule = f"the page of a proof ends in {', '.join(ENDINGS)}"
        raise OutputError(f"the ending is '{path.suffix}'", where=str(path), rule=rule)
    check_writable(path)


def write_proof_page(proof: Proof, display: Display, path: Path) -> None:
    """Write the proof of a display with its plots; the ending of ``path`` names the format.

    Raises
    ------
    OutputError
        If the format is another, or the file cannot be written.
    """
    check_proof_page(path)
    ending = path.suffix.lower()
    with plain_matplotlib(salt="proof"), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # letters that the font lacks are drawn as boxes
        from matplotlib.figure import Figure

        with replacing(path) as temporary:
            if ending == ".html":
                figure = Figure(figsize=(_PAGE[0] + 1.0, _PLOTS), layout="constrained")
                _draw_plots(figure, display)
                temporary.write_text(_page(proof, figure), encoding="utf-8")
            else:
                figure = Figure(figsize=_PAGE, layout="constrained")
                parts = np.asarray(figure.subfigures(2, 1, height_ratios=(_PAGE[1] - _PLOTS, _PLOTS)))
                _write_facts(parts[0], proof)
                _draw_plots(parts[1], display)
                metadata = {"CreationDate": None} if ending == ".pdf" else {"Software": f"Lippmann {VERSION}"}
                figure.savefig(temporary, format=ending[1:], dpi=130, metadata=metadata)


def _page(proof: Proof, figure: Figure) -> str:
    title = html.escape(f"Proof of {proof.display}")
    style = "body{font-family:sans-serif;max-width:60em;margin:2em auto}th,td{padding:.2em .8em;vertical-align:top}"
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{style}</style>'
        f"<h1>{title}</h1>{html_table('', proof.in_words())}{svg_of(figure)}"
        f"<p>Lippmann {VERSION}</p></html>\n"
    )


def _write_facts(text: FigureBase, proof: Proof) -> None:
    text.text(0.06, 0.95, "Proof of the display", size=14, weight="bold", va="top")
    y = 0.86
    for name, value in proof.in_words().items():
        lines = textwrap.wrap(value, _LINE)
        text.text(0.06, y, name, size=8, color="0.35", va="top")
        text.text(0.2, y, "\n".join(lines), size=8, va="top", parse_math=False)
        y -= 0.055 + 0.035 * (len(lines) - 1)


def _draw_plots(figure: FigureBase, display: Display) -> None:
    axes = figure.subplots(2, 2)
    edge = math.degrees(math.atan(edge_slope(display)))
    angles = np.linspace(-1.25 * edge, 1.25 * edge, _ANGLES)
    _draw_directions(axes[0, 0], display, angles)
    _draw_crosstalk(axes[0, 1], display, angles, edge)
    _draw_zone(axes[1, 0], display)
    (_draw_strips if is_print(display) else _draw_depth)(axes[1, 1], display)


def _draw_directions(axes: Axes, display: Display, angles: Real) -> None:
    pitch = display.lens_array.pitch
    half = 0.5 * display.micro_image_pitch
    if display.lens is None:
        axes.plot([-half / pitch, half / pitch], np.degrees(np.arctan([half / display.gap, -half / display.gap])))
    else:
        finely = np.linspace(angles[0], angles[-1], 5 * _ANGLES)
        table = light_table(Lens.of(display), np.tan(np.radians(finely)), places_per_lens=192)
        span = 0.5 * len(table.places) * (table.edges[1] - table.edges[0]) / pitch
        extent = (-span, span, float(angles[0]), float(angles[-1]))
        axes.imshow(table.shares**0.5, origin="lower", aspect="auto", cmap="Greys", extent=extent)
        directions = true_directions(Lens.of(display))
        own = np.abs(directions.places) <= half
        axes.plot(directions.places[own] / pitch, np.degrees(np.arctan(directions.slopes[own])), color="tab:red")
    axes.set(title="where light comes from", xlabel="place under the lens (pitches)", ylabel="direction (degrees)")
    axes.set(xlim=(-1, 1), xticks=(-1, -0.5, 0, 0.5, 1))


def _draw_crosstalk(axes: Axes, display: Display, angles: Real, edge: float) -> None:
    shares = [100 * crosstalk(display, float(slope)) for slope in np.tan(np.radians(angles))]
    axes.plot(angles, shares, color="tab:red")
    for mark, name in ((VISIBLE, "visible above"), (ANNOYING, "annoying above")):
        axes.axhline(100 * mark, color="0.6", linestyle="--")
        axes.text(float(angles[0]), 100 * mark, f"{name} {100 * mark:g} %", size=7, va="bottom", color="0.4")
    axes.axvspan(-edge, edge, color="tab:green", alpha=0.1)
    axes.set(title="crosstalk", xlabel="direction (degrees)", ylabel="%", ylim=(0, 1.1 * max(10.0, *shares)))


def _draw_zone(axes: Axes, display: Display) -> None:
    zone = zone_of(display)
    far = _FAR * (display.viewing_distance if math.isfinite(display.viewing_distance) else zone.nearest)
    distances = np.linspace(0.0, far, 400)
    half = np.array([0.5 * zone.width_at(float(distance)) for distance in distances])
    axes.fill_between(distances, -half, half, color="tab:green", alpha=0.3)
    axes.plot([0, 0], [-0.5 * zone.screen, 0.5 * zone.screen], color="black", linewidth=3)
    if math.isfinite(display.viewing_distance):
        axes.axvline(display.viewing_distance, color="0.6", linestyle="--")
    axes.set(title="where an eye sees the whole picture", xlabel="distance (mm)", ylabel="sideways (mm)")


def _draw_strips(axes: Axes, display: Display) -> None:
    strips = np.arange(2, _STRIPS + 1)
    axes.plot(strips, [100 * crosstalk(display, 0.0, int(count)) for count in strips], color="tab:red")
    axes.axhline(100 * ANNOYING, color="0.6", linestyle="--")
    axes.axvline(display.pixels_per_lens[0], color="tab:blue", linestyle=":")
    axes.set(title="crosstalk straight ahead", xlabel="strips a lens (dotted: this print's pixels)", ylabel="%")


def _draw_depth(axes: Axes, display: Display) -> None:
    width = display.micro_image_pitch / independent_directions(display)
    limit = display.lens_array.pitch * display.gap / width
    depths = np.linspace(-2 * limit, 2 * limit, 101)
    axes.plot(depths, np.abs(depths) * width / display.gap / display.lens_array.pitch, color="tab:red")
    axes.axhline(1.0, color="0.6", linestyle="--")
    axes.set(title="spread of one direction's light", xlabel="depth (mm)", ylabel="lenses")
