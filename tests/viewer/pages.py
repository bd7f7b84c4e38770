"""What the tests of the page share: pictures, pages made of them, and what a page shows as arrays."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np

from lippmann.color.transfer import quantize
from lippmann.display import Display, LensArray, Panel
from lippmann.display.distortion import Distortion
from lippmann.image import IntegralImage, Provenance
from lippmann.viewer.export import export_page
from lippmann.viewing.replay import replay_points

VIEWER = "window.lippmann.viewer"

#: Two kinds of pixels, as panels with uneven sub-pixels have them.
CELLS = (
    (
        ((-0.31, 0.26), (0.27, 0.21), (0.05, -0.25)),
        ((-0.29, -0.22), (0.33, -0.2), (-0.04, 0.24)),
    ),
)


def lenticular(width=96, height=64, *, pixels=8.0, slant=0.0, distance=float("inf"), **panel) -> Display:
    lenses = LensArray("lenticular", 0.1 * pixels, slant=slant)
    return Display("sheet", Panel(width, height, 0.1, **panel), lenses, gap=2.5, viewing_distance=distance)


def array(layout, *, distance=float("inf"), row_pitch=None) -> Display:
    lenses = LensArray(layout, 0.8, row_pitch=row_pitch)
    return Display(layout, Panel(96, 80, 0.1), lenses, gap=2.5, viewing_distance=distance)


DISPLAYS = {
    "lenticular": lenticular(),
    "converging": lenticular(pixels=7.37, distance=300.0),
    "slanted": lenticular(pixels=6.2, slant=9.46, distance=300.0),
    "square": array("square"),
    "square converging": array("square", distance=250.0),
    "hexagonal": array("hexagonal"),
    "hexagonal converging": array("hexagonal", distance=250.0),
}


#: As of a real lens; stronger, so that it moves what is seen by pixels.
BENT = Distortion(0.4, (0.9, 0.95, 1.05, 1.2, 1.3))


def noise(display: Display, *, seed: int = 1, subpixels: bool = False, **parts: Any) -> IntegralImage:
    """A picture without any smoothness: one pixel beside the right one is seen as wrong. Its values are codes."""
    codes = np.random.default_rng(seed).integers(0, 256, (display.panel.height, display.panel.width, 3))
    values = (codes / 255).astype(np.float32)
    return IntegralImage(values, display, provenance=Provenance(subpixels=subpixels, transfer="linear"), **parts)


def page_of(path: Path, *images: IntegralImage) -> Path:
    """A page of one file that shows the pictures, called a, b, ..."""
    export_page([(chr(ord("a") + place), image) for place, image in enumerate(images)], path)
    return path


def opened(open_tab: Any, path: Path, **options: Any) -> Any:
    """A tab without network that shows the page, once all its tiles are there."""
    options = {"size": (760, 420), "offline": True, **options}
    tab = open_tab(**options).open(path)
    tab.evaluate(f"{VIEWER}.ready")
    return tab


def put_eye(tab: Any, eye: tuple[float, float, float]) -> None:
    tab.evaluate(f"(eye) => {VIEWER}.setEye(...eye)", list(eye))


def shown(tab: Any) -> np.ndarray:
    """``(height, width, 3)`` codes of the canvas, row 0 on top."""
    got = tab.evaluate(f"{VIEWER}.pixels()")
    codes = np.frombuffer(base64.b64decode(got["data"]), dtype=np.uint8)
    return codes.reshape(got["height"], got["width"], 4)[..., :3]


def seen(image: IntegralImage, eye: tuple[float, float, float], size: tuple[int, int]) -> np.ndarray:
    """What an eye sees at the middle of each pixel, as codes."""
    return quantize(replay_points(image, eye, size), 8, image.provenance.transfer)


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    """dB of codes; infinite if they are equal."""
    error = np.mean((a.astype(float) - b) ** 2) / 255**2
    return float("inf") if error == 0 else float(-10 * np.log10(error))
