"""The section of ``docs/background/measurements.md`` on stated intervals, from ``estimate_coverage.py``."""

from __future__ import annotations

from typing import Any


def describe(result: dict[str, Any]) -> str:
    """All of the section, in Markdown."""
    found = result["summary"]
    targets = next(iter(found.values()))["targets"]
    rows = [
        ("true PSNR inside the stated interval", "psnr_inside"),
        ("true worst micro-image inside its interval", "worst_inside"),
        ("promises (`--quality`) kept to within 1 dB", "promises_kept"),
    ]
    lines = [
        f"| {text} | {' | '.join(f'{one[key]:.1%}' for one in found.values())} | {targets[key]:.0%} |"
        for text, key in rows
    ]
    for text, key in (("PSNR", "psnr"), ("worst micro-image", "worst")):
        middles = (f"{one[f'{key}_stated_minus_true']:+.2f} dB" for one in found.values())
        lines.append(f"| median of stated less true {text} | {' | '.join(middles)} | |")
    for text, key in (("pictures", "cases"), ("promises", "promises"), ("of these reached", "promises_reached")):
        lines.append(f"| {text} | {' | '.join(str(one[key]) for one in found.values())} | |")
    head = f"""## Stated intervals against the truth (`estimate_coverage.py`)

Scenes that are hard to judge on four lens layouts, 8 to 128 samples per pixel. *Denoised* is `full` with Open Image
Denoise, *pooled* shares its light as well.

| | {" | ".join(found)} | target |
|---|{"---|" * len(found)}---|"""
    return "\n".join([head, *lines]) + "\n\n" + _few(result["few"])


def _few(few: dict[str, Any]) -> str:
    """How far off estimates of very few samples are: why goals wait for more."""
    rows = [
        f"| {samples} | {one['psnr']:.1f} dB | {one['worst']:.1f} dB | {one['pictures']} |"
        for samples, one in few["summary"].items()
    ]
    head = """Goals do not trust plain pictures of fewer than 16 samples. By how much what they say of themselves was
too good, at most:

| samples | PSNR | worst micro-image | pictures |
|---|---|---|---|"""
    return "\n".join([head, *rows]) + "\n"
