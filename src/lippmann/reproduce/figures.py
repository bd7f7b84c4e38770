"""The pictures of the page, in the paper's order."""

from __future__ import annotations

from markupsafe import Markup

from lippmann.metrics.error_image import BRIGHTEST
from lippmann.reproduce import tables
from lippmann.reproduce.experiment import Manner, Results, Run, Variant
from lippmann.reproduce.html import element, figure, folded, paragraph
from lippmann.viewing import diagnostic_maps


def missed_figures(results: Results) -> list[Markup]:
    """For every scene where pixels came from; the first scene's open, the others' on demand."""
    key = Variant("interpolated", Manner.PAPER).key
    text = (
        "How the pixels of the interpolated pictures came about: dark ones were reprojected from another lens, light "
        "ones were missed and traced, orange ones were missed and interpolated. Beside it the same frame with only the "
        "reprojected, and only the traced pixels (the rest in violet), and whole."
    )
    parts: list[Markup] = []
    for position, scene in enumerate(results.runs):
        panels = _parts_of(results.of(scene, key))
        parts.append(_gallery(*panels) if position == 0 else folded(scene, _gallery(*panels)))
    return [paragraph(text), *parts]


def scene_figures(results: Results) -> list[Markup]:
    """For every scene the picture for the panel, and what an eye in front of the display sees."""
    lenses = results.experiment.display.lens_grid.columns
    text = (
        f"First of each pair what the panel shows, fully traced: {lenses} strips, one behind each lens. Then what an "
        "eye in the middle in front of the display sees through the lenses."
    )
    figures = []
    for scene in results.runs:
        image = results.full(scene).image
        figures += [
            _figure(diagnostic_maps.display_codes(image), f"{scene}: on the panel", f"integral image of the {scene}"),
            _figure(
                diagnostic_maps.replayed_codes(image),
                f"{scene}: in front of the display",
                f"the {scene} as an eye sees it",
            ),
        ]
    return [paragraph(text), _gallery(*figures)]


def gloss_figures(results: Results) -> list[Markup]:
    """Errors without and with gloss respected, of the scene where it changes most."""
    keys = [Variant("interpolated", manner).key for manner in (Manner.DEFAULT, Manner.GLOSS)]

    def gain(scene: str) -> float:
        before, after = (tables.comparison(results.of(scene, key)).mean_squared_error for key in keys)
        return before - after

    scene = max(results.runs, key=gain)
    figures = []
    for key, words in zip(keys, ("gloss not respected", "gloss respected"), strict=True):
        quality = tables.comparison(results.of(scene, key))
        caption = f"{scene}, interpolated, {words}: {tables.decibels(quality.psnr)} dB"
        figures.append(_figure(diagnostic_maps.error_codes(quality), caption, f"errors of the {scene}, {words}"))
    text = (
        "Errors against full tracing, from none (black) to a root-mean-square difference of "
        f"{BRIGHTEST:g} of coded values and above (yellow), where respecting gloss changes most:"
    )
    return [paragraph(text), _gallery(*figures)]


def _parts_of(run: Run) -> list[Markup]:
    image, scene = run.image, run.scene
    traced = tables.percent(run.traced_share)
    pictures = (
        (diagnostic_maps.missed_codes(image), f"Missed pixels; {traced} traced", "where pixels came from"),
        (diagnostic_maps.reprojected_codes(image), "Reprojected pixels only", "reprojected pixels"),
        (diagnostic_maps.traced_codes(image), "Traced pixels only", "traced pixels"),
        (diagnostic_maps.display_codes(image), "The whole picture", "whole picture"),
    )
    return [_figure(codes, words, f"{scene}: {alt}") for codes, words, alt in pictures if codes is not None]


def _figure(codes: diagnostic_maps.Codes, caption: str, alt: str) -> Markup:
    height, width = codes.shape[:2]
    return figure(diagnostic_maps.data_uri(codes), (width, height), caption, alt)


def _gallery(*figures: str) -> Markup:
    return element("div", *figures, class_="figures")
