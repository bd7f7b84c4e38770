"""What correcting a picture for its lens takes, without rendering: docs/background/optics.md.

python benchmarks/lens_correction_time.py

The whole correction: the share, then least squares. An 8 x 10 inch print at 720 ppi (41 million pixels) as `lippmann
weave` corrects it, in bands of rows; a 4K panel under slanted lenses as `lippmann render` does, in one piece, from two
halves of its samples; both of light at random. Kernels are warm. Two free cores take about as long as the main thread,
which does half of what is shared out. The peak memory is that of the whole process, with the light and the picture.
Writes benchmarks/results/lens_correction_time.json. A minute on two cores.
"""

from __future__ import annotations

import resource
import time
from pathlib import Path

import numpy as np

from harness import machine, save
from lippmann.display import load_display
from lippmann.optics.correction import PARTS, LensCorrection, judged_rows


def measure(name: str, display, rows: int, halves: int) -> dict[str, object]:
    panel = display.panel
    subpixels = len(set(panel.subpixel_offsets)) > 1
    light = np.random.default_rng(1).random((PARTS, rows, panel.width, 3), dtype=np.float32)
    # The halves are alike: noise of their own would leave nothing to solve for.
    given = [light, *(light.copy() for _ in range(1, halves))]
    correct(LensCorrection(display.resized(320, 64), subpixels), [light[:, :64, :320]] * halves)
    began, main, clock = time.process_time(), time.thread_time(), time.perf_counter()
    share = correct(LensCorrection(display, subpixels), given)
    row = {
        "display": name,
        "pixels": panel.width * panel.height,
        "share": share,
        "processor seconds": time.process_time() - began,
        "of the main thread": time.thread_time() - main,
        "seconds": time.perf_counter() - clock,
        "peak GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }
    print(row, flush=True)
    return row


def correct(correction: LensCorrection, halves) -> float:
    """Correct a picture in bands, of the same light. Returns the share."""
    rows, height = halves[0].shape[1], correction.display.panel.height
    judged = [(band, np.arange(band.start, band.stop) % rows) for band in judged_rows(height)]
    step = correction.step([(band.start, [half[:, at] for half in halves]) for band, at in judged])
    light = np.mean(halves, axis=0)
    for first in range(0, height, rows):
        correction.rows(light[:, : height - first], first, step.share)
    return step.share


slanted = load_display(Path(__file__).parent / "slanted_panel.toml")
sheet = load_display("print:lpi=60,ppi=720,size=8x10in,thickness=26mil")
measured = [measure("8 x 10 inch print", sheet, 256, 1), measure("4K panel, slanted lenses", slanted, 2160, 2)]
save("lens_correction_time", {"machine": machine(), "rows": measured}, show=False)
