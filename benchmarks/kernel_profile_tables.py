"""The section of ``docs/background/measurements.md`` on the time of a path, from ``kernel_profile.py``."""

from __future__ import annotations

from typing import Any

PARTS = (
    "rays to surfaces",
    "shadow rays",
    "emitters sampled",
    "surfaces evaluated",
    "photons looked up",
    "rest",
)


def describe(result: dict[str, Any]) -> str:
    """All of the section, in Markdown."""
    rows = [
        f"| scene | ns per path | surfaces | {' | '.join(PARTS)} | lanes at work | before |",
        "|" + "---|" * (len(PARTS) + 5),
    ]
    for name, found in result["scenes"].items():
        whole, lanes = found["nanoseconds"], 100 * found["lanes_at_work"]
        shares = " | ".join(f"{100 * found['parts'].get(part, 0) / whole:.0f} %" for part in PARTS)
        rows.append(
            f"| {name} | {whole:.0f} | {found['surfaces_per_path']:.1f} | {shares} | {lanes:.0f} % "
            f"| {found['before'] / whole:.2f} |"
        )
    samples, gain = result["samples"], result["times_faster"]
    return (
        f"""## Where the time of a path goes (`kernel_profile.py`)

Nanoseconds of a processor per path, {samples} samples of each pixel of 160 rows of the paper's display, photons where
there are caustics. Each part is what leaving it out saves. *Rest*: sampling of surfaces, random numbers, bookkeeping.
*Lanes at work*: the mean share of 16 lanes whose paths have not ended. *Before*: times as long with pixels in the order
of rows, and with all photons about a point for every sample; in the geometric mean {gain:.2f} times. (Opaque surfaces
had an acceleration structure of their own then. Without it `foliage` and `tree` take as long; opaque scenes with one
pane take 9 to 18 % longer.) In simple scenes more than half the time goes into rays. Shadow
rays that Embree is told are coherent take 8 to 35 % more of all time. Sampling a map of the surroundings takes 33 ns a
sample.

"""
        + "\n".join(rows)
        + "\n"
    )
