"""What true directions and corrected pixels gain, as an eye sees them through the lens: docs/background/optics.md.

python benchmarks/lens_correction.py [SCENE ...]

Each bundled scene, or each scene or file named, is rendered for a 60-lpi print whose crest is at best focus, and 20 %
above the paraxial focus: along the directions of a pinhole at thickness over index, of one at the gap, along true
directions, and corrected. The light that each picture sends through the lens is compared with rays in directions that
were not solved for: the middles of thirds of pixels, where the correction knows halves. `bound` is the best that any
pixels between black and white can do: solved for these very directions. Writes
benchmarks/results/lens_correction.json, where other scenes keep their rows.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import sparse

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
SAMPLES, TRUTH_SAMPLES = 16, 48


def picture(scene, display, part=0, parts=1, samples=SAMPLES, seed=0):
    """Rays of a part of each pixel: its number, and of how many."""
    beside = (part + 0.5) / parts - 0.5
    return render(scene, display, EXPOSURE, samples, beside=beside, width=1.0 / parts, seed=seed)


def shares_of(display):
    """Shares of the pixels in the light of the directions that are judged, those of the outer thirds of pixels."""
    for beside in (-1 / 3, 1 / 3):
        u = np.arange(display.panel.width) + 0.5 + beside
        x, y = display.panel_point(u, 0.0 * u)
        lens, _ = display.lens_of(x, y)
        place = x - display.lens_center(lens, 0.0 * lens, x, y)[0]
        yield pixel_shares(display, lens, -TRUE.pinhole_place(place) / TRUE.gap)


def seen_error(display, pixels, truth):
    """Mean squared error of what eyes see."""
    errors = [
        np.mean((shares.gather(pixels[..., channel].astype(np.float64)) - true[..., channel]) ** 2)
        for shares, true in zip(shares_of(display), truth.values(), strict=True)
        for channel in range(3)
    ]
    return float(np.mean(errors))


def best(display, truth, start, steps=100):
    """The pixels between black and white of least error in the directions that are judged."""
    width, blocks = display.panel.width, []
    for shares in shares_of(display):
        columns = shares.first[:, None] + np.arange(shares.shares.shape[1])
        row = np.broadcast_to(np.arange(width)[:, None], columns.shape)
        lit = shares.shares > 0.0
        blocks.append(sparse.csr_matrix((shares.shares[lit], (row[lit], columns[lit])), shape=(width, width)))
    matrix = sparse.vstack(blocks).tocsr()
    goal = matrix.T @ np.concatenate([true.transpose(1, 0, 2).reshape(width, -1) for true in truth.values()])
    normal = (matrix.T @ matrix).tocsr()
    step = 1.0 / normal.sum(axis=1).max()
    solved = ahead = start.transpose(1, 0, 2).reshape(width, -1).astype(np.float64)
    t = 1.0
    for _ in range(steps):
        after = np.clip(ahead - step * (normal @ ahead - goal), 0.0, 1.0)
        t, before = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * t * t)), t
        ahead, solved = after + (before - 1.0) / t * (after - solved), after
    return solved.reshape(width, -1, 3).transpose(1, 0, 2)


known = RESULTS / "lens_correction.json"
rows = json.loads(known.read_text(encoding="utf-8"))["rows"] if known.exists() else []
for given in sys.argv[1:] or names():
    scene, name = load_scene(given), Path(given).parent.name or given
    rows = [row for row in rows if row["scene"] != name]
    for crest, stated in CRESTS.items():
        TRUE = load_display(SHEET + stated)
        EXPOSURE = choose_exposure(scene, TRUE, RenderRequest(integrator="direct", threads=1))
        pinhole = replace(TRUE, distortion=None)
        simple = replace(pinhole, gap=TRUE.lens.thickness / TRUE.lens.index)
        truth = {part: picture(scene, TRUE, part, 3, TRUTH_SAMPLES, seed=1) for part in (0, 2)}
        parts = [picture(scene, TRUE, part, 2) for part in range(len(parts_beside()))]
        corrected = LensCorrection(TRUE).rows(parts)
        pictures = {
            "t/n": picture(scene, simple),
            "gap": picture(scene, pinhole),
            "true": np.mean(parts, axis=0),
            "corrected": corrected,
            "bound": best(TRUE, truth, corrected),
        }
        decibels = {key: -10 * np.log10(seen_error(TRUE, pixels, truth)) for key, pixels in pictures.items()}
        off = {}
        for value in ("radius", "thickness", "index"):
            for factor in (1 - TOLERANCE, 1 + TOLERANCE):
                other = replace(TRUE, lens=replace(TRUE.lens, **{value: factor * getattr(TRUE.lens, value)}))
                before, after = (seen_error(other, pictures[key], truth) for key in ("true", "corrected"))
                off[f"{value} x {factor:g}"] = 10 * np.log10(before / after)
        rows.append({"scene": name, "crest": crest, "psnr": decibels, "gain where off": off})
        print(
            name, crest, {k: round(float(v), 2) for k, v in decibels.items()}, round(min(off.values()), 2), flush=True
        )
    save("lens_correction", {"machine": machine(), "sheet": SHEET, "samples": SAMPLES, "rows": rows}, show=False)
