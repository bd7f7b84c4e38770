"""The examples in the docstrings of the public names do as they say.

Those of studios are not run here: they start a server with a thread, which the tests of the studio do in processes of
their own.
"""

from __future__ import annotations

import doctest
import importlib
import re
from pathlib import Path

import pytest

import lippmann

PAGE = Path(__file__).resolve().parent.parent / "docs" / "reference" / "python" / "plugins.md"
#: All that one page names as public.
NAMES = [
    name
    for row in re.findall(r"^\| (`.*`) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    for name in re.findall(r"`([\w.]+)`", row)
]


def test_the_page_has_all_that_the_package_offers():
    from lippmann import plugins

    assert {name for name in lippmann.__all__ if name != "__version__"} <= {*NAMES}
    assert {f"plugins.{name}" for name in plugins.__all__} <= {*NAMES}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_examples_of_a_public_name(name, tmp_path, monkeypatch, engine):
    from lippmann.rendering import forecast

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(forecast, "PROBE_SECONDS", 0.05)
    module, _, attribute = f"lippmann.{name}".rpartition(".")
    finder = doctest.DocTestFinder(recurse=False)
    [found] = finder.find(getattr(importlib.import_module(module), attribute), name, globs={"lippmann": lippmann})
    assert found.examples
    said = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    assert runner.run(found, out=said.append).failed == 0, "".join(said)
