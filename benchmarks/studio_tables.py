"""The table of live frames in ``docs/background/measurements.md``."""

from __future__ import annotations

from typing import Any

_HEADS = (
    "display, scene",
    "picture",
    "frames/s by the clock",
    "at most, of idle cores",
    "first after a move",
    "35 dB after",
    "of processors",
    "against replay",
)


def section(result: dict[str, Any]) -> str:
    """The section of ``benchmarks/studio.py``."""
    start = result["start"]
    lines = [
        "## Live frames (`studio.py`)",
        "",
        "An orbit of single samples in direct light; then a view at rest, of paths, denoised (PSNR against long",
        "references of the same eye); and how far a frame is from the replay of a whole render by the same settings.",
        "Beside frames by the clock stand those that two idle cores would make of the same processor time. Why one",
        "view is not clean in time: [research notes](../research/live-views.md).",
        "",
        f"| {' | '.join(_HEADS)} |",
        f"|{'---|' * len(_HEADS)}",
        *(_row(name, case) for name, case in result["cases"].items()),
        "",
        f"From starting a process to its first frame: {start['s']:.1f} s by the clock, {start['processor_s']:.1f} s of "
        "processors.",
    ]
    endless = result.get("endless")
    if endless:
        lines += [
            "",
            f"Moves for {endless['minutes']:g} minutes: {endless['frames']} frames, the oldest "
            f"{endless['oldest_s']:.2f} s; memory {endless['early_mib']:.0f} MiB early on, "
            f"{endless['last_mib']:.0f} MiB at the end.",
        ]
    return "\n".join(lines) + "\n"


def command_section(result: dict[str, Any]) -> str:
    """The section of ``benchmarks/studio_command.py``."""
    lines = [
        "## The studio as a page meets it (`studio_command.py`)",
        "",
        "`lippmann studio`, its own process, over its WebSocket: a page sends a view every 16 ms as the model turns",
        "and the eye sways. A frame's age is counted from the sending of its view. The picture shrinks until it takes",
        "30 ms, from half of its sides on 50 ms: its median size stands beside the one that was asked for.",
        "",
        "| display and scene | asked for | traced | first frame after the command | frames/s | median age "
        "| 99 of 100 are younger than | oldest |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, case in result["cases"].items():
        if "skipped" in case:
            lines.append(f"| {name} | {case['skipped']} | | | | | | |")
            continue
        (asked_width, asked_height), (width, height) = case["asked"], case["size"]
        lines.append(
            f"| {name} | {asked_width}x{asked_height} | {width}x{height} | {case['start_s']:.1f} s | "
            f"{case['frames_per_second']:.0f} | "
            f"{case['median_age_ms']:.0f} ms | {case['age_of_99_in_100_ms']:.0f} ms | {case['oldest_ms']:.0f} ms |"
        )
    endless = result.get("endless")
    if endless:
        lines += [
            "",
            f"{endless['minutes']} minutes of moves on one connection: {endless['frames']} frames, the oldest "
            f"{endless['oldest_ms']:.0f} ms; memory in MiB when they begin and after each minute: "
            f"{', '.join(str(each) for each in endless['memory_mib'])}.",
        ]
    return "\n".join(lines) + "\n"


def pages_section(result: dict[str, Any]) -> str:
    """The section of ``benchmarks/studio_pages.py``."""
    pages, panel, changes = result["pages"], result["panel"], result["changes"]
    rates = ", ".join(f"{rate:.1f}" for rate in pages["frames_per_second"])
    lines = [
        "## Several pages of one studio (`studio_pages.py`)",
        "",
        "A real browser on the machine that traces, and other work beside it: ratios are what counts.",
        "",
        "| what moves | frames/s |",
        "|---|---|",
        f"| {len(pages['frames_per_second'])} pages turn the teapot ({pages['display']}) | {rates} |",
        f"| one page turns it ({panel['display']}) | {panel['frames_per_second']:.1f} |",
        f"| the window on the display beside it: all native pixels | {panel['panel_frames_per_second']:.1f} |",
        f"| a page that sends {changes['changes_per_second']:.0f} changes a second ({changes['display']}) | "
        f"{changes['frames_per_second']:.1f} |",
    ]
    return "\n".join(lines) + "\n"


def _row(name: str, case: dict[str, Any]) -> str:
    if "skipped" in case:
        return f"| {name} | {case['skipped']} | | | | | | |"
    reached = case["rest"]["reached"]
    soon = (
        f"{reached['s']:.1f} s | {reached['processor_s']:.1f} s"
        if reached
        else f"not in {case['rest']['last']['s']:.0f} s ({case['rest']['last']['db']:.1f} dB) | "
    )
    width, height = case["size"]
    return (
        f"| {name} | {width}x{height} | {case['frames_per_second']:.0f} | {case['idle_frames_per_second']:.0f} | "
        f"{case['first_after_move_ms']:.0f} ms | {soon} | {_decibels(case['replay_db'])} |"
    )


def _decibels(value: float) -> str:
    return "equal" if value >= 120 else f"{value:.0f} dB"
