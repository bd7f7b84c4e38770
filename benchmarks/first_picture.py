"""A person's first picture: ten models on seven displays, with nothing but a model and a display named.

python benchmarks/first_picture.py [--scenes FOLDER] [--only DISPLAY...]

For every picture: the share of the panel that the model fills as the central eye sees it, the model's mean brightness
and clipped share there, and the PSNR of pixels all over the panel against a long plain rendering of these. Writes
``benchmarks/results/first_picture.json`` and the contact sheet in ``docs/images/first-pictures.png``. ``FOLDER`` holds
``fancy_teapot/scene.gltf`` and ``clearcoat_test/ClearCoatTest.gltf``; without it those two are left out.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from PIL import Image, ImageDraw

import lippmann
from first_picture_models import models
from harness import save, saved
from lippmann.color.tone_map import pbr_neutral
from lippmann.color.transfer import encode_srgb, quantize
from lippmann.display import Display
from lippmann.rendering.film.wavefront import trace_frame
from lippmann.rendering.film.wavefront_plan import make_plan
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.rendering.transport.ray_source import DisplayRays
from lippmann.viewing.replay import default_eye

DISPLAYS = (
    "seed-lenticular",
    "mla-square",
    "mla-hexagonal",
    "looking-glass-go",
    "looking-glass-portrait",
    "panel-4k",
    "print-60lpi",
)
#: Pixels all over the panel that are judged, and samples of their reference.
JUDGED, REFERENCE_SAMPLES = 3000, 512
#: Points of the panel, along its longer side, at which the central eye looks.
SEEN = 150
CELL, LABEL = 150, 14
BACKGROUND = (30, 30, 30)
PICTURE = Path(__file__).parent.parent / "docs" / "images" / "first-pictures.png"


class PixelRays:
    """Rays of single pixels of a display, as a picture one pixel high."""

    def __init__(self, source: DisplayRays, columns: np.ndarray, rows: np.ndarray) -> None:
        self.width, self.height, self.channels = len(columns), 1, source.channels
        self._source = source
        self._columns, self._rows = mi.UInt32(columns.astype(np.uint32)), mi.UInt32(rows.astype(np.uint32))

    def tiles(self) -> Iterator[tuple[slice, slice]]:
        yield slice(0, 1), slice(0, self.width)

    def rays(self, column, row, channel, jitter):
        del row
        place = mi.UInt32(column)
        at = (dr.gather(mi.UInt32, table, place) for table in (self._columns, self._rows))
        return self._source.rays(*at, channel, jitter)


def eye_pixels(display: Display) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns and rows of pixels that the central eye sees at a grid of points, and which of them lie on the panel."""
    width, height = display.size_mm
    count = [max(2, round(SEEN * side / max(display.size_mm))) for side in (width, height)]
    x, y = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in count))
    seen = display.panel_point_seen_by(*default_eye(display), x * width, -y * height)
    u, v = (np.floor(value).astype(int) for value in display.pixel_coordinates(*seen))
    inside = (u >= 0) & (u < display.panel.width) & (v >= 0) & (v < display.panel.height)
    return np.clip(u, 0, display.panel.width - 1), np.clip(v, 0, display.panel.height - 1), inside


def judge(model: object, name: str, image_path: Path) -> tuple[dict[str, object], Image.Image]:
    """Figures of one picture, and what the central eye sees of it."""
    import io
    from contextlib import redirect_stderr, redirect_stdout

    from lippmann.cli import run

    display = lippmann.load_display(name)
    started = time.perf_counter()
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as said:
        code = run(["render", str(model), "-d", name, "-o", str(image_path)])
    seconds = time.perf_counter() - started
    if code:
        raise SystemExit(said.getvalue())
    image = lippmann.read_picture(image_path)
    picture = encode_srgb(image.pixels)

    scene = lippmann.load_scene(model)
    request = resolve(RenderRequest(method="full", spp=REFERENCE_SAMPLES), scene, display)
    session = open_session(scene, request)
    placement = session.place(display)
    source = DisplayRays(display, placement.world_from_display, bool(request.subpixels))
    integrator = session.integrator(source, placement.display_from_world)

    def trace(columns, rows, integrator, spp):
        rays = PixelRays(source, columns, rows)
        plan = make_plan(rays.width, 1, spp, channels=rays.channels, memory=session.memory)
        return trace_frame(integrator, rays, plan, seed=991, box_filter=True).pixels[0]

    rng = np.random.default_rng(5)
    columns, rows = rng.integers(0, display.panel.width, JUDGED), rng.integers(0, display.panel.height, JUDGED)
    reference = encode_srgb(pbr_neutral(trace(columns, rows, integrator, REFERENCE_SAMPLES)))
    error = np.mean((picture[rows, columns] - reference) ** 2)

    surfaces = replace(session, request=replace(request, integrator="depth"))
    u, v, inside = eye_pixels(display)
    depth = trace(u.ravel(), v.ravel(), surfaces.integrator(source, placement.display_from_world), 1)
    hit = (depth[:, 1] != 0.0).reshape(u.shape) & inside
    seen = picture[v, u]
    down, across = np.flatnonzero(hit.any(axis=1)), np.flatnonzero(hit.any(axis=0))
    fill = max((np.ptp(across) + 1) / hit.shape[1], (np.ptp(down) + 1) / hit.shape[0])
    figures = {
        "display": name,
        "spp": image.provenance.spp,
        "method": image.provenance.method,
        "fill": float(fill),
        "depth_scale": placement.depth_scale,
        "brightness": float(seen[hit].mean()),
        "clipped": float((seen[hit] >= 254.5 / 255).all(axis=-1).mean()),
        "psnr": float(-10 * np.log10(error)),
        "seconds": seconds,
    }
    shown = image.replay(default_eye(display))
    return figures, Image.fromarray(quantize(shown, 8, "srgb"))


def contact_sheet(columns: int) -> Image.Image:
    """The sheet of the last run, so that displays not named keep their rows; empty where its size was another."""
    size = CELL * columns, (CELL + LABEL) * len(DISPLAYS)
    if PICTURE.exists():
        with Image.open(PICTURE) as last:
            if last.size == size:
                return last.convert("RGB")
    return Image.new("RGB", size, BACKGROUND)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=Path)
    parser.add_argument("--only", nargs="*", default=DISPLAYS)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = models(Path(folder), options.scenes)
        sheet = contact_sheet(len(found))
        rows = [old for old in saved("first_picture").get("pictures", []) if old["display"] not in options.only]
        for display in options.only:
            row = DISPLAYS.index(display)
            sheet.paste(BACKGROUND, (0, row * (CELL + LABEL), sheet.width, (row + 1) * (CELL + LABEL)))
            for column, (name, model) in enumerate(found.items()):
                figures, picture = judge(model, display, Path(folder) / "picture.png")
                rows.append({"model": name, **figures})
                print(name, *(f"{k}={v:.3g}" if isinstance(v, float) else v for k, v in figures.items()), flush=True)
                picture.thumbnail((CELL - 2, CELL - 2))
                corner = (
                    column * CELL + (CELL - picture.width) // 2,
                    row * (CELL + LABEL) + (CELL - picture.height) // 2,
                )
                sheet.paste(picture, corner)
                words = f"{name}, {display}" if column == 0 else name
                ImageDraw.Draw(sheet).text((column * CELL + 3, row * (CELL + LABEL) + CELL), words, fill="white")
        sheet.save(PICTURE, optimize=True)
    save("first_picture", {"pictures": sorted(rows, key=lambda each: DISPLAYS.index(each["display"]))})


if __name__ == "__main__":
    main()
