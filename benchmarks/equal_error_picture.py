"""Draws the curves of ``equal_error.py``: PSNR against seconds for each scene and display, as small multiples.

Time on two cores: a few seconds.

Open Image Denoise counts with whichever of its efforts is better at a time. Written is ``docs/images/equal-error.png``.

pip install "matplotlib>=3.9,<4"
python benchmarks/equal_error_picture.py
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, MultipleLocator

from harness import RESULTS

PICTURE = Path(__file__).parent.parent / "docs" / "images" / "equal-error.png"
DISPLAYS = {
    "lenticular-8": "64 lenses of 8 pixels",
    "lenticular-48": "64 lenses of 48 pixels",
    "array-15": "34x34 lenses of 15x15",
}
#: Colours that the colour-blind tell apart, and markers that tell the ways apart without any.
WAYS = {
    "full": ("#8a8f98", "o"),
    "full + oidn": ("#d98b2b", "s"),
    "pooled": ("#1f6fb2", "D"),
}
TARGETS = (35, 40)
INK, FAINT = "#30343a", "#d9dce0"

Point = dict[str, Any]


def main() -> None:
    results = json.loads((RESULTS / "equal_error.json").read_text())["results"]
    scenes = list(dict.fromkeys(name for found in results.values() for name in found))
    plt.rcParams |= {"font.size": 8, "text.color": INK, "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK}
    figure, grid = plt.subplots(
        len(scenes), len(DISPLAYS), figsize=(8.4, 1.45 * len(scenes) + 0.9), sharex=True, sharey=True, squeeze=False
    )
    for axes_of_scene, scene in zip(grid, scenes, strict=True):
        for axes, display in zip(axes_of_scene, DISPLAYS, strict=True):
            _panel(axes, results.get(display, {}).get(scene))
        axes_of_scene[0].set_ylabel(f"{scene}\ndB")
    for axes, title in zip(grid[0], DISPLAYS.values(), strict=True):
        axes.set_title(title, fontsize=9, color=INK)
    for axes in grid[-1]:
        axes.set_xlabel("seconds on two cores")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncols=len(WAYS), frameon=False, fontsize=9)
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.35 / figure.get_figheight()), h_pad=0.6, w_pad=0.8)
    figure.savefig(PICTURE, dpi=120, metadata={"Software": None})


def _panel(axes: Axes, found: dict[str, Any] | None) -> None:
    axes.set_xscale("log")
    axes.yaxis.set_major_locator(MultipleLocator(10))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.tick_params(length=2)
    for psnr in TARGETS:
        axes.axhline(psnr, color=FAINT, linewidth=0.8, zorder=0)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(FAINT)
    for way, (color, marker) in WAYS.items() if found else ():
        points = _frontier(found["curves"][way])
        seconds, psnr = [point["seconds"] for point in points], [point["psnr"] for point in points]
        label = way.replace("oidn", "OIDN")
        axes.plot(seconds, psnr, color=color, marker=marker, markersize=3.2, linewidth=1.3, label=label)


def _frontier(curve: list[Point]) -> list[Point]:
    """The points that none beats in both time and quality, the fastest first."""
    best: list[Point] = []
    for point in sorted(curve, key=lambda point: point["seconds"]):
        if not best or point["psnr"] > best[-1]["psnr"]:
            best.append(point)
    return best


if __name__ == "__main__":
    main()
