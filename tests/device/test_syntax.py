"""Kernels are transformed when they are first called, and the code is kept while it is the same kernel's."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

PROGRAM = """
import importlib, sys
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
from lippmann.device import syntax

transform = syntax.transform_syntax
syntax.transform_syntax = lambda kernel: print("transformed") or transform(kernel)
for name in sys.argv[1:]:
    halvings = importlib.import_module(name).halvings
    print("defined", halvings.__name__)
    print(halvings(mi.Float(8, 2, 1)), halvings(mi.Float(8), least=3))
"""
KERNELS = """
import mitsuba as mi
from lippmann.device.syntax import syntax

@syntax
def halvings(x, least=1):
    '''How often x can be halved.'''
    count = mi.UInt32(0)
    while x > least:
        x = x / 2
        count += 1
    return count
"""


MODULES = "other_kernel", "of_no_bytes", "of_other_bytes", "of_fewer_bytes"


@pytest.fixture
def run(tmp_path, engine):
    """Runs the program; by module, whether its kernel was transformed, and what it gave."""
    (tmp_path / "program.py").write_text(PROGRAM)
    base = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, str(tmp_path / "program.py"), *MODULES]

    def program(**environment):
        done = subprocess.run(command, env={**base, **environment}, capture_output=True, text=True, check=True)
        told = [part.splitlines()[1:] for part in done.stdout.split("defined ")[1:]]
        assert all(part[:-1] in ([], ["transformed"]) for part in told)
        return [len(part) == 2 for part in told], [part[-1] for part in told]

    return program


def test_a_kernel_is_transformed_once_at_its_first_call_or_where_what_is_kept_is_not_its_code(run, tmp_path):
    for name in MODULES:
        (tmp_path / f"{name}.py").write_text(KERNELS)
    results = ["[3, 1, 0] [2]"] * 4
    assert run(PYTHONDONTWRITEBYTECODE="1") == ([True] * 4, results)
    assert not list(tmp_path.glob("**/*.syntax"))
    assert run() == ([True] * 4, results)
    # Of another length: Python takes a module of the same second and size for the same.
    (tmp_path / "other_kernel.py").write_text(KERNELS.replace("x / 2", "x / 4.0"))
    kept = [next(tmp_path.glob(f"__pycache__/{name}.*.halvings.syntax")) for name in MODULES]
    for path, content in zip(kept[1:], (b"", b"\xff" * 40, kept[3].read_bytes()[:50]), strict=True):
        path.write_bytes(content)
    results[0] = "[2, 1, 0] [1]"
    assert run() == ([True] * 4, results)
    assert run() == ([False] * 4, results)
