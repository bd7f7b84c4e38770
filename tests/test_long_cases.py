"""The marker ``long_cases`` of ``conftest.py``, in a small suite of its own."""

from __future__ import annotations

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


@pytest.fixture
def collected(tmp_path):
    """``collected(suite)``: the end of the command that collects the long tests of a suite, and what it says."""

    def collect(suite: str) -> tuple[int, str]:
        conftest = Path(__file__).parent / "conftest.py"
        (tmp_path / "conftest.py").write_text(conftest.read_text(encoding="utf-8"), encoding="utf-8")
        (tmp_path / "test_some.py").write_text(suite)
        (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n    long:\n    long_cases:\n")
        command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-m", "long", "-p", "no:cacheprovider"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        return done.returncode, done.stdout

    return collect


def test_named_cases_are_long_or_all_the_others(collected):
    code, said = collected(SUITE)
    assert code == 0
    names = [line.partition("::")[2] for line in said.splitlines() if "::" in line]
    assert names == ["test_named[one]", "test_spared[one]", "test_spared[three]"]


def test_a_case_that_is_not_there_is_an_error(collected):
    """A case whose name has changed would be run again, unseen."""
    code, said = collected(SUITE.replace('cases("one")', 'cases("zero")'))
    assert code == 2
    assert "test_named has no case ['zero']" in said
