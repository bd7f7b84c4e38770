"""The table of first pictures in ``docs/background/measurements.md``."""

from __future__ import annotations

import statistics
from typing import Any


def describe(result: dict[str, Any]) -> str:
    """One row for each display."""
    rows = []
    for display in dict.fromkeys(picture["display"] for picture in result["pictures"]):
        pictures = [picture for picture in result["pictures"] if picture["display"] == display]
        worst = min(pictures, key=lambda picture: picture["psnr"])
        fill = min(picture["fill"] for picture in pictures)
        dark, *_, bright = sorted(picture["brightness"] for picture in pictures)
        clipped = max(picture["clipped"] for picture in pictures)
        samples = [picture["spp"] for picture in pictures]
        spp = " to ".join(str(each) for each in dict.fromkeys((min(samples), max(samples))))
        median = statistics.median(picture["psnr"] for picture in pictures)
        rows.append(
            f"| {display} | {len(pictures)} | {spp} | {100 * fill:.0f} % | {dark:.2f} to {bright:.2f} | "
            f"{100 * clipped:.0f} % | {median:.1f} dB | {worst['psnr']:.1f} dB ({worst['model']}) |"
        )
    table = "\n".join(rows)
    return f"""## First pictures (`first_picture.py`)

`lippmann render MODEL --display NAME` with nothing else said. The least share of the panel's width or height that a
model fills as the central eye sees it; the mean display code of the model's pixels, of the darkest and the brightest
model; the share of them that is clipped; PSNR of 3000 pixels all over the panel against 512 plain samples of each. The
darkest model is a chart of black and dark blue samples.

| display | models | samples | fills at least | brightness | clipped | median PSNR | least PSNR |
|---|---|---|---|---|---|---|---|
{table}

![What the central eye sees of each](../images/first-pictures.png)
"""
