"""The table of caustics by paths and by photons."""

from __future__ import annotations

from typing import Any


def describe(result: dict[str, Any]) -> str:
    """The section of the page of measurements."""
    table = "\n".join(rows(result))
    return f"""## Caustics by paths and by photons (`caustics.py`)

64 lenses of 8 pixels, 160 rows, path light; PSNR of all pixels / of the worst micro-image against two references of
{result["reference_spp"] // 2} samples with photons; time of the processors over their number, photons included.
Mirrored small emitters come by [chains](caustics.md#seen-light) with either.

{table}
"""


def rows(result: dict[str, Any]) -> list[str]:
    """One row for each scene and number of samples."""
    ways = [("paths", "full"), ("photons", "full"), ("paths", "pooled"), ("photons", "pooled")]
    found = [
        "| scene (light by photons over that by paths; PSNR of one reference) | samples | "
        + " | ".join(f"`{method}`, {way}" for way, method in ways)
        + " |",
        "|---|---|---|---|---|---|",
    ]
    for name, scene in result["scenes"].items():
        light = scene["mean_light"]["photons"] / scene["mean_light"]["paths"]
        for samples in dict.fromkeys(row["spp"] for row in scene["rows"]):
            cells = []
            for way, method in ways:
                (row,) = (
                    row for row in scene["rows"] if (row["way"], row["method"], row["spp"]) == (way, method, samples)
                )
                cells.append(f"{row['psnr']:.1f} / {row['worst_psnr']:.1f} dB, {row['seconds']:.1f} s")
            found.append(f"| {name} ({light:.3f}; {scene['judge_psnr']:.1f} dB) | {samples} | {' | '.join(cells)} |")
    return found
