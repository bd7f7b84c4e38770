"""The package by its few names."""

from __future__ import annotations

import re
from pathlib import Path

import lippmann


def test_render_can_be_called_again_and_again(engine):
    for _ in range(2):
        image = lippmann.render("teapot", integrator="normal", spp=1)
        assert image.pixels.shape == (512, 512, 3)


def test_all_names_are_there():
    for name in lippmann.__all__:
        assert getattr(lippmann, name) is not None
    assert set(lippmann.__all__) <= set(dir(lippmann))


def test_scripts_name_tests_that_are_there():
    root = Path(__file__).resolve().parent.parent
    named = re.findall(r"tests/\S+\.py", (root / "scripts" / "test-oldest.sh").read_text())
    assert len(named) > 5
    assert [name for name in named if not (root / name).exists()] == []
