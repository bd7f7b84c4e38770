"""Colours of the page against each other: WCAG 2.2 AA."""

from __future__ import annotations

import re

import pytest

from lippmann.studio_app.pages import static_files


def colours(sheet):
    text = static_files()[f"assets/{sheet}"].body.decode()
    return dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6});", text))


def luminance(colour):
    codes = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in codes)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_computed_as_wcag_does():
    assert contrast("#000000", "#ffffff") == pytest.approx(21)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("sheet", ["studio.css", "panel_window.css"])
def test_text_and_edges_can_be_seen(sheet):
    found = colours(sheet)
    grounds = [found[name] for name in ("ground", "surface", "raised") if name in found]
    for ground in grounds:
        for name in ("text", "quiet", "accent"):
            assert contrast(found[name], ground) >= 4.5, (name, ground)
        # Edges of controls, and what only colour tells apart.
        for name in ("edge", "good", "warn", "danger"):
            if name in found:
                assert contrast(found[name], ground) >= 3.0, (name, ground)
    assert contrast(found["on-accent"], found["accent"]) >= 4.5


@pytest.mark.parametrize("sheet", ["studio.css", "result.css", "settings.css", "panel_window.css"])
def test_text_has_no_other_colours(sheet):
    text = static_files()[f"assets/{sheet}"].body.decode()
    used = re.findall(r"[^-]color: ([^;]+);", text)
    assert {value for value in used if not value.startswith("var(--")} <= {"inherit"}
