"""One call from the bundled scenes to the report."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

from lippmann.display import Display, load_display
from lippmann.image import IntegralImage
from lippmann.progress import ProgressCallback, silent
from lippmann.reproduce import paper_values
from lippmann.reproduce.experiment import Experiment, Renderer, Results, Variant, run_experiment
from lippmann.reproduce.page import report_page
from lippmann.reproduce.summary import summary
from lippmann.reproduce.table_files import csv_table, latex_table, rows_of
from lippmann.runtime.atomic_write import check_folder_writable, replacing_folder
from lippmann.scene import bundled
from lippmann.scene.readers.load import load_scene
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.options.choices import Device, Method, Order

#: Files that :func:`reproduce` writes.
PAGE, FIGURES = "report.html", "results.json"
TABLE_CSV, TABLE_LATEX = "results.csv", "results.tex"

#: The quick version: two scenes, one with highlights and one of mirrors, on a smaller panel.
QUICK_SCENES = ("teapot", "small-balls")
QUICK_SIZE = (256, 256)

#: Physically based light: a scene that has such a form, paths of so many surfaces, on a frame of so many pixels.
PHYSICAL_SCENES = ("teapot",)
PHYSICAL_DEPTH, PHYSICAL_SAMPLES = 8, 4
PHYSICAL_SIZE, PHYSICAL_QUICK_SIZE = (1024, 1024), (256, 128)


def reproduce(
    folder: Path,
    *,
    quick: bool = False,
    device: str = "auto",
    threads: int | None = None,
    progress: ProgressCallback = silent,
) -> Results:
    """Render the paper's scenes in all ways, compare them, and write the report and its figures into ``folder``.

    Parameters
    ----------
    folder:
        Where ``report.html``, ``results.json``, ``results.csv`` and ``results.tex`` go. It appears whole or not at all.
    quick:
        Fewer scenes, fewer pixels, one run.
    device, threads:
        As in :class:`~lippmann.rendering.request.render_request.RenderRequest`.

    Returns
    -------
    Results
        All runs; :func:`~lippmann.reproduce.summary.summary` gives the figures that are written.

    Raises
    ------
    OutputError
        If the folder cannot be written; found before anything is rendered.
    EngineError
        If the machine cannot render.
    """
    check_folder_writable(folder)
    experiment, physical = make_experiment(quick=quick), make_physical_experiment(quick=quick)
    results = run_experiment(experiment, engine_renderer(experiment.display, device, threads), progress)
    renderer = engine_renderer(physical.display, device, threads, physical=True)
    results = replace(results, physical=run_experiment(physical, renderer, progress))
    rows = rows_of(results)
    with replacing_folder(folder) as temporary:
        (temporary / PAGE).write_text(report_page(results), encoding="utf-8")
        text = json.dumps(summary(results), indent=2, ensure_ascii=False, allow_nan=False)
        (temporary / FIGURES).write_text(text + "\n", encoding="utf-8")
        (temporary / TABLE_CSV).write_text(csv_table(rows), encoding="utf-8")
        (temporary / TABLE_LATEX).write_text(latex_table(rows), encoding="utf-8")
    return results


def make_experiment(*, quick: bool) -> Experiment:
    """The paper's scenes on its display; or, quick, some of them on a part of it."""
    display = load_display(paper_values.DISPLAY)
    if quick:
        return Experiment(QUICK_SCENES, display.resized(*QUICK_SIZE), runs=1)
    return Experiment(bundled.names(), display)


def make_physical_experiment(*, quick: bool) -> Experiment:
    """Physically based light on a larger frame, where a ray costs more than looking after a point; or, quick, less."""
    display = load_display(paper_values.DISPLAY)
    if quick:
        return Experiment(PHYSICAL_SCENES, display.resized(*PHYSICAL_QUICK_SIZE), runs=1, warm_up=0)
    return Experiment(PHYSICAL_SCENES, display.resized(*PHYSICAL_SIZE))


def engine_renderer(
    display: Display, device: str = "auto", threads: int | None = None, *, physical: bool = False
) -> Renderer:
    """Renders bundled scenes as the paper does: its light model and ray depth, one ray through each pixel's middle.

    ``physical``: by paths of physically based light instead, with a few samples over each pixel.
    """
    loaded: dict[str, Scene] = {}

    def render(name: str, variant: Variant) -> IntegralImage:
        # Only now: whoever imports this module does not need the engine.
        from lippmann.rendering.picture import render_picture
        from lippmann.rendering.request.render_request import RenderRequest

        if name not in loaded:
            loaded.clear()  # scenes come one after the other
            loaded[name] = load_scene(name)
        request = RenderRequest(
            method=cast("Method", variant.method),
            order=cast("Order | None", variant.order),
            respect_gloss=variant.respect_gloss,
            integrator="path" if physical else "classic",
            depth=PHYSICAL_DEPTH if physical else paper_values.RAY_DEPTH,
            spp=PHYSICAL_SAMPLES if physical else 1,
            pixel_filter="box" if physical else "point",
            tone_map="none",
            device=cast("Device", device),
            threads=threads,
        )
        return render_picture(loaded[name], display, request)

    return render
