"""Kernels are transformed when they are first called, and behave as transformed ones."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
import drjit as dr
from lippmann.device import syntax

@syntax.syntax
def halvings(x, least=1):
    '''How often x can be halved.'''
    count = mi.UInt32(0)
    while x > least:
        x = x / 2
        count += 1
    return count

dr.syntax = syntax.dr.syntax = lambda kernel, made=dr.syntax: print("transformed") or made(kernel)
print("defined", halvings.__name__)
print(halvings(mi.Float(8, 2, 1)), halvings(mi.Float(8), least=3))
"""


@pytest.mark.usefixtures("engine")
def test_a_kernel_is_transformed_once_and_at_its_first_call(tmp_path):
    path = tmp_path / "kernel.py"
    path.write_text(PROGRAM)
    done = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["defined halvings", "transformed", "[3, 1, 0] [2]"]
