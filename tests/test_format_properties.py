"""The tables of docs/reference/properties say what the readers do: every row names a test that shows it."""

from __future__ import annotations

import ast
import sys
from functools import cache
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
TABLES = sorted((ROOT / "docs" / "reference" / "properties").glob("*.toml"))
KINDS = ("honoured", "noted", "refused")


@cache
def functions_of(name: str) -> dict[str, str]:
    """Source of every test of a file, its parameters included."""
    text = (ROOT / "tests" / name).read_text(encoding="utf-8")
    lines = text.splitlines()
    return {
        node.name: "\n".join(
            lines[min([node.lineno, *(one.lineno for one in node.decorator_list)]) - 1 : node.end_lineno]
        )
        for node in ast.parse(text).body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


@pytest.mark.parametrize("table", TABLES, ids=lambda path: path.stem)
def test_every_row_names_a_test_that_shows_it(table):
    values = tomllib.loads(table.read_text(encoding="utf-8"))
    assert set(values) == {"title", "source", "rows"}
    names = [row["name"] for row in values["rows"]]
    assert len(names) == len(set(names))
    for row in values["rows"]:
        expected = {"name", "is", "how", "test"} | ({"says"} if row.get("is") != "honoured" else set())
        assert set(row) == expected, row["name"]
        assert row["is"] in KINDS, row["name"]
        file, _, test = row["test"].partition("::")
        source = functions_of(file).get(test)
        assert source is not None, f"there is no test {row['test']}"
        if row["is"] != "honoured":
            assert row["says"] in source.replace("\\", ""), f"{row['test']} does not look for '{row['says']}'"


def test_there_are_tables():
    assert {path.stem for path in TABLES} >= {
        "png",
        "tiff",
        "openexr",
        "photographs",
        "dicom",
        "gltf",
        "obj",
        "ply-stl",
    }
