"""The table of what photons and chains take of a picture's time."""

from __future__ import annotations

from typing import Any


def describe(result: dict[str, Any]) -> str:
    """The section of the page of measurements."""
    rows = [
        f"| {name} | {row['spp']} | {_cell(row['paths'])} | {_cell(row['default'])} | {row['share']:.0%} | "
        f"{row['default']['caustics']}, {row['default']['chains']} |"
        for name, scene in result["scenes"].items()
        for row in scene
    ]
    table = "\n".join(rows)
    return f"""## What photons and chains take (`photon_share.py`)

Small mirrors and glass in large worlds, and others; 256 x 256 pixels, `full`, one thread. Processor time of a whole
render with compiled kernels, and PSNR against two pictures of {result["reference_spp"]} samples with photons. *Share*:
what the default takes beyond paths alone, of its own time.

| scene | samples | paths alone | default | share | caustics and chains of the default |
|---|---|---|---|---|---|
{table}
"""


def _cell(run: dict[str, Any]) -> str:
    return f"{run['psnr']:.1f} dB, {run['seconds']:.2f} s"
