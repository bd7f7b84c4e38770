"""The wheel and the source archive of a release, as a stranger installs them."""

from __future__ import annotations

import json
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

#: Lippmann's own module that needs each extra, and can be imported without.
DOORS = {
    "cluster": "lippmann.cluster.connection",
    "exchange": "lippmann.exchange",
    "heif": "lippmann.scene.readers.heif",
    "lidar": "lippmann.scene.readers.lidar.reader",
    "molecules": "lippmann.scene.readers.molecules.reader",
    "notebook": "lippmann.viewer.notebook",
    "usd": "lippmann.scene.readers.usd",
    "volumes": "lippmann.scene.readers.volumes",
    "vtk": "lippmann.scene.readers.vtk.files",
}
#: What each extra lets Python import.
LIBRARIES = {
    "cluster": ("bokeh", "cryptography", "distributed"),
    "exchange": ("h5py", "zarr"),
    "heif": ("pillow_heif",),
    "lidar": ("laspy", "lazrs"),
    "molecules": ("gemmi",),
    "notebook": ("anywidget",),
    "usd": ("pxr.Usd",),
    "volumes": ("nibabel", "pydicom"),
    "vtk": ("pyvista",),
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
    assert DOORS.keys() == LIBRARIES.keys() == set(EXTRAS)


@pytest.fixture(scope="module")
def installed(dist, tmp_path_factory) -> Path:
    """The program, as the wheel and what it needs are installed into an environment of their own; from pip's cache."""
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "-q")
    folder = tmp_path_factory.mktemp("stranger")
    if subprocess.run([*pip, "download", "--no-deps", "tomli"], cwd=folder, capture_output=True).returncode:
        pytest.skip("no package registry is reached")
    run(sys.executable, "-m", "venv", "--without-pip", "venv", folder=folder)
    scripts = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    [wheel] = dist.glob("*.whl")
    # Modules are compiled when they are imported: most of them never are.
    run(*pip, "--python", scripts / "python", "install", "--no-compile", "--only-binary=:all:", wheel, folder=folder)
    return scripts / "lippmann"


@pytest.mark.long
def test_a_stranger_installs_the_wheel_and_renders(installed, tmp_path):
    assert run(installed, "--version", folder=tmp_path).strip().endswith(VERSION)
    run(installed, "render", "teapot", "--spp", "1", "--threads", "2", "-o", "teapot.png", folder=tmp_path)
    assert "512x512" in run(installed, "info", "teapot.png", folder=tmp_path)
    run(installed.with_name("python"), "-c", f"import {', '.join(DOORS.values())}", folder=tmp_path)


@pytest.mark.long
def test_each_extra_brings_its_libraries_as_wheels_that_go_with_all_others(installed, dist, tmp_path):
    [wheel] = dist.glob("*.whl")
    words = [
        sys.executable,
        "-m",
        "pip",
        "--disable-pip-version-check",
        "-q",
        "--python",
        installed.with_name("python"),
    ]
    words += ["install", "--no-compile", "--only-binary=:all:", "--report", "report.json"]
    brought: set[str] = set()
    for extra in EXTRAS:
        run(*words, f"{wheel}[{extra}]", folder=tmp_path)
        report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
        brought |= {entry["metadata"]["name"].lower().replace("_", "-") for entry in report["install"]}
        wanted = {re.split(r"[^\w-]", each)[0].lower() for each in PROJECT["optional-dependencies"][extra]}
        assert wanted <= brought, extra
        run(installed.with_name("python"), "-c", f"import {', '.join(LIBRARIES[extra])}", folder=tmp_path)
    run(*words[:-2], "--dry-run", f"{wheel}[{','.join(EXTRAS)}]", folder=tmp_path)
    assert "ready" in run(installed, "doctor", folder=tmp_path)
