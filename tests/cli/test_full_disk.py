"""A disk that takes no more: every writer ends in one line with exit code 2, and leaves nothing behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the system has no limit on the size of files")

#: Commands by what they write; PICTURE is one. The library that a writer needs is loaded while there is room.
WRITERS = {
    "a folder of views": ("views", "PICTURE", "-o", "out"),
    "MP4": ("replay", "PICTURE", "--sweep", "--frames", "3", "--size", "256x256", "-o", "out.mp4"),
    "APNG": ("replay", "PICTURE", "--sweep", "--frames", "3", "--size", "256x256", "-o", "out.png"),
    "OpenEXR": ("replay", "PICTURE", "-o", "out.exr"),
    "TIFF of pages": ("refocus", "PICTURE", "--planes=-5:5:3", "-o", "out.tif"),
    "Zarr": ("export", "PICTURE", "--as", "zarr", "-o", "out.zarr"),
    "MATLAB": ("export", "PICTURE", "--as", "lftoolbox", "-o", "out.mat"),
    "a page": ("view", "PICTURE", "--export", "out.html"),
    "a pattern in TIFF": ("calibrate", "pattern", "stripes", "-d", "seed-lenticular", "-o", "out.tif"),
}

IN_A_FULL_FOLDER = """
import contextlib, io, json, os, resource, sys
from lippmann.cli import run
said = {}
for name, words in json.loads(sys.argv[1]).items():
    told = io.StringIO()
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, resource.RLIM_INFINITY))
    with contextlib.redirect_stderr(told), contextlib.redirect_stdout(io.StringIO()):
        code = run(words)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    said[name] = [code, told.getvalue(), os.listdir()]
json.dump(said, sys.stdout)
"""


@pytest.mark.slow
def test_every_writer_says_it_in_one_line_and_leaves_nothing(picture, tmp_path):
    words = {name: [str(picture) if word == "PICTURE" else word for word in each] for name, each in WRITERS.items()}
    child = subprocess.run(
        [sys.executable, "-c", IN_A_FULL_FOLDER, json.dumps(words)],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    )
    for name, (code, said, left) in json.loads(child.stdout).items():
        assert (code, said.count("\n"), left) == (2, 1, []), (name, said)
        assert ": cannot be written: the file would be larger than the system allows here" in said, name
