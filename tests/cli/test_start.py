"""Starting is cheap: help and import load neither Mitsuba nor NumPy."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

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


def run_python(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


KEPT = """
import atexit, os, sys, lippmann.cli
class Kept:
    def __del__(self, write=os.write): write(2, b"taken down")
sys.kept = Kept()
sys.argv[1:] = ["displays"]
{}
"""


def test_a_command_ends_without_taking_the_interpreter_down_unless_somebody_has_to_hear_of_it():
    done = run_python(KEPT.format("lippmann.cli.main()"))
    assert (done.returncode, done.stderr) == (0, "")
    done = run_python(KEPT.format("atexit.register(print, 'heard'); lippmann.cli.main()"))
    assert (done.returncode, done.stdout.split()[-1], done.stderr) == (0, "heard", "taken down")


def test_a_program_that_calls_a_command_goes_on_after_it():
    done = run_python(KEPT.format("try: lippmann.cli.main(['displays'])\nexcept SystemExit: pass\nsys.exit(3)"))
    assert (done.returncode, done.stderr) == (3, "taken down")


@pytest.mark.parametrize(
    ("command", "code"),
    [("raise SystemExit(130)", 130), ("raise SystemExit('so')", 1), ("raise SystemExit", 0), ("raise KeyError", 1)],
)
def test_the_exit_code_is_the_commands_own(command, code):
    lines = "import lippmann.cli.commands.system as system\ndef displays():\n    print('all said')\n"
    end = f"    {command}\nsystem.displays = displays\nimport sys, lippmann.cli\n"
    end += "sys.argv[1:] = ['displays', '--debug']\nlippmann.cli.main()"
    done = run_python(lines + end)
    assert (done.returncode, done.stdout) == (code, "all said\n")


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted as Linux lists them")
def test_a_command_leaves_no_threads_waiting_for_linear_algebra():
    lines = "import os, lippmann.cli.commands.system as system\ndef displays():\n    import numpy\n"
    end = "    print(len(os.listdir('/proc/self/task')))\nsystem.displays = displays\n"
    done = run_python(lines + end + "import lippmann.cli\nlippmann.cli.main(['displays'])")
    assert (done.stdout, done.stderr) == ("1\n", "")


def test_an_option_of_the_command_at_hand_is_known_without_loading_the_others():
    code = (
        "import sys\nfrom lippmann.cli.app import app_of\nfrom lippmann.cli.shared.command_options import translate\n"
        "app_of(['preview'])\nprint(translate('spp=3'), 'lippmann.cli.commands.interlace' in sys.modules)\n"
        "print(translate('photos=...'), 'lippmann.cli.commands.interlace' in sys.modules)"
    )
    assert run_python(code).stdout.splitlines() == ["--spp 3 False", "PHOTOS True"]


def test_pythons_module_is_the_command():
    command = [sys.executable, "-m", "lippmann", "bogus"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "lippmann: No such command 'bogus'; see 'lippmann --help'\n"
