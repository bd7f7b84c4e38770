"""What dividing light gains at equal time: denoised pictures of an earlier program, and of today's.

The earlier program is a checkout of this repository; that of the published figures is the last before caustics came by
photons (36c4c2d). It runs in a process of its own, and both make each picture in turn, so that a machine that drifts
does so for both. Scenes, displays, references and time are those of equal_error.py; photons and looks are in the time.
Either program counts with the better effort of Open Image Denoise. Gained is the PSNR of today's picture over the
earlier program's in the same time, along its curve of PSNR over the logarithm of time; where today's takes less than
the earlier one's cheapest picture, over that.

python benchmarks/equal_time.py --before FOLDER [DISPLAY ...] [--scenes NAME,...] [--whole] [--references FOLDER]

With --whole all rows of the display are rendered.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve()
#: Scenes with outlines, sky or gloss.
SCENES = ("tree", "fancy-teapot", "clearcoat", "primitives")
SAMPLES = (1, 4, 16)
#: Of the earlier program's pictures; from 16 samples on, the curve ends where it takes longer than today's.
EARLIER_SAMPLES = (1, 2, 4, 8, 16, 32, 64)
REFERENCE = 96
#: Runs of either in turn: of pictures that take longer than so many seconds, and of others.
LONG, RUNS, SHORT_RUNS = 1.0, 3, 9


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("displays", nargs="*", default=["lenticular-8"])
    words.add_argument("--before", type=Path, required=True)
    words.add_argument("--scenes", default=",".join(SCENES))
    words.add_argument("--references", type=Path)
    words.add_argument("--whole", action="store_true")
    given = words.parse_args()
    from harness import save, saved

    results = saved("equal_time").get("results", {})
    for display in given.displays:
        for name in given.scenes.split(","):
            earlier = Earlier(given.before.resolve(), name, display, given.whole)
            measured = _measure(earlier, name, display, given)
            earlier.end()
            results.setdefault(f"{display}, whole" if given.whole else display, {})[name] = measured
            summary = {kind: _summary(scenes) for kind, scenes in results.items()}
            save("equal_time", {"reference_spp": 2 * REFERENCE, "results": results, "summary": summary})


def _measure(earlier: Earlier, name: str, display: str, given: argparse.Namespace) -> dict[str, Any]:
    import equal_error
    from harness import kept

    stage = _prepared(name, display, given.whole)
    rows = "whole-" if given.whole else ""
    file = given.references and given.references / f"{display}-{rows}{name}-{REFERENCE}.npz"
    pictures = kept(file, lambda: {"pictures": equal_error.reference_pair(stage, REFERENCE)})["pictures"]
    judge = equal_error.Judge(stage, pictures)
    exposure = float(stage.session.choices.get("exposure", 0.0))
    found: dict[str, Any] = {"judge_psnr": judge.own_psnr, "earlier": [], "today": []}
    for effort in ("fast", "high"):
        latest = 0.0
        for samples in EARLIER_SAMPLES:
            warm, _ = earlier.picture(samples, effort)
            if samples in SAMPLES:
                picture(stage, samples, effort)
            times: dict[str, list[float]] = {"earlier": [], "today": []}
            for _ in range(RUNS if warm > LONG else SHORT_RUNS):
                seconds, before = earlier.picture(samples, effort)
                times["earlier"].append(seconds)
                if samples in SAMPLES:
                    seconds, now = equal_error.once(
                        lambda samples=samples, effort=effort: picture(stage, samples, effort)
                    )
                    times["today"].append(seconds)
            point = {"spp": samples, "effort": effort, "seconds": statistics.median(times["earlier"])}
            found["earlier"].append({**point, **judge(before * np.float32(2 ** (exposure - earlier.exposure)))})
            if samples in SAMPLES:
                latest = statistics.median(times["today"])
                found["today"].append({"spp": samples, "effort": effort, "seconds": latest, **judge(now)})
            if samples >= max(SAMPLES) and found["earlier"][-1]["seconds"] > latest:
                break
    found["gain"] = {str(samples): _gain(found, samples) for samples in SAMPLES}
    return found


def _prepared(name: str, display: str, whole: bool) -> Any:
    import equal_error

    if whole:
        optics, options, _ = equal_error.DISPLAYS[display]
        equal_error.DISPLAYS[display] = optics, options, None
    if "light_up" not in vars(equal_error):
        return equal_error.prepare(name, display)
    return equal_error.prepare(name, display, "auto")


def picture(stage: Any, samples: int, effort: str) -> Any:
    """A pooled picture as the program makes it, whichever of the two it is."""
    import equal_error
    from lippmann.rendering.denoise.dual_buffer import Denoised
    from lippmann.rendering.film.sample_batches import FullInBatches

    is_today = "light_up" in vars(equal_error)
    if is_today:
        batches = equal_error.pooled_batches(stage, samples)
    else:
        batches = FullInBatches(stage.integrator, stage.source, seed=3, memory=4 << 30)
        batches.add(samples)
    denoiser = guided_denoiser(stage, effort)
    coverage = [denoiser.coverage] if is_today else []
    return Denoised(batches, denoiser.denoise, "srgb", equal_error.CORES, denoiser.share, *coverage).picture()


def guided_denoiser(stage: Any, effort: str) -> Any:
    """The denoiser of a pooled picture. It lies here as an earlier checkout has no other benchmark's."""
    import equal_error
    from lippmann.rendering.denoise.guided_denoiser import GuidedDenoiser

    return GuidedDenoiser(
        stage.built,
        stage.source,
        stage.display_from_world,
        seed=3,
        box_filter=True,
        memory=4 << 30,
        threads=equal_error.CORES,
        effort=lambda: effort,
        shares=True,
    )


class Earlier:
    """The earlier program in a process of its own."""

    def __init__(self, tree: Path, name: str, display: str, whole: bool) -> None:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(str(tree / each) for each in ("src", "benchmarks"))}
        code = f"import runpy; runpy.run_path({str(HERE)!r})['serve']({name!r}, {display!r}, {whole!r})"
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            env=environment,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self._file = Path(tempfile.mkdtemp()) / "picture.npy"
        self.exposure = self._answer()["exposure"]

    def picture(self, samples: int, effort: str) -> tuple[float, Any]:
        """Seconds, and the picture."""
        assert self._process.stdin is not None
        print(json.dumps([samples, effort, str(self._file)]), file=self._process.stdin, flush=True)
        seconds = self._answer()["seconds"]
        return seconds, np.load(self._file)

    def end(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()
        self._file.unlink()
        self._file.parent.rmdir()

    def _answer(self) -> dict[str, float]:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith("{"):
                return dict(json.loads(line))
        raise RuntimeError("The earlier program ended.")


def serve(name: str, display: str, whole: bool) -> None:
    """Pictures of the program that is on the path, as they are asked for by lines of standard input."""
    from lippmann.rendering.request import render_request

    if "caustics" not in render_request.RenderRequest.__dataclass_fields__:
        # Its benchmark did not say so yet; pixels were boxes.
        initial = render_request.RenderRequest
        render_request.RenderRequest = lambda **words: replace(initial(**words), pixel_filter="box")  # type: ignore
    import equal_error

    stage = _prepared(name, display, whole)
    print(json.dumps({"exposure": float(stage.session.choices.get("exposure", 0.0))}), flush=True)
    for line in sys.stdin:
        samples, effort, file = json.loads(line)
        seconds, result = equal_error.once(lambda samples=samples, effort=effort: picture(stage, samples, effort))
        np.save(file, result)
        print(json.dumps({"seconds": seconds}), flush=True)


def _gain(found: dict[str, Any], samples: int) -> dict[str, Any]:
    """Of the effort that gains more: dB of all, and of the worst micro-image."""
    gains = []
    for point in found["today"]:
        if point["spp"] == samples:
            best = max(_at(found["earlier"], effort, point["seconds"]) for effort in ("fast", "high"))
            gains.append(
                {
                    "effort": point["effort"],
                    "seconds": point["seconds"],
                    "psnr": point["psnr"] - best[0],
                    "worst_psnr": point["worst_psnr"] - best[1],
                }
            )
    return max(gains, key=lambda gain: gain["psnr"])


def _at(curve: list[dict[str, Any]], effort: str, seconds: float) -> tuple[float, float]:
    """PSNR, of all and of the worst micro-image, that the earlier program comes to in that time."""
    points = [point for point in curve if point["effort"] == effort]
    if seconds < points[0]["seconds"] and effort == "high":
        return -math.inf, -math.inf  # the cheapest picture is that of the other
    times = [math.log(point["seconds"]) for point in points]
    at = math.log(seconds)
    last = (at - times[-1]) / (times[-1] - times[-2]) if at > times[-1] else 0.0
    values = []
    for key in ("psnr", "worst_psnr"):
        levels = [point[key] for point in points]
        values.append(float(np.interp(at, times, levels)) + last * (levels[-1] - levels[-2]))
    return values[0], values[1]


def _summary(scenes: dict[str, Any]) -> dict[str, Any]:
    """Means of the gains in dB, and the least."""
    summary: dict[str, Any] = {}
    for samples in map(str, SAMPLES):
        gains = {name: scene["gain"][samples]["psnr"] for name, scene in scenes.items() if name in SCENES}
        if gains:
            summary[samples] = {"mean": statistics.mean(gains.values()), "least": min(gains.values()), "of": len(gains)}
    return summary


if __name__ == "__main__":
    main()
