"""What true directions and corrected pixels gain, as an eye sees them through the lens: docs/background/optics.md.

python benchmarks/lens_correction.py [SCENE ...]

Each bundled scene is rendered for a 60-lpi print whose crest is at best focus, and 20 % above the paraxial focus: along
the directions of a pinhole at thickness over index, of one at the gap, along true directions, and corrected. The light
that each picture sends through the lens is compared with rays in directions that were not solved for: the middles of
thirds of pixels, where the correction knows halves. Writes benchmarks/results/lens_correction.json.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from harness import machine, save
from lippmann.display import load_display
from lippmann.optics.correction import TOLERANCE, LensCorrection, parts_beside
from lippmann.optics.seen import pixel_shares
from lippmann.rendering.picture import render_picture
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime import engine
from lippmann.scene.bundled import names
from lippmann.scene.readers.load import load_scene

SHEET = "print:lpi=60,ppi=720,size=20x10mm,thickness=26mil"
CRESTS = {"best focus": "", "R + 20 %": ",radius=0.2877mm"}
SAMPLES = 8


def render(scene, display, part=None):
    request = RenderRequest(integrator="direct", spp=SAMPLES, denoise="none", method="full", threads=1)
    engine.start()
    from lippmann.rendering.transport import ray_source

    whole = ray_source.DisplayRays

    class PartRays(whole):
        """Rays of a part of each pixel: its number, and of how many."""

        def light_rays(self, column, row, channel, jitter):
            import mitsuba as mi

            jitter = mi.Point2f((part[0] + jitter.x) / part[1], jitter.y)
            return super().light_rays(column, row, channel, jitter)

    ray_source.DisplayRays = PartRays if part else whole
    try:
        return render_picture(scene, display, request).pixels.clip(0.0, 1.0)
    finally:
        ray_source.DisplayRays = whole


def seen_error(display, pixels, truth):
    """Mean squared error of what eyes see, in the directions of the outer thirds of pixels."""
    errors = []
    for number, beside in ((0, -1 / 3), (2, 1 / 3)):
        u = np.arange(display.panel.width) + 0.5 + beside
        x, y = display.panel_point(u, 0.0 * u)
        lens, _ = display.lens_of(x, y)
        place = x - display.lens_center(lens, 0.0 * lens, x, y)[0]
        shares = pixel_shares(display, lens, -TRUE.pinhole_place(place) / TRUE.gap)
        for channel in range(3):
            seen = shares.seen(pixels[..., channel].astype(np.float64))
            errors.append(np.mean((seen - truth[number][..., channel]) ** 2))
    return float(np.mean(errors))


rows = []
for name in sys.argv[1:] or names():
    scene = load_scene(name)
    for crest, stated in CRESTS.items():
        TRUE = load_display(SHEET + stated)
        pinhole = replace(TRUE, distortion=None)
        simple = replace(pinhole, gap=TRUE.lens.thickness / TRUE.lens.index)
        truth = {part: render(scene, TRUE, (part, 3)) for part in (0, 2)}
        parts = [render(scene, TRUE, (part, 2)) for part in range(len(parts_beside()))]
        corrected = LensCorrection(TRUE).rows(parts)
        pictures = {
            "t/n": render(scene, simple),
            "gap": render(scene, pinhole),
            "true": np.mean(parts, axis=0),
            "corrected": corrected,
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
