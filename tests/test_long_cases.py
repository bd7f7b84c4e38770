"""The marker ``long_cases`` of ``conftest.py``, in a small suite of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SUITE = """\
import pytest

@pytest.mark.long_cases("one")
@pytest.mark.parametrize("a", ["one", "two"])
def test_named(a): pass

@pytest.mark.long_cases(but=["two"])
@pytest.mark.parametrize("a", ["one", "two", "three"])
def test_spared(a): pass
"""


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    """What the command says that collects the long tests of two files, of whose marks those of the second are wrong."""
    folder = tmp_path_factory.mktemp("suite")
    shutil.copy(Path(__file__).parent / "conftest.py", folder)
    (folder / "test_some.py").write_text(SUITE)
    (folder / "test_wrong.py").write_text(SUITE.replace('cases("one")', 'cases("zero")'))
    (folder / "pytest.ini").write_text("[pytest]\nmarkers =\n    long:\n    long_cases:\n")
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-m", "long", "-p", "no:cacheprovider"]
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 2
    return done.stdout


def test_named_cases_are_long_or_all_the_others(collected):
    names = [line.partition("::")[2] for line in collected.splitlines() if line.startswith("test_some.py::")]
    assert names == ["test_named[one]", "test_spared[one]", "test_spared[three]"]


def test_a_case_that_is_not_there_is_an_error(collected):
    """A case whose name has changed would be run again, unseen."""
    assert "test_named has no case ['zero']" in collected
