"""The section of ``docs/background/measurements.md`` on qualities that are asked for, from ``goals.py``."""

from __future__ import annotations

import statistics
import textwrap
from typing import Any

import numpy as np

from equal_error_tables import DISPLAYS, name_of
from goals import DRAWN_OUT
from harness import saved

#: Samples and effort of the picture with the fewest samples, and of the first that has halves.
_LEAST, _HALVES = (1, "fast"), (4, "fast")
_WAYS = ("full", "full + oidn", "stock views", "pooled")


def describe(result: dict[str, Any]) -> str:
    """All of the section, in Markdown."""
    parts = [
        f"""## A quality that is asked for (`goals.py`)

Seconds, judging included, until a picture says of itself that it has the PSNR (`--quality`), and the samples per
pixel that it took: by `full`, by `full --denoise oidn`, and by `pooled`, which at the time stopped at plain samples
where these were there sooner (then in italics); it no longer does. Plain samples are trusted from 16 on, or from 4
where they are 8 dB better than what is asked for, or 8 and 4 dB; denoised ones from 2, or at the time up to 8 where
samples cost less than a look at them. Where photons show that surfaces may mirror emitters, both are trusted from 16
on, and beyond a margin plain ones from 8 on, denoised ones from 2. No picture has more than {result["most_samples"]}.
Where full does not get there with these, its time is drawn out by the law of its noise (*): that is long where
fireflies of caustics come late, and outweighs other scenes in the mean. Where another does not, its cell is empty.
*Stock views*
are Mitsuba's own `path` along the same rays, each view denoised with albedo and normals: they know nothing of their
error, so they are told it, and stop with the fewest samples (a power of two) that are enough, 256 at most. Where these
are not, their time is drawn out by the law of noise, too, though what is denoised gains less: {_gained(result)} dB by
the last doubling of the samples, not 3. Caustics come by photons where there are any, in all ways but stock views.
Rows and clock are those above, and so are the scenes, but for those missing from a table, which were not run.
{_clock(result)}"""
    ]
    for name, (title, *_) in DISPLAYS.items():
        if scenes := result["results"].get(name):
            gains = _gains(result["summary"][name])
            parts += [f"### {title}, asked for", gains, _most_possible(name, scenes), "\n".join(_rows(scenes))]
    return "\n\n".join(parts) + "\n"


def _gained(result: dict[str, Any]) -> str:
    """What stock views that were not rendered gained in dB by the last doubling of their samples, least and most."""
    scenes = [scene for measured in result["results"].values() for scene in measured.values()]
    found = [way["gained"] for goals in scenes for ways in goals.values() for way in ways.values() if "gained" in way]
    return f"{min(found):.1f} to {max(found):.1f}"


def _most_possible(display: str, scenes: dict[str, Any]) -> str:
    """How many times as fast a picture can be that judges itself, and one that is told its error.

    By the pictures of ``equal_error.py``, which were timed by themselves: what full takes for as many samples tells how
    fast the machine was.
    """
    curves = _curves(display)
    judging, told = [], []
    for quality in next(iter(scenes.values())):
        least, stock, full = [], [], []
        for name in scenes.keys() & curves.keys():
            rivals, slower = scenes[name][quality], _slower(scenes[name], curves[name]["curves"]["full"])
            points = curves[name]["curves"]["pooled"]
            parts = {(point["spp"], point["effort"]): point["parts"] for point in points}
            seconds = parts[_LEAST]["trace"] + parts[_HALVES]["guides"] + parts[_HALVES]["clean"]
            least.append(rivals["stock views"]["seconds"] / (slower * seconds))
            cheapest = min(cost["seconds"] for cost in curves[name]["to"][quality].values() if cost)
            stock.append(rivals["stock views"]["seconds"] / (slower * cheapest))
            full.append(rivals["full"]["seconds"] / (slower * cheapest))
        mean = statistics.geometric_mean
        judging.append(f"{mean(least):.1f} (to {quality} dB)")
        told.append(f"{mean(stock):.1f} and {mean(full):.1f} times as fast as stock views and full (to {quality} dB)")
    return textwrap.fill(
        "A picture that judges itself by two denoised halves takes at least one sample of each pixel (photons "
        f"included), guides and two runs of the network: {' and '.join(judging)} times as fast as stock views. A "
        "picture that were told its error by references, as they are, and chose the cheapest way, effort and number of "
        f"samples on the curves of `equal_error.py`, would be {', '.join(told)}: no judgement can make more of it.",
        120,
    )


def _curves(display: str) -> dict[str, Any]:
    found: dict[str, Any] = saved("equal_error").get("results", {}).get(display, {})
    return found


def _clock(result: dict[str, Any]) -> str:
    """How fast the machine was, scene by scene, against the pictures of ``equal_error.py``."""
    found = [
        _slower(scenes[name], curves[name]["curves"]["full"])
        for display, scenes in result["results"].items()
        for curves in [_curves(display)]
        for name in scenes.keys() & curves.keys()
    ]
    return textwrap.fill(
        f"Full took {min(found):.1f} to {max(found):.1f} times as long as there for as many samples, "
        f"{statistics.median(found):.1f} in the middle: seconds compare within a scene.",
        120,
    )


def _slower(goals: dict[str, Any], full: list[dict[str, Any]]) -> float:
    """How many times as long full took for goals as it did for as many samples of its curve."""
    reached = next(ways["full"] for ways in goals.values() if not ways["full"]["short"])
    spp, seconds = (np.log([point[what] for point in full]) for what in ("spp", "seconds"))
    return float(reached["seconds"] / np.exp(np.interp(np.log(reached["spp"]), spp, seconds)))


def _gains(summary: dict[str, Any]) -> str:
    rows = ["| to | against | times as fast | least | scenes |", "|---|---|---|---|---|"]
    for goal, found in summary.items():
        rival, quality = goal.split(" to ")
        mean, least = found["times_faster"], found["least"]
        rows.append(f"| {quality} dB | {name_of(rival)} | {mean:.1f} | {least:.2f} | {len(found['scenes'])} |")
    return "\n".join(rows)


def _rows(scenes: dict[str, Any]) -> list[str]:
    first = next(iter(scenes.values()))
    qualities = list(first)
    measured = [way for way in _WAYS if any(way in goals[qualities[0]] for goals in scenes.values())]
    ways = " | ".join(name_of(way) for way in measured)
    rows = [f"| scene | {' | '.join(f'{quality} dB: {ways}' for quality in qualities)} |"]
    rows.append("|" + "---|" * (1 + len(qualities) * len(measured)))
    for name, goals in scenes.items():
        cells = [_cell(goals[quality].get(way), way) for quality in qualities for way in measured]
        rows.append(f"| {name} | {' | '.join(cells)} |")
    return rows


def _cell(found: dict[str, Any] | None, way: str) -> str:
    if found is None or (found["short"] and way not in DRAWN_OUT):
        return ""
    told = f"{found['seconds']:.2f} s{' *' if found['short'] else ''} ({found['spp']})"
    return f"*{told}*" if way == "pooled" and not found["denoised"] else told
