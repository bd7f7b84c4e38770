"""Starting is cheap: help and import load neither Mitsuba nor NumPy."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize("code", ["import lippmann", "from lippmann.cli import run; run(['--help'])"])
def test_nothing_heavy_is_loaded(code):
    check = (
        f"import sys\n{code}\n"
        "heavy = {'mitsuba', 'drjit', 'numpy', 'PIL', 'OpenEXR', 'trimesh', 'matplotlib'} & set(sys.modules)\n"
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
