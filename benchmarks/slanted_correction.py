"""What corrected pictures gain under slanted lenses, over pictures along true directions: docs/background/optics.md.

python benchmarks/slanted_correction.py [SCENE ...]

Each bundled scene, or each scene or file named, is rendered for a part of a 15.6-inch 4K panel behind an acrylic sheet.
Rays go all across the lenses. The light that windows of rows send through the lenses is compared with rays in
directions that were not solved for: the middles of thirds of pixels, where the correction knows halves. Windows of 6
rows were solved for, those of 10 and 12 were not. Light is that over the light of a white panel, which is even in
windows of 6 and 12 rows, and has waves of 17 % in those of 10. `gain` is over the picture along true directions, `gain
over t/n` over that of a pinhole at thickness over index, whose rays go through the middles. `told` is the gain that the
program prints. Writes benchmarks/results/slanted_correction.json, where other scenes keep their rows.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness import RESULTS, machine, save
from lippmann.display import load_display
from lippmann.optics.correction import TOLERANCE, LensCorrection, parts_beside
from lippmann.optics.slanted_correction import SlantedRows
from lippmann.rendering.picture import choose_exposure
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.bundled import names
from lippmann.scene.readers.load import load_scene
from part_rays import render

DISPLAY = load_display(Path(__file__).parent / "slanted_panel.toml").resized(240, 120)
SIMPLE = replace(DISPLAY, lens=None, distortion=None, gap=DISPLAY.lens.thickness / DISPLAY.lens.index)
SAMPLES, TRUTH_SAMPLES = 64, 128
JUDGED, WINDOWS = (-1 / 3, 0.0, 1 / 3), (6, 10, 12)


def render_part(scene, exposure, beside, samples, seed=0):
    """Rays half a sub-pixel wide, so many pixels beside its middle."""
    return render(scene, DISPLAY, exposure, samples, beside=3.0 * beside, width=0.5, seed=seed)


def gain(display, there, rows, before, after, truth):
    """Decibels by which eyes see ``after`` nearer to the truth, in windows of so many rows."""
    judge = type("Windows", (SlantedRows,), {"window": rows})(display, display.panel.subpixel_offsets, JUDGED)
    pictures, goal = [np.ascontiguousarray(each) for each in (before, after)], judge.light_meant(truth, 0)
    worse, better = (np.nanmean((light - goal) ** 2) for light in judge.eyes(there)(pictures, 0))
    return 10.0 * float(np.log10(worse / better))


known = RESULTS / "slanted_correction.json"
rows = json.loads(known.read_text(encoding="utf-8"))["rows"] if known.exists() else []
for given in sys.argv[1:] or names():
    scene, name = load_scene(given), Path(given).parent.name or given
    rows = [row for row in rows if row["scene"] != name]
    exposure = choose_exposure(scene, DISPLAY, RenderRequest(integrator="direct", threads=1))
    # Each has random numbers of its own: else the noise of all would be the same.
    halves = [
        [
            render_part(scene, exposure, beside, SAMPLES // 4, seed=2 + part + 10 * half)
            for part, beside in enumerate(parts_beside())
        ]
        for half in range(2)
    ]
    plain = render(scene, DISPLAY, exposure, SAMPLES)
    simple = render(scene, SIMPLE, exposure, SAMPLES)
    truth = np.stack([render_part(scene, exposure, beside, TRUTH_SAMPLES, seed=1) for beside in JUDGED])
    correction = LensCorrection(DISPLAY, subpixels=True)
    step = correction.step([(0, halves)])
    corrected = correction.rows(np.mean(halves, axis=0), share=step.share)
    exact, over_simple = (
        {str(n): gain(DISPLAY, DISPLAY, n, before, corrected, truth) for n in WINDOWS} for before in (plain, simple)
    )
    off = {}
    for value in ("radius", "thickness", "index"):
        for factor in (1 - TOLERANCE, 1 + TOLERANCE):
            there = replace(DISPLAY, lens=replace(DISPLAY.lens, **{value: factor * getattr(DISPLAY.lens, value)}))
            off[f"{value} x {factor:g}"] = gain(DISPLAY, there, WINDOWS[0], plain, corrected, truth)
    told = step.gains["exact"]
    gains = {"gain": exact, "gain over t/n": over_simple, "told": told, "gain where off": off}
    rows.append({"scene": name, "share": step.share, **gains})
    shown = [{k: round(v, 2) for k, v in gains.items()} for gains in (exact, over_simple)]
    print(name, *shown, round(step.share, 2), round(told, 2), round(min(off.values()), 2), flush=True)
    save("slanted_correction", {"machine": machine(), "samples": SAMPLES, "rows": rows}, show=False)
