"""The live renderer at work: how fast frames follow a move, how soon a view at rest is clean, and whether it is right.

Time on two cores: an estimated 10 minutes.

For each display and scene:

- an orbit of single samples in direct light: frames a second by the clock, processor time of a frame, and how much of
  it each stage takes;
- the first frame of a warm renderer after a move;
- a view at rest: samples and PSNR over time, against two long references of the same eye that know nothing of each
  other (the mean of (p - a)(p - b) is free of their noise);
- the agreement of a frame with the replay of a whole render by the same settings.

And once: the time from starting a process to its first frame (kernels in Dr.Jit's cache), and moves without end
(``--minutes``), whose memory and oldest frame are watched. Targets: 30 frames a second (Looking Glass Portrait: 15),
100 ms, 5 s, 35 dB within 2 s, 60 dB.

Processor time stands beside the clock's, since other work on the machine does not stretch it: over the number of cores
it is the least that a frame can take on an idle machine, and never quite reached: placing is one thread's work.

python benchmarks/studio.py [--minutes 10] [--only mla-square], which keeps the other cases as they were
"""

from __future__ import annotations

import argparse
import itertools
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from harness import save, saved

GLTF = Path(__file__).parent.parent.parent / "shared" / "scenes" / "gltf"
SCENES = {
    "teapot": "teapot",
    "fancy teapot": str(GLTF / "fancy_teapot" / "scene.gltf"),
    "clearcoat test": str(GLTF / "clearcoat_test" / "ClearCoatTest.gltf"),
}
#: Displays, the picture's size while it moves, and at rest.
DISPLAYS = {
    "seed-lenticular": ((512, 512), (512, 512)),
    "mla-square": ((512, 512), (512, 512)),
    "looking-glass-portrait": ((192, 256), (192, 256)),
}
ORBIT, GOAL = 40, 35.0
#: Frames after which the memory of moves without end is looked at first.
EARLY_FRAMES = 40
#: A view rests for so many seconds of one processor (two idle cores have them in two seconds), or by the clock.
REST_PROCESSOR_SECONDS, REST_SECONDS = 4.0, 40.0
#: Samples that each reference has in all, and of each pixel at most.
REFERENCE_WORK, REFERENCE_SAMPLES = 1 << 22, 256

_START = """
import time, sys
from lippmann.display import load_display
from lippmann.rendering.live.live_view import LiveView
from lippmann.rendering.live.renderer import LiveRenderer
from lippmann.scene.readers.load import load_scene
from lippmann.viewing.replay import default_eye
display = load_display(sys.argv[1])
LiveRenderer(load_scene("teapot"), display).frame(LiveView(default_eye(display), (512, 512)))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=0.0)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    cases: dict[str, Any] = dict(saved("studio").get("cases", {})) if asked.only else {}
    for name, display, source in wanted_cases(DISPLAYS, asked.only, cases):
        cases[name] = _case(display, source)
        print(name, cases[name], flush=True)
    result: dict[str, Any] = {"cases": cases, "start": _start()}
    if asked.minutes:
        result["endless"] = _endless(asked.minutes)
    elif asked.only:
        result["endless"] = saved("studio").get("endless")
    save("studio", result)


def wanted_cases(displays: Iterable[str], only: str, cases: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Name, display and scene of each case with ``only`` in its name; ``cases`` is told which scenes are missing."""
    for display, (scene, source) in itertools.product(displays, SCENES.items()):
        name = f"{display}/{scene}"
        if only not in name:
            continue
        if source != scene and not Path(source).exists():
            cases[name] = {"skipped": f"{Path(source).name} not found"}
            continue
        yield name, display, source


def _view(display: Any, size: tuple[int, int], turn: float, **request: Any) -> Any:
    from lippmann.options.placement import PlacementOptions
    from lippmann.rendering.live.live_view import LiveView
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.viewing.replay import default_eye

    placed = PlacementOptions(turn=(turn, 0.0, 0.0))
    asked = RenderRequest(placement=placed, **{"tone_map": "pbr-neutral"} | request)
    return LiveView(default_eye(display), size, request=asked)


def _case(name: str, source: str) -> dict[str, Any]:
    from lippmann.display import load_display
    from lippmann.rendering.live.renderer import LiveRenderer
    from lippmann.scene.readers.load import load_scene

    display, scene = load_display(name), load_scene(source)
    moving, resting = DISPLAYS[name]
    renderer = LiveRenderer(scene, display)
    for turn in (1.0, 2.0):
        renderer.frame(_view(display, moving, turn))
    found = _orbit(renderer, moving)
    found["rest"] = _rest(renderer, resting)
    found["first_after_move_ms"] = _after_rest(renderer, moving)
    found["replay_db"] = _agreement(renderer, scene, moving)
    return found


def _orbit(renderer: Any, size: tuple[int, int]) -> dict[str, Any]:
    stages: dict[str, float] = {}
    times, busy = [], time.process_time()
    for number in range(ORBIT):
        began = time.perf_counter()
        frame = renderer.frame(_view(renderer.display, size, 3.0 * number))
        times.append(time.perf_counter() - began)
        for stage, seconds in frame.seconds.items():
            stages[stage] = stages.get(stage, 0.0) + 1000 * seconds / ORBIT
    busy = (time.process_time() - busy) / ORBIT
    cores = len(os.sched_getaffinity(0))
    return {
        "size": list(size),
        "frames_per_second": ORBIT / sum(times),
        "best_frames_per_second": 1 / min(times),
        "median_ms": 1000 * statistics.median(times),
        "processor_ms": 1000 * busy,
        "idle_frames_per_second": cores / busy,
        "stages_ms": stages,
    }


def _rest(renderer: Any, size: tuple[int, int]) -> dict[str, Any]:
    """Samples and PSNR over the seconds that a view rests, and when it came to the goal."""
    view = _view(renderer.display, size, 30.0)
    references = [_reference(renderer, _view(renderer.display, size, 30.0, seed=seed)) for seed in (101, 202)]
    _refine(renderer, _view(renderer.display, size, 20.0))  # kernels of paths and feature buffers are recorded
    for _ in range(3):
        _refine(renderer, _view(renderer.display, size, 20.0))
    track: list[dict[str, float]] = []
    began, busy = time.perf_counter(), time.process_time()
    while time.process_time() - busy < REST_PROCESSOR_SECONDS and time.perf_counter() - began < REST_SECONDS:
        frame = _refine(renderer, view)
        if frame is not None:
            first, second = (frame.pixels / 255.0 - reference for reference in references)
            psnr = float(-10 * np.log10(max((first * second).mean(), 1e-9)))
            spent = time.process_time() - busy
            track.append({"s": time.perf_counter() - began, "processor_s": spent, "samples": frame.samples, "db": psnr})
    reached = next((step for step in track if step["db"] >= GOAL), None)
    return {"track": track, "reached": reached, "last": track[-1]}


def _refine(renderer: Any, view: Any) -> Any:
    """One more step for a view at rest, whose steps go on as long as the view stays."""
    if getattr(renderer, "rest", (None,))[0] != view:
        renderer.rest = view, renderer.refine_steps(view)
    return next(renderer.rest[1])


def _reference(renderer: Any, view: Any) -> np.ndarray:
    """Codes in [0, 1] of many samples as they are."""
    from lippmann.rendering.live.live_view import LiveView

    _refine(renderer, view)
    progressive = renderer.rest[1].gi_frame.f_locals["progressive"]
    progressive._denoises = False
    enough = min(REFERENCE_SAMPLES, max(16, REFERENCE_WORK // len(progressive._pixels.column)))
    frame = None
    while frame is None or progressive.samples < enough:
        frame = _refine(renderer, view) or frame
    assert isinstance(view, LiveView)
    return np.asarray(frame.pixels / 255.0)


def _after_rest(renderer: Any, size: tuple[int, int]) -> float:
    times = []
    for number in range(5):
        for _ in range(2):
            _refine(renderer, _view(renderer.display, size, 50.0 + number))
        began = time.perf_counter()
        renderer.frame(_view(renderer.display, size, 60.0 + number))
        times.append(time.perf_counter() - began)
    return 1000 * statistics.median(times)


def _agreement(renderer: Any, scene: Any, size: tuple[int, int]) -> float:
    from lippmann.api import render
    from lippmann.color.transfer import quantize

    plain = {"tone_map": "none"} if renderer.display.has_slanted_stripes else {}
    view = _view(renderer.display, size, 30.0, **plain)
    frame = renderer.frame(view)
    image = render(
        scene,
        renderer.display,
        method="full",
        denoise="none",
        integrator="direct",
        spp=1,
        placement=view.request.placement,
        tone_map=view.request.tone_map,
    )
    codes = quantize(image.replay(view.eye, size=size), 8, "srgb")
    error = np.mean((frame.pixels / 255.0 - codes / 255.0) ** 2)
    return float(-10 * np.log10(max(error, 1e-12)))


def _start() -> dict[str, float]:
    """Seconds from starting a process to its first frame: by the clock, and of processors."""
    import resource

    seconds, busy = [], []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        began = time.perf_counter()
        subprocess.run([sys.executable, "-c", _START, "seed-lenticular"], check=True)
        seconds.append(time.perf_counter() - began)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        busy.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return {"s": min(seconds), "processor_s": min(busy)}


def _endless(minutes: float) -> dict[str, float]:
    """Moves of everything that moves, with rests between: memory after some frames and at the end, oldest frame."""
    import psutil

    from lippmann.display import load_display
    from lippmann.rendering.live.renderer import LiveRenderer
    from lippmann.scene.readers.load import load_scene

    renderer = LiveRenderer(load_scene("teapot"), load_display("seed-lenticular"))
    process, began, frames, oldest, early = psutil.Process(), time.perf_counter(), 0, 0.0, 0
    while time.perf_counter() - began < 60 * minutes:
        view = _view(renderer.display, (512, 512), 1.3 * frames % 360, exposure=0.1 * (frames % 7))
        asked = time.perf_counter()
        renderer.frame(view)
        if frames > 10:
            oldest = max(oldest, time.perf_counter() - asked)
        if frames % 20 == 0:
            for _ in range(4):
                _refine(renderer, view)
        frames += 1
        if frames <= EARLY_FRAMES:
            early = process.memory_info().rss
    last = process.memory_info().rss
    return {
        "minutes": minutes,
        "frames": frames,
        "oldest_s": oldest,
        "early_mib": early / 2**20,
        "last_mib": last / 2**20,
    }


if __name__ == "__main__":
    main()
