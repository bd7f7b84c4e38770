"""The files that set Lippmann up elsewhere say what ``pyproject.toml`` and the ``Makefile`` say."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from lippmann._version import VERSION
from lippmann.runtime import llvm, llvm_install

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECIPE = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8"))
PIXI = tomllib.loads((ROOT / "pixi.toml").read_text(encoding="utf-8"))
WORKFLOW = yaml.safe_load((ROOT / ".github" / "workflows" / "check.yml").read_text(encoding="utf-8"))
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")

#: Names that differ on conda-forge.
CONDA_NAMES = {"DracoPy": "dracopy", "OpenEXR": "openexr-python", "matplotlib": "matplotlib-base"}
OLDEST_PYTHON = PROJECT["requires-python"].removeprefix(">=")


def requirement(line: str) -> tuple[str, str]:
    """Name and versions of ``name>=1,<2; condition``."""
    match = re.fullmatch(r"([\w.-]+?)\s*([<>=].*)?", line.partition(";")[0].strip())
    assert match, line
    return match[1], (match[2] or "").replace(" ", "")


def run_lines() -> list[str]:
    """All commands of the workflow."""
    return [
        line.strip()
        for job in WORKFLOW["jobs"].values()
        for step in job["steps"]
        for line in step.get("run", "").splitlines()
    ]


def make_commands(target: str) -> list[str]:
    """The commands of a target of the Makefile, without the folder of the environment."""
    body = re.search(rf"^{target}:.*\n((?:\t.*\n)+)", MAKEFILE, re.M)
    assert body, target
    return [line.strip().replace(".venv/bin/", "") for line in body[1].splitlines()]


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_an_environment_of_another_folder_is_not_emptied(tmp_path):
    kept = tmp_path / "other" / "kept"
    kept.parent.mkdir()
    kept.write_text("")
    (tmp_path / "clone").mkdir()
    shutil.copytree(ROOT / "scripts", tmp_path / "clone" / "scripts")
    (tmp_path / "clone" / ".venv").symlink_to(kept.parent)
    command = ["bash", str(tmp_path / "clone" / "scripts" / "setup.sh")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, kept.exists()) == (1, True)
    assert "remove the link: rm .venv" in done.stdout + done.stderr


def test_the_recipe_has_the_dependencies_of_the_package():
    listed = [
        line for line in RECIPE["requirements"]["run"] if isinstance(line, str) and not line.startswith("python ")
    ]
    expected = dict(requirement(line) for line in PROJECT["dependencies"])
    assert dict(map(requirement, listed)) == {CONDA_NAMES.get(name, name): pin for name, pin in expected.items()}


def test_the_recipe_builds_this_package():
    assert RECIPE["package"]["name"] == PROJECT["name"]
    assert RECIPE["context"]["version"] == VERSION
    assert RECIPE["context"]["python_min"] == OLDEST_PYTHON
    assert RECIPE["about"]["license"] == PROJECT["license"]
    assert RECIPE["about"]["summary"] == PROJECT["description"]
    [(name, target)] = PROJECT["scripts"].items()
    assert RECIPE["build"]["python"]["entry_points"] == [f"{name} = {target}"]
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
    assert [requirement(line) for line in build] == [requirement(RECIPE["requirements"]["host"][-1])]


@pytest.mark.parametrize("system", ["linux", "darwin", "win32"])
def test_llvm_from_conda_forge_is_that_of_the_doctor(system, tmp_path):
    (tmp_path / "env" / "conda-meta").mkdir(parents=True)
    machine = llvm_install.Machine(system, tmp_path / "env", {})
    package = llvm_install.remedy(llvm.OLDEST, llvm.NEWEST_TRIED, machine).command[-1]
    choice = next(line for line in RECIPE["requirements"]["run"] if isinstance(line, dict))
    assert package in choice["then" if system == "win32" else "else"]
    assert package in PIXI["target"]["win-64" if system == "win32" else "unix"]["dependencies"]


def test_llvm_of_the_containers_serves():
    for text in (DOCKERFILE, "\n".join(run_lines())):
        versions = [int(number) for number in re.findall(r"\blibllvm(\d+)\b", text)]
        assert versions
        assert all(llvm.OLDEST <= version <= llvm.NEWEST_TRIED for version in versions)


def test_pixi_takes_all_else_from_the_package():
    assert set(PIXI["dependencies"]) == {"python"}
    assert PIXI["dependencies"]["python"].startswith(PROJECT["requires-python"] + ",")
    assert PIXI["pypi-dependencies"] == {"lippmann": {"path": ".", "editable": True}}
    assert PIXI["feature"]["dev"]["pypi-dependencies"]["lippmann"]["extras"] == ["dev"]
    assert "dev" in PROJECT["optional-dependencies"]


def test_every_check_is_that_of_make():
    tasks = PIXI["feature"]["dev"]["tasks"]
    checks = [tasks[name] for name in tasks["check"]["depends-on"]]
    expected = make_commands("lint") + [
        line.replace("$(JOBS)", "2").replace(" $(PYTEST)", "") for line in make_commands("check")
    ]
    assert checks == expected
    assert [line for line in run_lines() if line in expected] == expected


def test_the_workflow_covers_three_systems_and_the_oldest_python():
    matrix = WORKFLOW["jobs"]["check"]["strategy"]["matrix"]
    assert {name.split("-")[0] for name in matrix["os"]} == {"ubuntu", "macos", "windows"}
    assert any(name.endswith("-arm") for name in matrix["os"])
    assert matrix["python"][0] == OLDEST_PYTHON
    newest = max(tuple(map(int, version.split("."))) for version in matrix["python"])
    assert PIXI["dependencies"]["python"].endswith(f",<{newest[0]}.{newest[1] + 1}")
    assert {"make test", "docker build --target check ."} <= set(run_lines())


def test_all_tests_are_run_each_week():
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "all-tests.yml").read_text(encoding="utf-8"))
    assert workflow[True]["schedule"]  # YAML 1.1 reads the key ``on`` as true
    assert {"make test", "make test-long"} <= {step.get("run") for step in workflow["jobs"]["all-tests"]["steps"]}


def test_the_container_copies_what_is_there_and_runs_the_check():
    stages = re.findall(r"^FROM \S+ AS (\w+)$", DOCKERFILE, re.M)
    assert stages == ["system", "check", "lippmann"]
    assert "RUN make check" in DOCKERFILE.split("AS check")[1].split("FROM")[0]
    assert DOCKERFILE.index("ARG BASE=") < DOCKERFILE.index("FROM ${BASE}")
    for line in re.findall(r"^COPY (.+) \S+$", DOCKERFILE, re.M):
        assert all((ROOT / name).exists() for name in line.split()), line
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert not {"src", "tests", "scripts", "Makefile", "pyproject.toml"} & set(ignored)


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == VERSION
    assert re.fullmatch(r"\d{4}-\d{2}-\d{2}", str(citation["date-released"]))
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"version {VERSION}, {str(citation['date-released'])[:4]}" in readme
    assert citation["title"] in readme
    assert citation["references"][0]["title"] in " ".join(readme.split())
