"""Standard streams that are closed or full: one line where it can be told, and no file in their place."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no full device")

COMMAND = f"'{sys.executable}' -c 'from lippmann.cli import main; main()' "
FULL = "lippmann: standard output: cannot be written: no space is left on the disk; free some space or choose another "


# Without a buffer the disk is found to be full by a command's own print, else by the last act of a command.
@pytest.mark.parametrize(
    ("words", "buffered"), [("info --json PICTURE", ""), ("displays", "1"), ("--help", ""), ("--version", "1")]
)
def test_a_full_standard_output_is_one_line(picture, words, buffered):
    done = shell(words.replace("PICTURE", f"'{picture}'") + " >/dev/full", PYTHONUNBUFFERED=buffered)
    assert (done.returncode, done.stderr) == (2, FULL + "place\n")


def test_a_closed_standard_output_is_one_line(picture):
    done = shell(f"info --json '{picture}' >&-")
    assert done.returncode == 2
    assert done.stderr == (
        "lippmann: standard output: cannot be written: it is closed; send it to a file, or to /dev/null\n"
    )


@pytest.mark.parametrize("streams", ["2>/dev/full", "2>&-", "<&- >/dev/null 2>&-"])
def test_what_standard_error_cannot_take_is_lost(picture, tmp_path, streams):
    assert shell(f"info '{tmp_path}/none.png' {streams}").returncode == 2
    assert shell(f"views '{picture}' -o '{tmp_path}/views' {streams}").returncode == 0
    assert (tmp_path / "views" / "view_0_0.png").read_bytes().startswith(b"\x89PNG")


def test_a_reader_that_has_read_enough_hears_no_complaint():
    assert shell("displays | true").stderr == ""


def shell(line: str, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, **more}
    return subprocess.run(COMMAND + line, shell=True, capture_output=True, text=True, check=False, env=environment)
