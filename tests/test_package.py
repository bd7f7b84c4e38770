"""The package by its few names."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

import lippmann
from lippmann import image, plugins


def test_render_can_be_called_again_and_again(engine):
    for _ in range(2):
        picture = lippmann.render("teapot", integrator="normal", spp=1)
        assert picture.pixels.shape == (512, 512, 3)


@pytest.mark.parametrize("module", [lippmann, image, plugins])
def test_all_names_are_there_and_are_completed_before_they_are_used(module):
    assert dir(module) == sorted(module.__all__)
    for name in module.__all__:
        assert getattr(module, name) is not None


def test_scripts_name_tests_that_are_there():
    root = Path(__file__).resolve().parent.parent
    named = re.findall(r"tests/\S+\.py", (root / "scripts" / "test-oldest.sh").read_text())
    assert len(named) > 5
    assert [name for name in named if not (root / name).exists()] == []


def test_one_page_lists_all_public_names_and_another_describes_each():
    folder = Path(__file__).resolve().parent.parent / "docs" / "reference" / "python"
    table, _, _ = (folder / "plugins.md").read_text(encoding="utf-8").partition("## Plugins")
    listed = set(re.findall(r"`([\w.]+)`", table))
    pages = "".join(page.read_text(encoding="utf-8") for page in folder.glob("*.md"))
    described = set(re.findall(r"^::: lippmann\.(\S+)", pages, re.M))
    errors = {f"plugins.{name}" for name in plugins.__all__ if name.endswith("Error")}
    assert listed == described | errors
    assert {name for name in listed if "." not in name} == {*lippmann.__all__} - {"__version__"}
    assert {name for name in listed if name.startswith("plugins.")} == {f"plugins.{name}" for name in plugins.__all__}


def test_each_public_name_leads_to_what_it_names():
    for name in plugins.__all__:
        assert getattr(plugins, name).__name__ == name
    with pytest.raises(AttributeError, match=r"module 'lippmann\.plugins' has no attribute 'Nothing'"):
        _ = plugins.Nothing


def test_the_help_of_each_function_says_what_it_returns():
    functions = [each for each in (getattr(lippmann, name) for name in lippmann.__all__) if inspect.isfunction(each)]
    assert len(functions) > 10
    silent = [each.__name__ for each in functions if not re.search(r"\n\s*(Returns|Yields)\n\s*---", each.__doc__)]
    assert silent == []
