"""The section of ``docs/background/measurements.md`` on films, from ``films.py``."""

from __future__ import annotations

from typing import Any


def describe(result: dict[str, Any]) -> str:
    """One table of time and memory, and one of errors, for each display."""
    parts = []
    for display in dict.fromkeys(row["display"] for row in result["rows"]):
        rows = [row for row in result["rows"] if row["display"] == display]
        parts.append(f"### Films on {display}\n\n" + _times(rows))
        if judged := [row for row in rows if "psnr" in row["today"]]:
            parts.append(_errors(judged))
    missing = [f"{name} {reason}." for name, reason in result["missing"].items()]
    if missing:
        parts.append("Left out: " + " ".join(missing))
    commits = {row["commits"]["today"]: None for row in result["rows"]}
    before = ", ".join(dict.fromkeys(row["commits"]["other"] for row in result["rows"]))
    return f"""## Films beside an earlier version (`films.py`)

`lippmann render SCENE --display NAME --depth-scale 0.5` for many frames and for one, whole commands in processes of
their own with compiled kernels, in turn; commit {before} and, after the arrows,
{", ".join(commits)}.
The time of a frame is the difference of their processor seconds over that of their frames. Many are the frames up to
the one that the table names; it is the median of so many runs. A still is the first frame alone. Turntables have 48
frames, the swing covers 40 degrees. Films in italics are of bundled scenes; no setting was tuned on the others.

{(chr(10) * 2).join(parts)}
"""


def _name(row: dict[str, Any]) -> str:
    return f"*{row['film']}*" if row["seen"] else str(row["film"])


def _times(rows: list[dict[str, Any]]) -> str:
    names = "film | a frame | ratio | peak memory | that of a still | over it | samples | last frame, runs"
    lines = [f"| {names} |", "|" + "---|" * 8]
    for row in rows:
        a, b = row["other"], row["today"]
        lines.append(
            f"| {_name(row)} | {a['seconds']:.2f} → {b['seconds']:.2f} s | {b['seconds'] / a['seconds']:.2f} | "
            f"{a['peak'] / 1e6:.0f} → {b['peak'] / 1e6:.0f} MB | "
            f"{a['still_peak'] / 1e6:.0f} → {b['still_peak'] / 1e6:.0f} MB | "
            f"{a['peak'] / a['still_peak']:.2f} → {b['peak'] / b['still_peak']:.2f} | {a['spp']} → {b['spp']} | "
            f"{row['last']}, {row['runs']} |"
        )
    return "\n".join(lines)


def _errors(rows: list[dict[str, Any]]) -> str:
    lines = [
        "PSNR in dB of the first frames, and of the differences of successive ones, against two plain renderings of",
        "the same native pixels whose noise cancels. Beside the arrows in brackets: this commit with `--fixed-noise`.",
        "*Stated*: what this side's frames state, less their PSNR, mean and farthest from 0; and how many lie in the",
        "interval that they state.",
        "",
        "| film | frames | as an eye sees them | differences | as an eye sees them | stated |",
        "|" + "---|" * 6,
    ]
    for row in rows:
        cells = [
            f"{row['other'][key]:.1f} → {row['today'][key]:.1f} ({row['fixed'][key]:.1f})"
            for key in ("psnr", "eye_psnr", "flicker", "eye_flicker")
        ]
        lines.append(f"| {_name(row)} | {' | '.join(cells)} | {_compare_stated(row['today'])} |")
    return "\n".join(lines)


def _compare_stated(side: dict[str, Any]) -> str:
    """What frames state beside the truth; empty of measurements that did not keep it."""
    known = [pair for pair in zip(side.get("frames", []), side.get("estimates", []), strict=True) if pair[1]]
    if not known:
        return ""
    off = [stated["psnr"] - true for true, stated in known]
    inside = sum(stated["psnr_low"] <= true <= stated["psnr_high"] for true, stated in known)
    return f"{sum(off) / len(off):+.1f}, {max(off, key=abs):+.1f} dB; {inside} of {len(off)}"
