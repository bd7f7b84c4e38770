"""The section of ``docs/background/measurements.md`` on error against time, from the results of ``equal_error.py``."""

from __future__ import annotations

import statistics
import textwrap
from typing import Any

#: Of the displays of equal_error.py: a title, pixels per lens on which the bound on paths rests, and how many times
#: faster than full, and than full with Open Image Denoise, pooled light is to be.
DISPLAYS = {
    "lenticular-8": ("64 lenses of 8 pixels, 160 rows", "1/8", 10, 1),
    "lenticular-48": ("64 lenses of 48 pixels, 48 rows", "1/48", 20, 3),
    "array-15": ("34x34 lenses of 15x15 pixels, 150 rows", "1/225", 20, 3),
}
#: The PSNR to which pooled light has targets against either rival, and the name of the highest.
_BEST = "best of full + oidn"
_TARGETS = {"full": ("35", "40"), "full + oidn": (_BEST,)}
#: By how many dB the worst micro-image may be behind the whole picture.
_WORST_BEHIND = 4.0


def describe(result: dict[str, Any]) -> str:
    """All of the section, in Markdown."""
    parts = [
        f"""## Error against time (`equal_error.py`)

Path light of depth 8, two cores, warm. Every way counts with the better effort of Open Image Denoise; guides, denoising
and sharing are in its time. Pooled pictures are made in two halves, as the program makes them: each is denoised and
shared, and gives way to samples that are nearer. Full + OIDN is denoised once, as a whole. Pictures are judged by two
references of {_reference_samples(result)} samples each, whose own noise is left out of the figures. Where full does
not come to a PSNR, its time is drawn out by the law of its noise, which flatters it where few paths find much light.
"Best" is the highest PSNR that full + OIDN comes to with up to 64 samples.

{_about_caustics(result)}

![PSNR against seconds for every scene and display](../images/equal-error.png)"""
    ]
    for name, (title, *rest) in DISPLAYS.items():
        if scenes := result["results"].get(name):
            parts += [f"### {title}", *_pooled_gains(scenes, result["summary"][name], *rest)]
            parts += ["\n".join(_times_to(scenes)), "\n".join(_curve_rows(scenes))]
    return "\n\n".join(parts) + "\n"


def _reference_samples(result: dict[str, Any]) -> str:
    """Of the references of all scenes."""
    found = {
        scene.get("reference_samples", result["reference_spp"] // 2)
        for scenes in result["results"].values()
        for scene in scenes.values()
    }
    return " or ".join(str(samples) for samples in sorted(found))


def _about_caustics(result: dict[str, Any]) -> str:
    """What brings the light that paths hardly find; and which rows were measured before that."""
    text = (
        "Small balls, primitives, room and gears have small emitters, mirrors and glass. Their caustics come by "
        "photons, what is seen of them in mirrors by [chains](caustics.md#seen-light), in references and pictures "
        "alike. Chains serve a sky in smooth gloss, too, and their time is in that of the pictures. Scenes are not all "
        "of one run, and the machine was not always as fast: seconds compare within a scene."
    )
    older = [
        f"{', '.join(names)} ({DISPLAYS[display][0]})"
        for display, scenes in result["results"].items()
        if (names := [name for name, scene in scenes.items() if "reference_samples" not in scene])
    ]
    if older:
        text += (
            f" Older are the rows of {'; '.join(older)}: their highlights went through the denoiser, and references of "
            "scenes with caustics were of paths, which lack a part of that light."
        )
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)


def _pooled_gains(scenes: dict[str, Any], summary: dict[str, Any], bound: str, *targets: int) -> list[str]:
    """How much faster than its rivals pooled light is, as a table, and what is behind its figures."""
    rows = ["| to | against | times as fast | least | target | paths | scenes |"]
    rows.append("|---|---|---|---|---|---|---|")
    short = []
    for rival, target in zip(_TARGETS, targets, strict=True):
        for goal in ("35", "40", _BEST):
            found = summary.get(f"pooled against {rival} to {goal}")
            if found is None:
                continue
            is_aim = goal in _TARGETS[rival]
            rows.append(
                f"| {_goal(goal)} | {name_of(rival)} | {found['times_faster']:.1f} | {found['least']:.1f} "
                f"| {target if is_aim else ''} | {_percent(found['share_of_paths'])} | {found['scenes']} |"
            )
            if is_aim:
                short.append(_short_of(scenes, goal, rival, target))
    return [
        "\n".join(rows),
        _wrapped(
            '"Paths" are those traced, as a share of the rival\'s. They and times are geometric means over the scenes '
            "in which both ways reach the PSNR; how many, the column beside says. The bound on paths, for light that "
            f"does not depend on direction, is {bound} of full's. (A denoiser goes below it where light is smooth: it "
            "shares between pixels, too.)"
        ),
        "\n".join(_wrapped(f"- {line}") for line in (*short, _ceiling(scenes), *_reach(scenes), _worst_behind(scenes))),
    ]


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 120, subsequent_indent="  " if text.startswith("- ") else "", break_on_hyphens=False)


def _worst_behind(scenes: dict[str, Any]) -> str:
    """In which scenes the worst micro-image keeps up with the whole."""
    behind = {name: [_gap(scene, way) for way in ("pooled", "full")] for name, scene in scenes.items()}
    kept = [name for name, (pooled, _) in behind.items() if pooled <= _WORST_BEHIND]
    figures = ", ".join(f"{name} {pooled:.1f} ({full:.1f})" for name, (pooled, full) in behind.items())
    return (
        f"The worst micro-image is to be at most {_WORST_BEHIND:g} dB behind the whole. It is in {len(kept)} of "
        f"{len(scenes)} scenes; dB that it is behind, in the pooled picture nearest to 40 dB, and in brackets in "
        f"full's: {figures}."
    )


def _short_of(scenes: dict[str, Any], goal: str, rival: str, target: int) -> str:
    """Which scenes have less than the target's gain, the least first."""
    less = sorted((gain, name) for name, gain in _gains(scenes, goal, rival).items() if gain < target)
    fast = f"Less than {target} times as fast as" if target > 1 else "Slower than"
    head = f"{fast} {name_of(rival)} to {_goal(goal)}: "
    return head + (", ".join(f"{name} ({gain:.1f})" for gain, name in less) or "none") + "."


def _ceiling(scenes: dict[str, Any]) -> str:
    """How fast pooled light could be if nothing had to be done to its paths."""
    parts = {name: scene["curves"]["pooled"][0]["parts"] for name, scene in scenes.items()}

    def gain(goal: str, *stages: str) -> float:
        return statistics.geometric_mean(
            scene["to"][goal]["full"]["seconds"] / sum(parts[name][stage] for stage in stages)
            for name, scene in scenes.items()
        )

    return (
        "One path per pixel and the guides alone, with denoising and sharing for nothing, would be "
        f"{gain('35', 'trace', 'guides'):.1f} times as fast as full to 35 dB, and {gain('40', 'trace', 'guides'):.1f} "
        "times to 40 dB; to know what each pixel sees, and no path at all, "
        f"{gain('35', 'guides'):.1f} and {gain('40', 'guides'):.1f} times."
    )


def _gains(scenes: dict[str, Any], goal: str, rival: str) -> dict[str, float]:
    """How many times as fast pooled light is in each scene in which both ways reach the goal."""
    costs = {name: [scene["to"][goal][way] for way in (rival, "pooled")] for name, scene in scenes.items()}
    return {name: theirs["seconds"] / ours["seconds"] for name, (theirs, ours) in costs.items() if theirs and ours}


def _reach(scenes: dict[str, Any]) -> list[str]:
    """Where pooled light is slower than full, what was not reached at all, and where full's time is no measured one."""
    slower = {goal: [name for name, gain in _gains(scenes, goal, "full").items() if gain < 1] for goal in ("35", "40")}
    told = "; ".join(f"to {_goal(goal)} {', '.join(names)}" for goal, names in slower.items() if names)
    lines = [f"Pooled light is to be slower than full in no scene. It is slower: {told or 'nowhere'}."]
    for goal in ("35", "40"):
        if never := [name for name, scene in scenes.items() if not scene["to"][goal]["pooled"]]:
            lines.append(f"Pooled light does not come to {_goal(goal)} with 64 samples: {', '.join(never)}.")
        if drawn := [name for name, scene in scenes.items() if (scene["to"][goal]["full"] or {}).get("drawn_out")]:
            lines.append(f"Full's time to {_goal(goal)} is drawn out (* below): {', '.join(drawn)}.")
    return lines


def _times_to(scenes: dict[str, Any]) -> list[str]:
    """Seconds of each way to each PSNR."""
    ways = ("full", "full + oidn", "pooled")
    goals = "full | full + OIDN | pooled"
    rows = [f"| scene | 35 dB: {goals} | 40 dB: {goals} | best | {goals} |"]
    rows.append("|" + "---|" * 11)
    for name, scene in scenes.items():
        best = max(point["psnr"] for point in scene["curves"]["full + oidn"])
        cells = [" | ".join(_cost(scene["to"][goal][way]) for way in ways) for goal in ("35", "40", _BEST)]
        cells.insert(2, f"{best:.1f} dB")
        rows.append(f"| {name} | {' | '.join(cells)} |")
    return rows


def _curve_rows(scenes: dict[str, Any]) -> list[str]:
    """All points that were measured."""
    rows = [
        "Seconds / PSNR / worst micro-image in dB, by samples (paths) per pixel:",
        "",
        "| scene | way | 1 | 4 | 16 | 64 |",
        "|---|---|---|---|---|---|",
    ]
    for name, scene in scenes.items():
        for way, curve in scene["curves"].items():
            for effort in dict.fromkeys(point.get("effort") for point in curve):
                points = {point["spp"]: point for point in curve if point.get("effort") == effort}
                cells = [
                    f"{p['seconds']:.2f} / {p['psnr']:.1f} / {p['worst_psnr']:.1f}" if (p := points.get(spp)) else ""
                    for spp in (1, 4, 16, 64)
                ]
                told = f"{name_of(way)}, {effort}" if effort else way
                rows.append(f"| {name} | {told} | {' | '.join(cells)} |")
    return rows


def _gap(scene: dict[str, Any], way: str = "pooled") -> float:
    """By how many dB the worst micro-image is behind the whole, in the picture nearest to 40 dB."""
    nearest = min(scene["curves"][way], key=lambda point: abs(point["psnr"] - 40))
    return float(nearest["psnr"] - nearest["worst_psnr"])


def _cost(found: dict[str, Any] | None) -> str:
    return f"{found['seconds']:.2f} s{' *' if found['drawn_out'] else ''}" if found else ""


def _goal(goal: str) -> str:
    return "best" if goal == _BEST else f"{goal} dB"


def name_of(way: str) -> str:
    return way.replace("oidn", "OIDN")


def _percent(share: float) -> str:
    return f"{100 * share:.{0 if share >= 0.1 else 1}f} %"
