"""The examples run as they are."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
PLUGINS = ("smf_reader", "more_plugins")


def test_the_guide_shows_the_plugins_as_they_are():
    page = (ROOT / "docs" / "how-to" / "extend.md").read_text(encoding="utf-8")
    for folder in PLUGINS:
        for file in (EXAMPLES / folder).glob("*.[pt][yo]*"):
            assert f'"\n{file.read_text(encoding="utf-8")}```' in page, file
    assert len((EXAMPLES / "smf_reader" / "lippmann_smf.py").read_text(encoding="utf-8").splitlines()) <= 40


@pytest.mark.slow
def test_installed_plugins_render_their_own_files(engine, tmp_path):
    target = tmp_path / "installed"
    build = [sys.executable, "-c", f"from setuptools import build_meta; build_meta.build_wheel({str(target)!r})"]
    for folder in PLUGINS:
        shutil.copytree(EXAMPLES / folder, tmp_path / folder)  # building leaves files beside the sources
        subprocess.run(build, cwd=tmp_path / folder, capture_output=True, check=True)
    for wheel in target.glob("*.whl"):
        # All that installing a wheel of Python's alone does that the program sees; pip takes three times as long.
        zipfile.ZipFile(wheel).extractall(target)
    gem = str(tmp_path / "smf_reader" / "gem.smf")
    quick = ["--spp", "2", "--method", "full", "--threads", "2"]
    commands = [
        ["render", gem, "--display", "acme-9", "--reader-option", "roughness=0.2", *quick, "-o", "gem.png"],
        ["info", "gem.png"],
        ["render", "teapot", "--integrator", "sky-seen", *quick, "-o", "teapot.png"],
        ["export", "gem.png", "--as", "strip", "-o", "strip"],
        ["replay", "gem.png", "--sweep", "--frames", "3", "--size", "64x48", "-o", "gem.gif"],
        ["doctor", "--json"],
    ]
    code = f"import sys; from lippmann.cli import run; sys.exit(max(run(words) for words in {commands!r}))"
    path = os.pathsep.join([str(target), *os.environ.get("PYTHONPATH", "").split(os.pathsep)])
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    picture = Image.open(tmp_path / "gem.png").convert("RGB")
    assert picture.size == (1024, 768)
    red, _, blue = picture.getpixel((512, 600))
    assert blue > 2 * red  # the dark sides of the gem
    lightness = Image.open(tmp_path / "teapot.png").convert("L")
    assert lightness.getextrema() == (0, 255)  # what sees nothing of the sky, and what sees all of it
    with Image.open(tmp_path / "strip.png") as strip, Image.open(tmp_path / "gem.gif") as film:
        assert (strip.size[1], film.n_frames) == (768, 3)
    assert 'reader_options = {"roughness" = "0.2"}' in done.stdout
    assert '"options": {"roughness": 0.5}' in " ".join(done.stdout.split())
    for name in ("smf", "acme", "strip", "gif", "sky-seen"):
        assert f'"name": "{name}"' in done.stdout


#: What makes each picture of the gallery small, and so its test quick.
SMALLER = {
    "anaglyph": {"spp": 1},
    "epipolar_image": {"lenses": (120, 100)},
    "focal_stack": {"spp": 1},
    "micro_images": {"spp": 1},
    "molecule": {"spp": 1},
    "photograph": {"width": 320},
    "print_seen": {"size": "30x20mm"},
    "three_eyes": {"spp": 1},
    "volume": {"side": 24},
    "woven_quilt": {"width": 240},
}


def test_the_gallery_shows_each_script_that_makes_a_picture():
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    for name in SMALLER:
        assert f"`{name}.py`" in page
        assert 15 <= len((EXAMPLES / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 45
        assert (ROOT / "docs" / "images" / "gallery" / f"{name}.jpg").stat().st_size < 60_000


@pytest.mark.long_cases(but=["print_seen"])
@pytest.mark.slow
@pytest.mark.parametrize("name", SMALLER)
def test_a_script_of_the_gallery_makes_its_picture(name, engine, tmp_path):
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main(tmp_path / "a.png", **SMALLER[name])
    with Image.open(tmp_path / "a.png") as picture:
        assert min(picture.size) >= 200
        assert picture.convert("L").entropy() > 1  # more than a flat colour
