"""What whole lenses, true directions and corrected pixels gain, as an eye sees them: docs/background/optics.md.

python benchmarks/lens_correction.py [SCENE ...]

Each bundled scene, or each scene or file named, is rendered for a 60-lpi print whose crest is at best focus, and 20 %
above the paraxial focus. Pictures: `pinhole`, rays through the middles of lenses along the directions of a pinhole at
thickness over index; `t/n`, the same directions all across the lenses; `plain`, all across along true directions, which
`render` makes; `least squares`; and `corrected`, the step toward these that `--correct lens` takes (`share`).

The light that each picture sends through the lens is compared with rays all across the lenses in directions that were
not solved for: the middles of thirds of pixels, where the correction knows halves. `bound` is the best that any pixels
between black and white can do: solved for these very directions, of this very light. Writes
benchmarks/results/lens_correction.json, where other scenes keep their rows.
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
from lippmann.optics.pixel_shares import pixel_shares
from lippmann.rendering.picture import choose_exposure
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.bundled import names
from lippmann.scene.readers.load import load_scene
from part_rays import render

SHEET = "print:lpi=60,ppi=720,size=10x5mm,thickness=26mil"
CRESTS = {"best focus": "", "R + 20 %": ",radius=0.2877mm"}
#: Of pictures, and of each part of the light that they are held against: its noise lies 10 dB below their errors.
SAMPLES, TRUTH_SAMPLES = 64, 64
#: Parts of a pixel that are judged: the outer thirds.
JUDGED = (-1 / 3, 1 / 3)


def light_table_of(display, own):
    """``(n, width)`` shares of the pixels in the light of the directions that are judged, those of ``own`` pixels."""
    width, tables = own.panel.width, []
    for beside in JUDGED:
        u = np.arange(width) + 0.5 + beside
        x, y = own.panel_point(u, 0.0 * u)
        lens, _ = own.lens_of(x, y)
        place = x - own.lens_center(lens, 0.0 * lens, x, y)[0]
        shares = pixel_shares(display, lens, -own.pinhole_place(place) / own.gap)
        columns = np.clip(shares.first[:, None] + np.arange(shares.shares.shape[1]), 0, width - 1)
        table = np.zeros((width, width))
        np.add.at(table, (np.arange(width)[:, None], columns), shares.shares)
        tables.append(table)
    return np.concatenate(tables)


def columns_of(pixels):
    """``(width, rows x 3)`` of pixels ``(rows, width, 3)``."""
    return pixels.transpose(1, 0, 2).reshape(pixels.shape[1], -1).astype(np.float64)


def seen_error(table, columns, truth):
    """Mean squared error of what eyes see."""
    return float(np.mean((table @ columns - truth) ** 2))


def best(table, truth, steps=400):
    """Columns of the pixels between black and white of least error."""
    normal, goal = table.T @ table, table.T @ truth
    step, t = 1.0 / np.linalg.norm(normal, 2), 1.0
    solved = ahead = np.clip(np.linalg.lstsq(table, truth, rcond=1e-9)[0], 0.0, 1.0)
    for _ in range(steps):
        after = np.clip(ahead - step * (normal @ ahead - goal), 0.0, 1.0)
        t, before = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * t * t)), t
        ahead, solved = after + (before - 1.0) / t * (after - solved), after
    return solved


def decibels(error):
    return -10.0 * float(np.log10(error))


def measure(scene, crest):
    own = load_display(SHEET + CRESTS[crest])
    exposure = choose_exposure(scene, own, RenderRequest(integrator="direct", threads=1))
    simple = replace(own, distortion=None, gap=own.lens.thickness / own.lens.index)
    # Each has random numbers of its own: else the noise of all would be the same.
    halves = [
        [
            render(scene, own, exposure, SAMPLES // 4, beside=each, width=0.5, seed=2 + part + 10 * half)
            for part, each in enumerate(parts_beside())
        ]
        for half in range(2)
    ]
    correction, light = LensCorrection(own), np.mean(halves, axis=0)
    step = correction.step([(0, halves)])
    pictures = {
        "pinhole": render(scene, replace(simple, lens=None), exposure, SAMPLES),
        "t/n": render(scene, simple, exposure, SAMPLES),
        "plain": light.mean(axis=0),
        "least squares": correction.rows(light),
        "corrected": correction.rows(light, share=step.share),
    }
    columns = {name: columns_of(pixels) for name, pixels in pictures.items()}
    table = light_table_of(own, own)
    thirds = (render(scene, own, exposure, TRUTH_SAMPLES, beside=each, width=1 / 3, seed=1) for each in JUDGED)
    truth = np.concatenate([columns_of(pixels) for pixels in thirds])
    judged = {**columns, "bound": best(table, truth)}
    off = {
        name: [
            gain_where_off(own, value, factor, columns["plain"], columns[name], truth)
            for value in ("radius", "thickness", "index")
            for factor in (1 - TOLERANCE, 1 + TOLERANCE)
        ]
        for name in ("least squares", "corrected")
    }
    psnr = {name: decibels(seen_error(table, each, truth)) for name, each in judged.items()}
    return {"psnr": psnr, "share": step.share, "told": step.gains, "gain where off": off}


def gain_where_off(own, value, factor, before, after, truth):
    """Decibels that the correction gains where the lens is another."""
    other = replace(own, lens=replace(own.lens, **{value: factor * getattr(own.lens, value)}))
    table = light_table_of(other, own)
    return decibels(seen_error(table, after, truth)) - decibels(seen_error(table, before, truth))


known = RESULTS / "lens_correction.json"
rows = json.loads(known.read_text(encoding="utf-8"))["rows"] if known.exists() else []
for given in sys.argv[1:] or names():
    scene, name = load_scene(given), Path(given).parent.name or given
    rows = [row for row in rows if row["scene"] != name]
    for crest in CRESTS:
        row = measure(scene, crest)
        rows.append({"scene": name, "crest": crest, **row})
        figures = {name: round(value, 2) for name, value in row["psnr"].items()}
        print(
            name,
            crest,
            figures,
            round(row["share"], 2),
            *(round(min(each), 2) for each in row["gain where off"].values()),
        )
    save("lens_correction", {"machine": machine(), "sheet": SHEET, "samples": SAMPLES, "rows": rows}, show=False)
