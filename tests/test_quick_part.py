"""The lists of tests that ``make check`` and ``make test`` leave out are true, and keep to their budget."""

from __future__ import annotations

import ast
import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TEXT, LONG_TEXT = ((ROOT / "tests" / name).read_text(encoding="utf-8") for name in ("slow.txt", "long.txt"))
LISTED, LONG = (
    [line.split(" ", 1) for line in text.splitlines() if not line.startswith("#")] for text in (TEXT, LONG_TEXT)
)


@pytest.fixture(scope="module")
def measure():
    """The program that writes the list."""
    spec = importlib.util.spec_from_file_location("measure_tests", ROOT / "scripts" / "measure_tests.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("listed", [LISTED, LONG])
def test_every_listed_test_is_there(listed):
    functions = {}
    for _, name in listed:
        path, *_, function = name.partition("[")[0].split("::")
        if path not in functions:
            tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
            functions[path] = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
        assert function in functions[path], name
    assert len({name for _, name in listed}) == len(listed) > 10


@pytest.mark.long
def test_every_case_that_is_listed_is_one_of_its_test():
    """A case whose name has changed would be run again, unseen."""
    import subprocess
    import sys

    files = sorted({name.partition("::")[0] for _, name in LONG})
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-m", "long", "-p", "no:cacheprovider", *files]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout.splitlines()
    names = set(found) | {line.partition("[")[0] for line in found}
    assert [name for _, name in LONG if name not in names] == []


def test_what_is_left_keeps_to_the_budget(measure):
    rest = float(re.search(r"All others together: (\d+) s", TEXT)[1])
    assert 0.5 * measure.BUDGET <= rest <= measure.BUDGET
    seconds = [float(spent) for spent, _ in LISTED]
    assert seconds == sorted(seconds, reverse=True)


def test_the_slowest_are_listed_until_the_others_keep_to_the_budget(measure):
    seconds = {"tests/a.py::test_a": 1000.0, "tests/a.py::test_b": measure.BUDGET, "tests/b.py::test_c": 0.5}
    lines = measure.slow_list(seconds).splitlines()
    assert lines[-2:] == ["1000.0 tests/a.py::test_a", f"{measure.BUDGET:.1f} tests/a.py::test_b"]
    assert "# All others together: 0 s." in lines
    assert measure.function_of("tests/a.py::test_b[1-2]") == "tests/a.py::test_b"


def test_a_listed_test_is_left_out_and_one_of_the_same_file_is_run(pytester_folder):
    run = pytester_folder
    assert run("--quick") == {"test_fast"}
    assert run("-m", "not long") == {"test_fast", "test_slow[1]"}
    assert run("-m", "long") == {"test_very_slow", "test_slow[2]", "test_listed[3]", "test_listed[4]"}


@pytest.fixture
def pytester_folder(tmp_path):
    """``run(*options)``: names of the tests that the suite's own ``conftest.py`` lets run in a small suite."""
    import os
    import subprocess
    import sys

    tests = tmp_path / "tests"
    tests.mkdir()
    (tests / "conftest.py").write_text((ROOT / "tests" / "conftest.py").read_text(encoding="utf-8"))
    (tests / "slow.txt").write_text("# head\n2.5 tests/test_some.py::test_slow\n")
    (tests / "long.txt").write_text("# head\n9 tests/test_some.py::test_slow[2]\n9 tests/test_some.py::test_listed\n")
    (tests / "test_some.py").write_text(
        "import pytest\n\n\n@pytest.mark.parametrize('a', [1, 2])\ndef test_slow(a):\n    pass\n\n\n"
        "@pytest.mark.parametrize('a', [3, 4])\ndef test_listed(a):\n    pass\n\n\n"
        "def test_fast():\n    pass\n\n\n@pytest.mark.long\ndef test_very_slow():\n    pass\n"
    )
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n    long: slow\n")

    def run(*options: str) -> set[str]:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", *options],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
            env={key: value for key, value in os.environ.items() if key != "PYTEST_ADDOPTS"},
        )
        return set(re.findall(r"::(\S+)", done.stdout))

    return run
