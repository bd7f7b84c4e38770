"""How LLVM is installed on each system: machines by their package managers and rights."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from lippmann.runtime import llvm_install
from lippmann.runtime.llvm_install import Machine, Remedy, remedy

OLDEST, NEWEST = 17, 22


def remedy_on(
    system: str, *programs: str, root: bool = False, apt: tuple[str, ...] = (), prefix: Path = Path("/venv"), **set: str
) -> Remedy:
    paths = {name: f"/bin/{name}" for name in programs}
    return remedy(OLDEST, NEWEST, Machine(system, prefix, set, paths.get, root, lambda: list(apt)))


@pytest.mark.parametrize(
    ("system", "program", "text"),
    [
        ("linux", "apt-get", "sudo apt-get install libllvm19"),
        ("linux", "dnf", "sudo dnf install llvm-libs"),
        ("linux", "pacman", "sudo pacman -S llvm-libs"),
        ("linux", "zypper", "sudo zypper install libLLVM19"),
        ("linux", "apk", "sudo apk add llvm19-libs"),
        ("win32", "winget", "winget install --exact --id LLVM.LLVM"),
    ],
)
def test_a_package_manager_of_the_system_runs_only_with_its_rights(system, program, text):
    user, root = remedy_on(system, program), remedy_on(system, program, root=True)
    assert user.text == root.text == text
    assert "rights of an administrator" in user.obstacle
    assert root.obstacle == ""
    assert root.command[0] == f"/bin/{program}"


def test_homebrew_needs_no_more_rights():
    assert remedy_on("darwin", "brew") == Remedy(("/bin/brew", "install", "llvm"), "brew install llvm")
    assert "https://brew.sh" in remedy_on("darwin").obstacle


def test_apt_takes_the_newest_version_that_serves():
    names = ("libllvm9", "libllvm16", "libllvm18", "libllvm20t64", "libllvm23", "libllvm-ocaml-dev")
    assert remedy_on("linux", "apt-get", root=True, apt=names).command == (
        "/bin/apt-get",
        "install",
        "--yes",
        "libllvm20t64",
    )
    assert remedy_on("linux", "apt-get", apt=("libllvm14", "libllvm23")).text.endswith("libllvm19")


def test_no_package_manager():
    found = remedy_on("linux")
    assert found.command == ()
    assert found.text == "install the LLVM runtime library, version 17 or newer"
    assert found.obstacle


@pytest.mark.parametrize(
    ("system", "package"), [("linux", "libllvm19"), ("darwin", "libllvm19"), ("win32", "libllvm-c19")]
)
def test_a_conda_environment_gets_conda_forge_s_package(tmp_path, system, package):
    (tmp_path / "env" / "conda-meta").mkdir(parents=True)
    prefix = tmp_path / "env"
    found = remedy_on(system, "mamba", "brew", "apt-get", prefix=prefix)
    assert found.command == (
        *("/bin/mamba", "install", "--yes", "--prefix", str(prefix), "--channel", "conda-forge"),
        package,
    )
    assert found.text == f"mamba install --channel conda-forge {package}"
    assert found.obstacle == ""
    assert "not on the path" in remedy_on(system, prefix=prefix).obstacle


def test_a_pixi_project_is_asked_through_pixi(tmp_path):
    (tmp_path / "env" / "conda-meta").mkdir(parents=True)
    found = remedy_on("linux", "pixi", "conda", prefix=tmp_path / "env", PIXI_PROJECT_MANIFEST="/p/pixi.toml")
    assert found.command == ("/bin/pixi", "add", "libllvm19")


def test_the_outcome_of_the_command_is_said(capfd):
    assert llvm_install.run(Remedy((sys.executable, "-c", "print('working')"), "")) == ""
    done = capfd.readouterr()
    assert (done.out, done.err) == ("", "working\n")
    problem = llvm_install.run(Remedy((sys.executable, "-c", "raise SystemExit(3)"), ""))
    assert problem.endswith("ended with exit code 3")
    assert "cannot be started" in llvm_install.run(Remedy(("/nowhere/brew",), ""))


def test_a_program_in_the_working_directory_is_not_taken(tmp_path, monkeypatch):
    program = tmp_path / "brew"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", ".")
    assert Machine().find("brew") is None
    monkeypatch.setenv("PATH", str(tmp_path))
    assert Machine().find("brew") == str(program)
