"""The pictures and the table of docs/background/optics.md.

Time on two cores: an estimated minute.

python benchmarks/optics_pictures.py

Draws docs/images/optics-crests.png and docs/images/optics-moire.png, and prints the rows of the eight sheets.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from lippmann.display import Display
from lippmann.display.formats.print_sheet import TYPICAL_SHEETS
from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.display.panel import Panel
from lippmann.optics.directions import true_directions
from lippmann.optics.first_order import extreme_ray_field
from lippmann.optics.fitting import gap_of
from lippmann.optics.lens import Lens
from lippmann.optics.light_table import light_table
from lippmann.optics.moire import wave_period
from lippmann.runtime.plotting import plain_matplotlib

IMAGES = Path(__file__).parents[1] / "docs" / "images"


def draw_crests() -> None:
    """Light tables of the 60-lpi sheet with three crests, with pinhole and true directions."""
    from matplotlib.figure import Figure

    pitch, thickness, index = 25.4 / 60, 0.6604, 1.57
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    axes = figure.subplots(1, 3, sharey=True)
    angles = np.linspace(-40, 40, 401)
    slopes = np.tan(np.radians(angles))
    for factor, ax in zip((1.0, 1.1, 1.2), axes, strict=True):
        lens = Lens(
            LensProfile(factor * thickness * (index - 1) / index, thickness, index), LensArray("lenticular", pitch)
        )
        table = light_table(lens, slopes, places_per_lens=192)
        ax.imshow(
            table.shares**0.5, origin="lower", aspect="auto", cmap="Greys", extent=(-1.5, 1.5, angles[0], angles[-1])
        )
        directions = true_directions(lens)
        own = np.abs(directions.places) <= 0.5 * pitch
        place = directions.places[own]
        ax.plot(place / pitch, np.degrees(np.arctan(directions.slopes[own])), color="tab:red", label="true direction")
        pinhole = np.degrees(np.arctan(-place / (thickness / index)))
        ax.plot(place / pitch, pinhole, "--", color="tab:blue", label="pinhole at t/n")
        ax.set(title=f"R {100 * factor - 100:+.0f} %" if factor > 1 else "paraxial focus", xlabel="place (pitches)")
        ax.set(xlim=(-1, 1))
    axes[0].set_ylabel("direction (degrees)")
    axes[2].legend(fontsize=8)
    figure.savefig(IMAGES / "optics-crests.png", dpi=100, metadata={"Software": None})


def draw_moire() -> None:
    """Period of moire against the angle of a 0.508 mm sheet on two panels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    angles = np.linspace(-1, 46, 2351)
    orders = ((1, 0), (3, 1), (2, 1), (3, 2), (1, 1))
    for pixel, ax in zip((0.18, 0.266), axes, strict=True):
        displays = [
            Display("m", Panel(900, 900, pixel), LensArray("lenticular", 0.508, angle), 1.0) for angle in angles
        ]
        for order in orders:
            ax.plot(angles, [min(wave_period(display, order), 50) for display in displays], label=f"{order}")
        for slope in (0, 1 / 3, 1 / 2, 2 / 3, 1):
            ax.axvline(math.degrees(math.atan(slope)), color="0.8", zorder=0)
        ax.set(title=f"pixels of {pixel} mm", xlabel="slant (degrees)", yscale="log", ylim=(0.05, 60))
    axes[0].set_ylabel("period (mm)")
    axes[1].legend(fontsize=8)
    figure.savefig(IMAGES / "optics-moire.png", dpi=100, metadata={"Software": None})


def print_sheets() -> None:
    """The rows of the eight sheets: field, gap and width as the tests hold them."""
    for name, sheet in TYPICAL_SHEETS.items():
        lens = Lens(LensProfile(sheet.radius, sheet.thickness, sheet.index), LensArray("lenticular", 25.4 / sheet.lpi))
        field = extreme_ray_field(lens.profile, lens.pitch)
        gap = gap_of(lens.profile, lens.array) * sheet.index / sheet.thickness
        finely = light_table(lens, 0.0, places_per_lens=2000, neighbours=0)
        print(f"| {name} | {field:.1f} | {gap:.3f} | 1/{lens.pitch / finely.widths()[0]:.1f} |")


if __name__ == "__main__":
    with plain_matplotlib():
        draw_crests()
        draw_moire()
    print_sheets()
