"""The examples in the docstrings of the public names do as they say.

That of ``studio`` is not run here: it starts a server with a thread, which the tests of the studio do in processes of
their own.
"""

from __future__ import annotations

import doctest

import pytest

import lippmann

NAMES = [name for name in lippmann.__all__ if name != "__version__"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_examples_of_a_public_name(name, tmp_path, monkeypatch, engine):
    monkeypatch.chdir(tmp_path)
    finder = doctest.DocTestFinder(recurse=False)
    [found] = finder.find(getattr(lippmann, name), name, globs={"lippmann": lippmann})
    assert found.examples
    said = []
    assert doctest.DocTestRunner().run(found, out=said.append).failed == 0, "".join(said)
