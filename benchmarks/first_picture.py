"""A person's first picture: ten models on seven displays, with nothing but a model and a display named.

Time on two cores: about an hour and a half, references included.

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
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import lippmann
from first_picture_models import models
from harness import save, saved
from lippmann.color.transfer import encode_srgb, pbr_neutral, quantize
from lippmann.display import Display
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.rendering.transport.ray_source import DisplayRays
from lippmann.viewing.replay import default_eye
from reference_pixels import trace_pixels

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


def eye_pixels(display: Display) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns and rows of pixels that the central eye sees at a grid of points, and which of them lie on the panel."""
    width, height = display.size_mm
    count = [max(2, round(SEEN * side / max(display.size_mm))) for side in (width, height)]
    x, y = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in count))
    seen = display.visible_panel_point(*default_eye(display), x * width, -y * height)
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

    rng = np.random.default_rng(5)
    columns, rows = rng.integers(0, display.panel.width, JUDGED), rng.integers(0, display.panel.height, JUDGED)
    reference = encode_srgb(pbr_neutral(trace_pixels(session, source, integrator, columns, rows, REFERENCE_SAMPLES)))
    error = np.mean((picture[rows, columns] - reference) ** 2)

    surfaces = replace(session, request=replace(request, integrator="depth"))
    u, v, inside = eye_pixels(display)
    distances = surfaces.integrator(source, placement.display_from_world)
    depth = trace_pixels(session, source, distances, u.ravel(), v.ravel(), 1)
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
