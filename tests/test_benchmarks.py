"""The head of each program in benchmarks/ says what it asks and how long it takes; none imports another in a circle."""

from __future__ import annotations

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent.parent / "benchmarks"
PROGRAMS = [path for path in sorted(FOLDER.glob("*.py")) if "__main__" in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_the_head_says_what_is_asked_and_how_long_it_takes(path):
    head = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    lines = head.splitlines()
    assert re.match(r"\S.{20,}[.:]$", lines[0])
    assert re.fullmatch(r"Time on two cores: .+\.", lines[2])


def test_no_program_imports_another_in_a_circle():
    graph = {}
    for path in FOLDER.glob("*.py"):
        tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        graph[path.stem] = {node.module for node in tree if isinstance(node, ast.ImportFrom)}
    assert "harness" in TopologicalSorter(graph).static_order()  # raises CycleError for a circle
