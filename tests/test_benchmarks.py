"""Programs in benchmarks/: their heads say what they ask and how long they take, and they fit today's package."""

from __future__ import annotations

import ast
import importlib.util
import re
import shutil
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import numpy as np

import lippmann
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.runtime import engine

FOLDER = Path(__file__).resolve().parent.parent / "benchmarks"
BUNDLED = lippmann.load_scene("teapot"), lippmann.load_display("seed-lenticular")
PROGRAMS = [path for path in sorted(FOLDER.glob("*.py")) if "__main__" in path.read_text(encoding="utf-8")]


def test_the_head_says_what_is_asked_and_how_long_it_takes():
    for path in PROGRAMS:
        head = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
        lines = head.splitlines()
        assert re.match(r"\S.{20,}[.:]$", lines[0]), path.stem
        assert re.fullmatch(r"Time on two cores: .+\.", lines[2]), path.stem


def test_no_program_imports_another_in_a_circle():
    graph = {}
    for path in FOLDER.glob("*.py"):
        tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        graph[path.stem] = {node.module for node in tree if isinstance(node, ast.ImportFrom)}
    assert "harness" in TopologicalSorter(graph).static_order()  # raises CycleError for a circle


def test_pages_hold_the_tables_of_the_results(tmp_path):
    """Tables are written by their program, never by hand."""
    for folder in ("benchmarks", "docs/background", "docs/reference"):
        shutil.copytree(FOLDER.parent / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(FOLDER.parent / "README.md", tmp_path)
    subprocess.run([sys.executable, "benchmarks/tables.py"], cwd=tmp_path, check=True, timeout=60)
    for page in [tmp_path / "README.md", *tmp_path.glob("docs/*/*.md")]:
        assert page.read_text() == (FOLDER.parent / page.relative_to(tmp_path)).read_text(), page.name


def test_all_that_programs_import_of_the_package_is_there():
    engine.start()
    for path in FOLDER.glob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        of_earlier = {node for attempt in ast.walk(tree) if isinstance(attempt, ast.Try) for node in ast.walk(attempt)}
        for node in set(ast.walk(tree)) - of_earlier:
            if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "lippmann":
                module = importlib.import_module(node.module)
                for alias in node.names:
                    submodule = f"{node.module}.{alias.name}"
                    assert hasattr(module, alias.name) or importlib.util.find_spec(submodule), (
                        f"{path.name}: {submodule}"
                    )


def test_the_reference_of_single_pixels_is_that_of_the_whole_picture(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    request = resolve(RenderRequest(method="full", integrator="albedo", spp=4), *BUNDLED)
    session = open_session(BUNDLED[0], request)
    from lippmann.rendering.transport.ray_source import DisplayRays
    from reference_pixels import trace_pixels

    scene, display = BUNDLED
    placement = session.place(display)
    source = DisplayRays(display, placement.world_from_display)
    columns, rows = np.random.default_rng(3).integers(0, display.panel.width, (2, 200))
    pixels = trace_pixels(session, source, session.integrator(source, placement.display_from_world), columns, rows, 4)
    whole = lippmann.render(scene, display, method="full", integrator="albedo", spp=4).pixels[rows, columns]
    assert np.median(np.abs(pixels - whole)) < 1e-4 < np.ptp(whole)
