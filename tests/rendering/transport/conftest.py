"""Pictures of the program Tachyon, and how far ours agree with them."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from lippmann import api

# Modules that only these tests use lie beside them.
sys.path.insert(0, str(Path(__file__).parent))

SIZE = 128
#: Colours of neighbours that differ more than this are an edge: a hair's breadth decides what a ray meets there.
EDGE = 0.04


@dataclass(frozen=True)
class Tachyon:
    """Renders scenes by the program and by our integrator, and compares them."""

    def picture(self, folder, name, out, *options):
        """Tachyon's picture ``(SIZE, SIZE, 3)`` in [0, 1], from 16-bit values."""
        command = [
            "tachyon",
            name,
            "-numthreads",
            "2",
            "-res",
            str(SIZE),
            str(SIZE),
            "-o",
            str(out),
            "-format",
            "PPM48",
        ]
        subprocess.run([*command, *options], cwd=folder, check=True, stdout=subprocess.DEVNULL, timeout=120)
        data = out.read_bytes()
        header = re.match(rb"P6\s+(\d+)\s+(\d+)\s+65535\s", data)
        assert header is not None
        assert (int(header[1]), int(header[2])) == (SIZE, SIZE)
        return np.frombuffer(data[header.end() :], ">u2").reshape(SIZE, SIZE, 3) / 65535.0

    def ours(self, path, spp=1):
        """Our picture of the same file, from its camera."""
        preview = api.preview(api.load_scene(path), size=(SIZE, SIZE), spp=spp)
        assert preview.provenance.integrator == "classic"
        assert preview.provenance.transfer == "linear"
        return np.clip(preview.pixels, 0, 1)

    def psnr(self, a, b, mask=None):
        error = (a - b) ** 2
        if mask is not None:
            error = error[mask]
        return -10 * np.log10(max(error.mean(), 1e-12))

    def off_edges(self, *pictures):
        """Pixels whose eight neighbours have nearly their colour in all pictures."""
        return np.logical_and.reduce([_is_smooth(picture) for picture in pictures])


def _is_smooth(picture):
    padded = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    around = [padded[y : y + SIZE, x : x + SIZE] for y in range(3) for x in range(3)]
    return (np.max(around, axis=0) - np.min(around, axis=0)).max(axis=-1) < EDGE


@pytest.fixture(scope="session")
def tachyon():
    return Tachyon()
