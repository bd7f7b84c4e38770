"""Ctrl-C is known for what it is, however deep it was wrapped and however early it comes."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

import lippmann.cli.app
from lippmann.runtime import atomic_write


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


#: A command that waits, then takes a while to put its files in order, and says so on standard output.
SLOW_END = """
import time
import lippmann.cli.commands.system as system
def displays():
    try:
        print("waits", flush=True)
        time.sleep(20)
    finally:
        print("begins", flush=True)
        time.sleep(0.3)
        print("ends", flush=True)
system.displays = displays
"""


@pytest.mark.slow
@pytest.mark.usefixtures("hangup_ends")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_that_follow_do_not_disturb_the_end(number):
    words = [sys.executable, "-c", f"import lippmann.cli\n{SLOW_END}\nlippmann.cli.main(['displays'])"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    said = [process.stdout.readline()]
    time.sleep(0.2)  # an interrupt within a write makes Python write twice
    process.send_signal(number)
    said.append(process.stdout.readline())
    for each in (number, signal.SIGINT, signal.SIGTERM):
        process.send_signal(each)
    output, errors = process.communicate(timeout=20)
    assert "".join([*said, output]).split() == ["waits", "begins", "ends"]
    assert (process.returncode, errors) == (130, LINE)


@pytest.mark.slow
def test_a_hangup_that_is_ignored_stays_ignored():
    done = interrupted("signal.signal(signal.SIGHUP, signal.SIG_IGN)\nos.kill(os.getpid(), signal.SIGHUP)")
    assert done.returncode == 0


@pytest.mark.slow
def test_an_interrupt_that_strikes_the_end_itself_leaves_nothing(tmp_path):
    """Ctrl-C while a temporary folder is removed: the last act of the process removes it."""
    done = interrupted(
        "import shutil, lippmann.cli.commands.system as system\n"
        "from lippmann.runtime.atomic_write import scratch_folder\n"
        "real = shutil.rmtree\n"
        "def struck(*words, **more):\n"
        "    shutil.rmtree = real\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "def displays():\n"
        f"    with scratch_folder('lippmann-x-', {str(tmp_path)!r}) as folder:\n"
        "        open(folder + '/f', 'w').close()\n"
        "        shutil.rmtree = struck\n"
        "system.displays = displays"
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINE)
    assert list(tmp_path.iterdir()) == []


def test_the_line_says_what_lies_on_disk(monkeypatch, capsys):
    def command(*arguments, **options):
        atomic_write.remark("finished tiles are kept in x.tif.parts: with resume=True the command goes on")
        raise KeyboardInterrupt

    monkeypatch.setattr(lippmann.cli.app, "app_of", lambda words: command)
    assert lippmann.cli.run(["render"]) == 130
    line = "lippmann: stopped; finished tiles are kept in x.tif.parts: with --resume the command goes on\n"
    assert capsys.readouterr().err == line
    monkeypatch.setattr(lippmann.cli.app, "app_of", lambda words: lambda *_, **__: 0)
    assert lippmann.cli.run(["info"]) == 0
    assert atomic_write.last_remark() == ""
