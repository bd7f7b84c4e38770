"""What corrected pictures gain under slanted lenses, over pictures along true directions: docs/background/optics.md.

python benchmarks/slanted_correction.py [SCENE ...]

Each bundled scene, or each scene or file named, is rendered for a part of a 15.6-inch 4K panel behind an acrylic sheet.
The light that windows of rows send through the lenses is compared with rays in directions that were not solved for: the
middles of thirds of pixels, where the correction knows halves. Windows of 6 rows were solved for, those of 10 were not.
`told` is the gain that the program prints. Writes benchmarks/results/slanted_correction.json, where other scenes keep
their rows.
"""

from __future__ import annotations

import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness import RESULTS, machine, save
from lippmann.display import load_display
from lippmann.optics.correction import TOLERANCE, LensCorrection, parts_beside
from lippmann.optics.slanted_correction import SlantedRows
from lippmann.rendering.picture import choose_exposure, render_picture
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime import engine
from lippmann.scene.bundled import names
from lippmann.scene.readers.load import load_scene

PANEL = """
viewing_distance = 600
[panel]
width = 240
height = 120
pixel_pitch = "282.4 dpi"
subpixel_offsets = "rgb"
[lens_array]
layout = "lenticular"
pitch = "45.5 lpi"
slant = 9.46
[lens]
thickness = 1.4
index = 1.49
"""
SAMPLES, TRUTH_SAMPLES = 64, 128
JUDGED, WINDOWS = (-1 / 3, 0.0, 1 / 3), (6, 10)


def render(scene, display, exposure, beside, width, samples, seed=0):
    """The picture of sub-pixels so many pixels beside their middles, ``width`` thirds of a pixel wide."""
    engine.start()
    # What knows the class of rays is loaded before another takes its place.
    from lippmann.rendering import methods  # noqa: F401
    from lippmann.rendering.transport import ray_source

    whole = ray_source.DisplayRays

    class PartRays(whole):
        def light_rays(self, column, row, channel, jitter):
            import mitsuba as mi

            jitter = mi.Point2f(0.5 + 3.0 * beside + (jitter.x - 0.5) * width, jitter.y)
            return super().light_rays(column, row, channel, jitter)

    request = RenderRequest(
        integrator="direct",
        spp=samples,
        seed=seed,
        denoise="none",
        method="full",
        subpixels=True,
        threads=1,
        exposure=exposure,
        tone_map="none",
    )
    ray_source.DisplayRays = PartRays
    try:
        return render_picture(scene, display, request).pixels.clip(0.0, 1.0)
    finally:
        ray_source.DisplayRays = whole


def gain(display, there, rows, before, after, truth):
    """Decibels by which eyes see ``after`` nearer to the truth, in windows of so many rows."""
    judge = type("Windows", (SlantedRows,), {"window": rows})(display, display.panel.subpixel_offsets, JUDGED)
    worse, better = (judge.squared_error(np.ascontiguousarray(each), truth, 0, there) for each in (before, after))
    return 10.0 * float(np.log10(worse / better))


with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "slanted.toml"
    file.write_text(PANEL, encoding="utf-8")
    DISPLAY = load_display(file)

known = RESULTS / "slanted_correction.json"
rows = json.loads(known.read_text(encoding="utf-8"))["rows"] if known.exists() else []
for given in sys.argv[1:] or names():
    scene, name = load_scene(given), Path(given).parent.name or given
    rows = [row for row in rows if row["scene"] != name]
    exposure = choose_exposure(scene, DISPLAY, RenderRequest(integrator="direct", threads=1))
    parts = [render(scene, DISPLAY, exposure, beside, 0.5, SAMPLES // 2) for beside in parts_beside()]
    plain = render(scene, DISPLAY, exposure, 0.0, 1.0, SAMPLES)
    truth = np.stack([render(scene, DISPLAY, exposure, beside, 0.5, TRUTH_SAMPLES, seed=1) for beside in JUDGED])
    correction = LensCorrection(DISPLAY, subpixels=True)
    corrected = correction.rows(parts)
    exact = {str(n): gain(DISPLAY, DISPLAY, n, plain, corrected, truth) for n in WINDOWS}
    off = {}
    for value in ("radius", "thickness", "index"):
        for factor in (1 - TOLERANCE, 1 + TOLERANCE):
            there = replace(DISPLAY, lens=replace(DISPLAY.lens, **{value: factor * getattr(DISPLAY.lens, value)}))
            off[f"{value} x {factor:g}"] = gain(DISPLAY, there, WINDOWS[0], plain, corrected, truth)
    told = correction.gains(corrected, parts)["exact"]
    rows.append({"scene": name, "gain": exact, "told": told, "gain where off": off})
    print(name, {k: round(v, 2) for k, v in exact.items()}, round(told, 2), round(min(off.values()), 2), flush=True)
    save("slanted_correction", {"machine": machine(), "samples": SAMPLES, "rows": rows}, show=False)
