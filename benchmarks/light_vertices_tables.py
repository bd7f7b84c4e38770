"""The table of what light vertices save."""

from __future__ import annotations

from typing import Any


def describe(result: dict[str, Any]) -> str:
    """The section of the page of measurements."""
    table = "\n".join(rows(result))
    return f"""## Paths joined to light vertices (`light_vertices.py`)

[Light vertices](light-vertices.md): `full`, {result["spp"]} samples a pixel. The suite's scenes on 64 lenses of 8
pixels, 160 rows; the rooms behind an array of 12 x 12 lenses of 8 pixels. PSNR between two pictures of other seeds;
time of the processors over their number for one, with all preparation of its light.

{table}
"""


def rows(result: dict[str, Any]) -> list[str]:
    """One row for each scene."""
    found = ["| scene | joined | paths alone | with light vertices | time |", "|---|---|---|---|---|"]
    for name, scene in result["scenes"].items():
        halves, seconds = scene["halves"], scene["seconds"]
        found.append(
            f"| {name.replace('_', ' ')} | {'yes' if scene['is_joined'] else 'no'} | {halves['alone']:.1f} dB "
            f"| {halves['joined']:.1f} dB | {seconds['alone']:.2f} → {seconds['joined']:.2f} s |"
        )
    return found
