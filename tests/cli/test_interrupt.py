"""Ctrl-C is known for what it is, however deep it was wrapped and however early it comes."""

from __future__ import annotations

import subprocess
import sys

import pytest

import lippmann.cli.app


def test_an_interrupt_inside_a_compiled_loop_is_an_interrupt(monkeypatch, capsys):
    def wrapped(*arguments, **options):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise RuntimeError("dr.while_loop(): encountered an exception") from error

    monkeypatch.setattr(lippmann.cli.app, "app_of", lambda words: wrapped)
    assert lippmann.cli.run(["info", "x.png"]) == 130
    assert capsys.readouterr().err == "lippmann: stopped; nothing was written\n"


LINE = "lippmann: stopped; nothing was written\n"


def interrupted(code: str) -> subprocess.CompletedProcess[str]:
    start = "import os, signal, sys\nimport lippmann.cli\n"
    words = [sys.executable, "-c", start + code + "\nlippmann.cli.main(['displays'])"]
    return subprocess.run(words, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("module", ["typer", "lippmann.cli.app", "lippmann.display.formats.load"])
def test_an_interrupt_while_modules_are_loaded_is_one_line(module):
    done = interrupted(
        "class Finder:\n"
        "    def find_spec(self, name, *rest):\n"
        f"        if name == {module!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())"
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINE)


def test_an_interrupt_in_a_destructor_is_heard():
    done = interrupted(
        "class Late:\n"
        "    def __del__(self): os.kill(os.getpid(), signal.SIGINT)\n"
        "import lippmann.display.formats.load as load\n"
        "real = load._preset_texts\n"
        "def slow():\n"
        "    Late()\n"
        "    import time; time.sleep(20)\n"
        "load._preset_texts = slow"
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINE)


def test_who_ignores_interrupts_goes_on_ignoring_them():
    done = interrupted("signal.signal(signal.SIGINT, signal.SIG_IGN)\nos.kill(os.getpid(), signal.SIGINT)")
    assert done.returncode == 0
