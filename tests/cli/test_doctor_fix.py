"""``lippmann doctor --fix`` on machines that lack LLVM: what is run, what is only said, and the check afterwards."""

from __future__ import annotations

import sys

import pytest

from lippmann.runtime import engine, llvm, llvm_install
from lippmann.runtime.engine import Check, Diagnosis, Engine
from lippmann.runtime.llvm_install import Remedy

READY = Diagnosis((Check("LLVM", True, "19.1"),), Engine("llvm_ad_rgb", "cpu", 2))
NO_LLVM = Diagnosis((Check("LLVM", False, "no usable LLVM library is installed", "install it"),), None)
NO_PACKAGE = Diagnosis((Check("LLVM", True, "19.1"), Check("test render", False, "wrong", "reinstall Lippmann")), None)


@pytest.fixture
def machine(monkeypatch):
    """``machine(before, after, remedy)``: the diagnoses in turn, and how LLVM is installed."""
    monkeypatch.delenv(llvm.PATH_VARIABLE, raising=False)

    def made(before, after, remedy=None):
        diagnoses = iter((before, after))
        monkeypatch.setattr(engine, "diagnose", lambda: next(diagnoses))
        monkeypatch.setattr(llvm_install, "remedy", lambda oldest, newest: remedy)

    return made


def test_what_may_be_run_is_run_and_checked_again(lippmann, machine):
    machine(NO_LLVM, READY, Remedy((sys.executable, "-c", "print('fetched')"), "brew install llvm"))
    done = lippmann("doctor", "--fix", "--json")
    assert done.code == 0
    assert done.json["ok"] is True
    assert "running: " in done.err
    assert "fetched" in done.err


def test_what_needs_more_rights_is_said(lippmann, machine):
    machine(
        NO_LLVM, None, Remedy((sys.executable, "-c", "raise SystemExit(5)"), "sudo apt-get install it", "no rights")
    )
    done = lippmann("doctor", "--fix")
    assert done.code == 1
    assert "no rights. Do this: sudo apt-get install it" in done.err
    assert "not ready to render" in done.out
    assert "running" not in done.err


def test_a_command_that_fails_leaves_the_command_to_the_user(lippmann, machine):
    machine(NO_LLVM, NO_LLVM, Remedy((sys.executable, "-c", "raise SystemExit(5)"), "brew install llvm"))
    done = lippmann("doctor", "--fix")
    assert done.code == 1
    assert "ended with exit code 5. Do this: brew install llvm" in done.err


def test_nothing_is_installed_for_other_problems(lippmann, machine, monkeypatch):
    machine(NO_PACKAGE, None)
    done = lippmann("doctor", "--fix")
    assert done.code == 1
    assert "reinstall Lippmann" in done.out
    assert "no package to install" in done.err
    machine(NO_LLVM, None)
    monkeypatch.setenv(llvm.PATH_VARIABLE, "/nowhere/libLLVM.so")
    assert f"unset {llvm.PATH_VARIABLE}" in lippmann("doctor", "--fix").err


def test_without_the_option_nothing_is_run(lippmann, machine):
    machine(NO_LLVM, None)
    assert lippmann("doctor").code == 1


def test_a_machine_that_is_ready_is_left_alone(lippmann, machine):
    machine(READY, None)
    done = lippmann("doctor", "--fix")
    assert done.code == 0
    assert done.err == ""
