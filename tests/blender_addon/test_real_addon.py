"""The packed add-on in a real Blender: installed, used for previews and renders, taken away again."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
DISPLAY = """\
gap = 6.8
viewing_distance = "infinite"
panel = {width = 64, height = 64, pixel_pitch = "96 dpi"}
lens_array = {layout = "lenticular", pitch = "8 px"}
"""


def test_the_addon(blender_command, packed, tmp_path):
    (tmp_path / "small.toml").write_text(DISPLAY)
    command = tmp_path / "lippmann"
    # Blender hands its environment on, less what is for its own Python.
    code = "from lippmann.cli import main; main()"
    head = f"exec env PYTHONPATH={shlex.quote(os.pathsep.join(filter(None, sys.path)))}"
    command.write_text(f'#!/bin/sh\n{head} {shlex.quote(sys.executable)} -c {shlex.quote(code)} "$@"\n')
    command.chmod(0o755)
    words = [*blender_command, str(HERE / "run_in_blender.py"), "--", str(packed), str(command), str(tmp_path)]
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")}
    run = subprocess.run(words, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout[-2000:] + run.stderr[-4000:]
    assert "the add-on works" in run.stdout
