"""What correcting a picture for its lens takes, without rendering: docs/background/optics.md.

python benchmarks/lens_correction_time.py

An 8 x 10 inch print at 720 ppi (41 million pixels), in bands of rows as `lippmann weave` takes them, and a 4K panel
under slanted lenses, in one piece; of light at random. Processor time on both cores together, kernels warm, and the
peak memory of the whole process. Writes benchmarks/results/lens_correction_time.json. A minute on two cores.
"""

from __future__ import annotations

import resource
import time
from pathlib import Path

import numpy as np

from harness import machine, save
from lippmann.display import load_display
from lippmann.optics.correction import PARTS, LensCorrection


def measure(name: str, display, rows: int) -> dict[str, object]:
    panel = display.panel
    subpixels = len(set(panel.subpixel_offsets)) > 1
    light = np.random.default_rng(1).random((PARTS, rows, panel.width, 3), dtype=np.float32)
    LensCorrection(display.resized(320, 64), subpixels).rows([part[:64, :320].copy() for part in light])
    began, clock = time.process_time(), time.perf_counter()
    correction = LensCorrection(display, subpixels)
    for first in range(0, panel.height, rows):
        correction.rows([part[: panel.height - first] for part in light], first)
    row = {
        "display": name,
        "pixels": panel.width * panel.height,
        "processor seconds": time.process_time() - began,
        "seconds": time.perf_counter() - clock,
        "peak GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }
    print(row, flush=True)
    return row


slanted = load_display(Path(__file__).parent / "slanted_panel.toml")
sheet = load_display("print:lpi=60,ppi=720,size=8x10in,thickness=26mil")
measured = [measure("8 x 10 inch print", sheet, 256), measure("4K panel, slanted lenses", slanted, 2160)]
save("lens_correction_time", {"machine": machine(), "rows": measured}, show=False)
