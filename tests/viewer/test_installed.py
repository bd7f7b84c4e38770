"""The served page in a real browser, from the package as it is installed: a wheel, not the source."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import zipfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.image import IntegralImage

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with the package as its wheel holds it."""
    source, target = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("installed")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    left_out = shutil.ignore_patterns("__pycache__", "*.egg-info")
    shutil.copytree(ROOT / "src", source / "src", ignore=left_out)
    build = "import sys; from setuptools.build_meta import build_wheel; print(build_wheel(sys.argv[1]))"
    command = [sys.executable, "-c", build, str(source)]
    run = subprocess.run(command, cwd=source, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    with zipfile.ZipFile(next(source.glob("*.whl"))) as wheel:
        wheel.extractall(target)
    return target


@pytest.fixture
def shot(tmp_path):
    """A picture that is red from the left and blue from the right."""
    display = load_display("seed-lenticular").resized(256, 192)
    pixels = np.zeros((192, 256, 3), dtype=np.float32)
    side = np.arange(256) % 8 < 4
    pixels[:, ~side, 0] = pixels[:, side, 2] = 1
    path = tmp_path / "shot.png"
    IntegralImage(pixels, display).save(path)
    return path


@contextmanager
def serving(installed, *paths):
    """``lippmann view`` of the installed package; yields the process and the page's address."""
    code = (
        "import lippmann, sys; from lippmann.cli import main; assert lippmann.__file__.startswith(sys.argv[1]); "
        "main(['view', *sys.argv[2:], '--no-browser'])"
    )
    command = [sys.executable, "-P", "-c", code] if sys.version_info >= (3, 11) else [sys.executable, "-c", code]
    variables = os.environ | {"PYTHONPATH": str(installed)}
    words = [str(installed), *map(str, paths)]
    with subprocess.Popen([*command, *words], stdout=subprocess.PIPE, env=variables, text=True) as process:
        try:
            yield process, process.stdout.readline().split()[-1]
        finally:
            process.kill()


def middle(tab, eye):
    """The colour in the middle of what an eye sees."""
    code = """async (eye) => {
      const viewer = window.lippmann.viewer;
      await viewer.ready;
      viewer.setEye(...eye);
      const { width, height, data } = await viewer.pixels();
      const bytes = atob(data);
      const start = 4 * (Math.floor(height / 2) * width + Math.floor(width / 2));
      return [0, 1, 2].map((channel) => bytes.charCodeAt(start + channel));
    }"""
    return tab.evaluate(code, eye)


@pytest.mark.long
def test_page_of_the_installed_package_works(installed, shot, open_tab):
    with serving(installed, shot) as (process, address):
        tab = open_tab(size=(900, 700)).open(address)
        tab.wait_for("window.lippmann?.viewer?.ready.then(() => true)")
        assert middle(tab, (-20.0, 0.0, 500.0)) == [255, 0, 0]
        assert middle(tab, (20.0, 0.0, 500.0)) == [0, 0, 255]
        assert all(asked.startswith(address) for asked in tab.asked_for)
        tab.assert_clean()
        tab.page.close()
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 130
