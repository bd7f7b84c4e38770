"""A direct rendering against a weave of 48 views: what the detour through a quilt costs in quality.

Time on two cores: an estimated 5 minutes.

The middle of a nominal Looking Glass Portrait, a quarter of its width and height, every sub-pixel with rays of its own;
against it a quilt of 8 x 6 views as fine as the device's (a tile pixel to 3.66 panel pixels, each way), woven with
linear and with nearest choice of views. Path light.

A quilt's cameras stand level, where the rays of a slanted sheet run along the lens to the viewer's point, so each is
judged by its own truth: the display's rays by long renderings of the display, the weave by sub-pixel rays from the very
place of a level camera that each sub-pixel shows, which is what infinitely many views of infinitely many pixels would
give. Errors are means of products with two independent references, free of the references' own noise.

python benchmarks/weave.py [--scenes NAME,...] [--quick]
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness import save

Picture = NDArray[np.float32]

ROOT = Path(__file__).resolve().parent.parent
SCENES = {
    "teapot": "teapot",
    "fancy-teapot": ROOT.parent / "shared" / "scenes" / "gltf" / "fancy_teapot" / "scene.gltf",
}
DEVICE = "looking-glass-portrait"
PANEL, COLUMNS, ROWS, VIEW = (384, 512), 8, 6, (105, 140)
#: Samples of what is judged, and of either reference.
SAMPLES, REFERENCE = (4, 16), 64
#: What an eye half-way to the side of the cone sees: between two views.
EYE_FRACTION = 36 / 48
PICTURE = ROOT / "docs" / "images" / "weave.png"


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--scenes", default=",".join(SCENES))
    words.add_argument("--quick", action="store_true", help="few samples: only shows that everything works")
    given = words.parse_args()
    reference = 4 if given.quick else REFERENCE
    results, pictures = {}, []
    for name in given.scenes.split(","):
        if not isinstance(SCENES[name], Path) or SCENES[name].exists():
            results[name], row = _measure(name, reference)
            pictures.append(row)
    if given.quick:
        print(results)
        return
    _draw(pictures)
    save("weave", {"device": DEVICE, "panel": PANEL, "views": COLUMNS * ROWS, "view": VIEW, "results": results})


def _measure(name: str, reference: int) -> tuple[dict[str, Any], list[Picture]]:
    import lippmann
    from lippmann.display.view_cone import cone_tangent
    from lippmann.image import IntegralImage
    from lippmann.quilts.quilt import Quilt, QuiltLayout
    from lippmann.quilts.weave import weave
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.session import open_session
    from lippmann.rendering.transport.ray_source import DisplayRays, QuiltRays
    from lippmann.runtime import engine
    from lippmann.scene.placement import place
    from lippmann.viewing.replay import replay

    engine.start("auto")
    whole = lippmann.load_display(DEVICE)
    display = whole.resized(*PANEL)
    scene = lippmann.load_scene(SCENES[name])
    at = place(scene.bounds, whole, cameras=scene.cameras, home_camera=scene.home_camera, bounds_in=scene.bounds_in)
    session = open_session(scene, RenderRequest(integrator="path"))
    direct = DisplayRays(display, at.world_from_display, subpixels=True)
    integrator = session.integrator(direct, at.display_from_world)
    cameras = QuiltRays(display, at.world_from_display, COLUMNS, ROWS, VIEW)

    def traced(source: Any, samples: int, seed: int) -> tuple[Picture, float]:
        from lippmann.rendering.film.memory_model import cut_wavefronts
        from lippmann.rendering.film.wavefront import trace_frame

        plan = cut_wavefronts(source.width, source.height, samples, channels=source.channels, memory=4 << 30)
        started = time.perf_counter()
        pixels = trace_frame(integrator, source, plan, seed=seed).pixels
        return pixels, time.perf_counter() - started

    def woven(pixels: Picture, choice: str) -> tuple[Picture, float]:
        started = time.perf_counter()
        image = weave(Quilt(pixels, QuiltLayout(COLUMNS, ROWS, None)), display, choice=choice)
        return image.pixels, time.perf_counter() - started

    judge = _Judge([traced(direct, reference, seed)[0] for seed in (1001, 2002)])
    level = _Judge([traced(_level_rays(direct, at.world_from_display), reference, seed)[0] for seed in (1001, 2002)])
    rows = []
    for samples in SAMPLES:
        traced(direct, samples, 7)
        pixels, seconds = traced(direct, samples, 3)
        rows.append({"way": "direct", "spp": samples, "psnr": judge(pixels), "seconds": seconds})
        traced(cameras, samples, 7)
        quilt, seconds = traced(cameras, samples, 3)
        for choice in ("linear", "nearest"):
            pixels, weaving = woven(quilt, choice)
            rows.append(
                {"way": f"weave, {choice}", "spp": samples, "psnr": level(pixels), "seconds": seconds + weaving}
            )
    # What no number of samples mends.
    fine = np.mean([traced(cameras, reference, seed)[0] for seed in (3003, 4004)], axis=0)
    finest = {choice: woven(fine, choice)[0] for choice in ("linear", "nearest")}
    for choice, pixels in finest.items():
        rows.append({"way": f"weave, {choice}", "spp": 2 * reference, "psnr": level(pixels), "seconds": None})

    eye = whole.viewing_distance * cone_tangent(whole) * (2 * EYE_FRACTION - 1)
    size = 3 * PANEL[0] // 2, 3 * PANEL[1] // 2
    shown = [
        replay(IntegralImage(pixels, display), (eye, 0.0, whole.viewing_distance), size=size)
        for pixels in (judge.mean, finest["linear"], finest["nearest"])
    ]
    rays = {"direct": direct.width * direct.height * 3, "quilt": cameras.width * cameras.height}
    return {"rows": rows, "rays_per_sample": rays, "depth_range": at.depth_range}, shown


def _level_rays(direct: Any, world_from_display: NDArray[np.float64]) -> Any:
    """The rays of sub-pixels from level cameras: what a quilt of all directions, infinitely fine, would weave to."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import DEVICE as OPS
    from lippmann.display.view_cone import cone_tangent
    from lippmann.rendering.transport.ray_source import OnePicture, world_ray

    display = direct.display
    lattice, scale, tangent = display.lattice, display.magnification, cone_tangent(display)

    class LevelRays(OnePicture):
        width, height, channels = direct.width, direct.height, 3

        def rays(self, column: Any, row: Any, channel: Any, jitter: Any) -> Any:
            u = mi.Float64(column) + 0.5 + (mi.Float64(jitter.x) - 0.5) / 3
            v = mi.Float64(row) + mi.Float64(jitter.y)
            x, y = display.subpixel_point(u, v, mi.Float64(channel), OPS)
            i, j = display.lens_of(x, y, OPS)
            axis = (lattice.origin_x + i * lattice.pitch) * scale
            fraction = 0.5 - (lattice.across(x, y) - axis) / (lattice.pitch * scale)
            lens_x, lens_y = display.lens_center(i, j, x, y, OPS)
            slope_x = lens_x / display.viewing_distance - (2 * fraction - 1) * tangent
            slope_y = lens_y / display.viewing_distance
            near = display.aperture_distance
            origin = (lens_x - slope_x * near, lens_y - slope_y * near, dr.full(mi.Float64, near, dr.width(x)))
            return world_ray(world_from_display, origin, (slope_x, slope_y, dr.full(mi.Float64, -1, dr.width(x))))

    return LevelRays()


class _Judge:
    """PSNR of sRGB-coded values by two references that know nothing of each other."""

    def __init__(self, references: list[Picture]) -> None:
        self._coded = [_coded(picture) for picture in references]
        self.mean: Picture = np.mean(references, axis=0, dtype=np.float32)

    def __call__(self, picture: Picture) -> float:
        first, second = (_coded(picture) - coded for coded in self._coded)
        return -10 * math.log10(max(float((first * second).mean()), 1e-9))


def _coded(picture: Picture) -> NDArray[np.float64]:
    from lippmann.color.transfer import encode_srgb

    return np.asarray(encode_srgb(np.clip(picture, 0, 1).astype(np.float64)))


def _draw(rows: list[list[Picture]]) -> None:
    """What the eye sees of the middle, side by side: direct, linear, nearest; a scene below the other."""
    from lippmann.image.write import write_plain_picture

    cut = [[picture[96:-192, 72:-72] for picture in row] for row in rows]
    gap = np.ones((cut[0][0].shape[0], 6, 3), np.float32)
    lines = [np.concatenate([row[0], gap, row[1], gap, row[2]], axis=1) for row in cut]
    bar = np.ones((6, lines[0].shape[1], 3), np.float32)
    parts = [part for line in lines for part in (bar, line)][1:]
    write_plain_picture(np.clip(np.concatenate(parts), 0, 1), PICTURE)


if __name__ == "__main__":
    main()
