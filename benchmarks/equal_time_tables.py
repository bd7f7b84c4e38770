"""The table of what dividing light gains at equal time."""

from __future__ import annotations

from typing import Any

#: Panels of the displays of equal_error.py, in words.
DISPLAYS = {
    "lenticular-8": "64 lenses of 8 pixels, 160 rows",
    "lenticular-8, whole": "64 lenses of 8 pixels, all 512 rows",
    "lenticular-48": "64 lenses of 48 pixels, 48 rows",
    "array-15": "34 x 34 lenses of 15 x 15 pixels, 150 rows",
}


def describe(result: dict[str, Any]) -> str:
    """The section of the page of measurements."""
    parts = []
    for display, scenes in result["results"].items():
        means = [f"{summary['mean']:+.1f} dB with {samples}" for samples, summary in result["summary"][display].items()]
        parts.append(
            f"### {DISPLAYS[display][0].upper() + DISPLAYS[display][1:]}\n\n"
            + "\n".join(rows(scenes))
            + f"\n\nMean gain by samples: {', '.join(means)}.\n"
        )
    return """## Gained since caustics were left to paths (`equal_time.py`)

Denoised pictures (`pooled`) of the last program before caustics came by photons, seen light by chains and outlines by
the guides' rays, against today's, in one run. Either counts with the better effort of Open Image Denoise. *Gain* is
the PSNR over that of the earlier program in the same time, along its curve from 1 to 64 samples. Photons, looks and
kernels that have become faster since are all in it.

""" + "\n".join(parts)


def rows(scenes: dict[str, Any]) -> list[str]:
    """One row for each scene and number of samples."""
    found = [
        "| scene | samples | earlier | today | gain at equal time | worst micro-image |",
        "|---|---|---|---|---|---|",
    ]
    for name, scene in scenes.items():
        for samples, gain in scene["gain"].items():
            before, now = (_point(scene[way], int(samples), gain["effort"]) for way in ("earlier", "today"))
            pictures = " | ".join(f"{each['psnr']:.1f} dB, {each['seconds']:.2f} s" for each in (before, now))
            gained = f"{gain['psnr']:+.1f} dB | {gain['worst_psnr']:+.1f} dB"
            found.append(f"| {name} | {samples}, {gain['effort']} | {pictures} | {gained} |")
    return found


def _point(curve: list[dict[str, Any]], samples: int, effort: str) -> dict[str, Any]:
    return next(point for point in curve if point["spp"] == samples and point["effort"] == effort)
