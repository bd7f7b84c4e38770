"""What a quality takes that is asked for: by full, by full with Open Image Denoise, by pooled.

The scenes, displays and rows of equal_error.py. Each way is asked for a PSNR of the whole picture (``--quality``)
and works until its own estimate says that it is there, judging included, with at most 256 samples a pixel. Where full
does not come to the PSNR with these, its time is drawn out by the law of its noise. Time is that of the processors over
their number; each way has run before, for a low quality.

python benchmarks/goals.py [DISPLAY ...] [--scenes NAME,...]
"""

from __future__ import annotations

import argparse
import statistics
from dataclasses import replace
from typing import Any

from equal_error import Stage, asked, once, prepare
from harness import save, saved

QUALITIES = (35.0, 40.0)
MOST_SAMPLES = 256
#: A quality that every way has after its first round.
LOW = 10.0
WAYS: dict[str, dict[str, Any]] = {
    "full": {"method": "full", "denoise": "none"},
    "full + oidn": {"method": "full", "denoise": "oidn"},
    "pooled": {"method": "pooled", "denoise": "auto"},
}


def main() -> None:
    results = saved("goals").get("results", {})
    _, scenes = asked(argparse.ArgumentParser(description=__doc__))
    for name, displays in scenes:
        for display in displays:
            results.setdefault(display, {})[name] = _measured(prepare(name, display))
            summary = {kind: _summary(measured) for kind, measured in results.items()}
            save("goals", {"most_samples": MOST_SAMPLES, "results": results, "summary": summary})


def _measured(stage: Stage) -> dict[str, Any]:
    found: dict[str, Any] = {f"{quality:g}": {} for quality in QUALITIES}
    for way, options in WAYS.items():
        _reached(stage, LOW, options)
        for quality in QUALITIES:
            found[f"{quality:g}"][way] = _reached(stage, quality, options)
    return found


def _reached(stage: Stage, quality: float, options: dict[str, Any]) -> dict[str, Any]:
    """Seconds and samples, and where it ended."""
    from lippmann.rendering.methods import Job, trace
    from lippmann.rendering.request.resolve import resolve

    asked = replace(stage.session.request, quality=quality, spp=MOST_SAMPLES, **options)
    session = replace(stage.session, request=resolve(asked, stage.session.scene))
    job = Job(session, stage.integrator, stage.source, stage.display_from_world)
    seconds, traced = once(lambda: trace(job))
    assert traced.estimate is not None
    short = max(0.0, quality - traced.estimate.psnr)
    if options["denoise"] == "none":
        # Its error times its time is constant.
        seconds *= 10 ** (short / 10)
    return {
        "seconds": seconds,
        "spp": traced.samples,
        "psnr": traced.estimate.psnr,
        "short": short,
        "denoised": "denoise" in traced.options,
    }


def _summary(scenes: dict[str, Any]) -> dict[str, Any]:
    """By quality and rival: how many times as fast pooled is, over the scenes in which it gets there."""
    summary: dict[str, Any] = {}
    for quality in next(iter(scenes.values())):
        for rival in ("full", "full + oidn"):
            times = {
                name: goals[quality][rival]["seconds"] / goals[quality]["pooled"]["seconds"]
                for name, goals in scenes.items()
                if not goals[quality]["pooled"]["short"] and (rival == "full" or not goals[quality][rival]["short"])
            }
            if times:
                mean = statistics.geometric_mean(times.values())
                summary[f"{rival} to {quality}"] = {"times_faster": mean, "least": min(times.values()), "scenes": times}
    return summary


if __name__ == "__main__":
    main()
