"""The tables of default pictures in ``docs/background/measurements.md``."""

from __future__ import annotations

import statistics
from typing import Any


def describe(result: dict[str, Any]) -> str:
    """Commands, and one table of pictures for each display."""
    rows = result["rows"]
    commits = rows[0]["commits"]
    parts = [
        f"""## Default pictures beside an earlier version (`defaults.py`)

`lippmann render SCENE --display NAME` with nothing else said, whole commands in processes of their own, in turn, with
compiled kernels; commit {commits["other"]} and, after the arrows, {commits["today"]}. Processor seconds are those of
all threads, medians of {rows[0]["runs"]} runs; ratios are medians over the pairs of runs, of the clock's time too,
which counts what else ran. Peak memory is the largest process's. PSNR is that of 3000 pixels all over the panel against
a plain rendering of 2048 samples of each by the same commit, and in brackets what the picture states of itself; "none"
where it is not known. Scenes in italics are bundled; the others no setting was tuned on."""
    ]
    head = (
        "| command | processor time | ratio | ratio by the clock | peak memory | modules |\n|---|---|---|---|---|---|"
    )
    commands = [f"| `lippmann {row['scene']}` | {_time(row)} |" for row in rows if not row["display"]]
    if commands:
        parts.append("\n".join([head, *commands]))
    for display in dict.fromkeys(row["display"] for row in rows if row["display"]):
        pictures = [row for row in rows if row["display"] == display]
        changes = [row["today"]["psnr"] - row["other"]["psnr"] for row in pictures if row["other"]["psnr"]]
        ratio = statistics.median(row["ratios"]["cpu"] for row in pictures)
        lines = [
            f"### {display}",
            "",
            f"{len(pictures)} scenes: the median ratio of processor time is {ratio:.2f}, the mean change of PSNR "
            f"{statistics.mean(changes):+.1f} dB.",
            "",
            "| scene | processor time | ratio | by the clock | peak memory | modules | PSNR (stated) | reference |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for row in pictures:
            name = f"*{row['scene']}*" if row["seen"] else row["scene"]
            quality = " → ".join(
                f"{_decibels(one['psnr'])} ({_decibels(one['stated_psnr'])})" for one in (row["other"], row["today"])
            )
            own = min(row[side]["reference_psnr"] for side in ("other", "today") if row[side]["psnr"])
            lines.append(f"| {name} | {_time(row)} | {quality} dB | {own:.0f} dB |")
        parts.append("\n".join(lines))
    missing = [f"{name} {reason}." for name, reason in result["missing"].items()]
    if missing:
        parts.append("Left out: " + " ".join(missing))
    return "\n\n".join(parts) + "\n"


def _decibels(value: float | None) -> str:
    return "none" if value is None else f"{value:.1f}"


def _time(row: dict[str, Any]) -> str:
    """The cells of time, memory and modules."""
    a, b, ratios = row["other"], row["today"], row["ratios"]
    return (
        f"{a['cpu']:.2f} → {b['cpu']:.2f} s | {ratios['cpu']:.2f} | {ratios['wall']:.2f} | "
        f"{a['peak'] / 1e6:.0f} → {b['peak'] / 1e6:.0f} MB | {a['modules']} → {b['modules']}"
    )
