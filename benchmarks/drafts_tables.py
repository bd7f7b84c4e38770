"""The section of ``docs/background/measurements.md`` on drafts and modest qualities, from ``drafts.py``."""

from __future__ import annotations

from typing import Any


def describe(result: dict[str, Any]) -> str:
    """A row for each scene and display."""
    asked = list(result["pictures"][0]["asked"])
    rows = [
        f"| {each['scene']} | {each['display']} | {' | '.join(_cell(each['asked'][name]) for name in asked)} |"
        for each in result["pictures"]
    ]
    table = "\n".join(rows)
    return f"""## Drafts

`drafts.py`: `lippmann render SCENE --display NAME` as a whole command with nothing asked, with `--effort draft`, and
with `--quality 30`, in light along paths. Processor time of one run; samples per pixel and the PSNR that the
picture states of itself, which one sample does not tell.

| scene | display | {" | ".join(asked)} |
|---|---|{"---|" * len(asked)}
{table}
"""


def _cell(run: dict[str, Any]) -> str:
    psnr = "" if run["psnr"] is None else f", {run['psnr']:.1f} dB"
    return f"{run['seconds']:.1f} s, {run['spp']} spp{psnr}"
