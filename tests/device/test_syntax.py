"""Kernels are transformed when they are first called, and the code is kept while it is the same kernel's."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

PROGRAM = """
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
import drjit as dr
from lippmann.device import syntax
from kernels import halvings

transform = syntax.transform_syntax
syntax.transform_syntax = lambda kernel: print("transformed") or transform(kernel)
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


@pytest.fixture
def run(tmp_path, engine):
    """Runs the program with this source of the kernel; the lines that it prints."""

    def program(kernels=KERNELS, **environment):
        (tmp_path / "program.py").write_text(PROGRAM)
        (tmp_path / "kernels.py").write_text(kernels)
        base = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        command = [sys.executable, str(tmp_path / "program.py")]
        done = subprocess.run(command, env={**base, **environment}, capture_output=True, text=True, check=True)
        return done.stdout.splitlines()

    return program


def test_a_kernel_is_transformed_once_at_its_first_call(run, tmp_path):
    first = ["defined halvings", "transformed", "[3, 1, 0] [2]"]
    assert run(PYTHONDONTWRITEBYTECODE="1") == first
    assert not list(tmp_path.glob("**/*.syntax"))
    assert run() == first
    assert run() == ["defined halvings", "[3, 1, 0] [2]"]
    # Of another length: Python takes a module of the same second and size for the same.
    assert run(KERNELS.replace("x / 2", "x / 4.0"))[1:] == ["transformed", "[2, 1, 0] [1]"]


def test_what_is_kept_may_be_damaged(run, tmp_path):
    run()
    (kept,) = tmp_path.glob("__pycache__/kernels.*.halvings.syntax")
    for content in (b"", b"\xff" * 40, kept.read_bytes()[:50]):
        kept.write_bytes(content)
        assert run()[1:] == ["transformed", "[3, 1, 0] [2]"]
        assert run()[1:] == ["[3, 1, 0] [2]"]
