"""The wheel and the source archive of a release, as a stranger installs them."""

from __future__ import annotations

import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
import yaml

from lippmann._version import VERSION

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

#: What a user meets first of each extra: the modules that it brings, and Lippmann's own that needs them.
DOORS = {
    "cluster": ("cryptography, distributed", "lippmann.cluster.connection"),
    "exchange": ("h5py, zarr", "lippmann.exchange"),
    "heif": ("pillow_heif", "lippmann.scene.readers.heif.photo"),
    "molecules": ("gemmi", "lippmann.scene.readers.molecules.reader"),
    "notebook": ("anywidget", "lippmann.viewer.widget"),
    "usd": ("pxr", "lippmann.scene.readers.usd"),
    "volumes": ("nibabel, pydicom", "lippmann.scene.readers.volumes"),
    "vtk": ("pyvista", "lippmann.scene.readers.vtk.files"),
}
EXTRAS = [name for name in PROJECT["optional-dependencies"] if name != "dev"]


def run(*words, folder) -> str:
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-1500:] + done.stderr[-1500:]
    return done.stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory) -> Path:
    """Both archives, made from the files that belong to the sources alone; the wheel from the source archive."""
    folder = tmp_path_factory.mktemp("sources")
    for name in run("git", "ls-files", "src", "pyproject.toml", "README.md", "LICENSE", folder=ROOT).splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes((ROOT / name).read_bytes())
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", "dist", folder=folder)
    return folder / "dist"


@pytest.mark.slow
def test_the_archives_hold_all_of_the_package_and_nothing_else(dist):
    wheel, source = dist / f"lippmann-{VERSION}-py3-none-any.whl", dist / f"lippmann-{VERSION}.tar.gz"
    sources = {
        name.removeprefix("src/")
        for name in run("git", "ls-files", "src", folder=ROOT).splitlines()
        if (ROOT / name).is_file()
    }
    with zipfile.ZipFile(wheel) as packed:
        assert {name for name in packed.namelist() if ".dist-info/" not in name} == sources
    with tarfile.open(source) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    assert {f"src/{name}" for name in sources} | {"LICENSE", "README.md", "pyproject.toml"} <= names


def test_version_and_date_are_the_same_everywhere():
    [(version, date)] = re.findall(
        r"^## \[(\d\S+)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M
    )[:1]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert (version, date) == (citation["version"], str(citation["date-released"]))
    assert version == VERSION


def test_the_install_page_lists_the_extras():
    page = (ROOT / "docs" / "how-to" / "install.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `pip install 'lippmann\[(\w+)\]'`", page, re.M)) == set(EXTRAS)
    assert DOORS.keys() == set(EXTRAS)


@pytest.mark.long
def test_a_stranger_installs_the_wheel_and_renders(dist, tmp_path):
    """With the base install first, then with one extra after the other."""
    run(sys.executable, "-m", "venv", "venv", folder=tmp_path)
    scripts = tmp_path / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    pip = (scripts / "python", "-m", "pip", "--disable-pip-version-check", "-q")
    if subprocess.run([*pip, "download", "--no-deps", "tomli"], cwd=tmp_path, capture_output=True).returncode:
        pytest.skip("no package registry is reached")
    [wheel] = dist.glob("*.whl")
    run(*pip, "install", wheel, folder=tmp_path)
    empty = tmp_path / "empty"
    empty.mkdir()
    assert run(scripts / "lippmann", "--version", folder=empty).strip().endswith(VERSION)
    run(scripts / "lippmann", "render", "teapot", "--spp", "1", "--threads", "2", "-o", "teapot.png", folder=empty)
    assert "512x512" in run(scripts / "lippmann", "info", "teapot.png", folder=empty)
    for extra, (libraries, door) in DOORS.items():
        run(*pip, "install", f"{wheel}[{extra}]", folder=tmp_path)
        run(scripts / "python", "-c", f"import {libraries}, {door}", folder=empty)
