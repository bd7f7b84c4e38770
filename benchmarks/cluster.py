"""Workers on this machine: two against one, and two against two threads in one process.

Time on two cores: about an hour.

The frame is large_frame.py's: 7680 x 4320 pixels, path light, 4 samples per pixel, TIFF; ``python benchmarks/cluster.py
1920x1080`` takes another size. Workers are connected and warm before time is taken, and all candidates run in turn. Two
one-thread workers shall be at least 1.7 times as fast as one, and the same two at most 15 % slower than one process
with two threads. Seconds of the processors are counted beside those of the clock: on a machine that others use, too,
their ratios say more. Other sizes keep the results that they have.
"""

from __future__ import annotations

import re
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from harness import save, saved

SIZE = (7680, 4320)
SMALL_HEIGHT = 384
SPP = 4
RUNS = 3
SPEED_UP, OVERHEAD = 1.7, 1.15


def main() -> None:
    import lippmann
    from lippmann import api
    from lippmann.cluster import Cluster, Target, connect
    from lippmann.cluster.runner import runner_on

    found = re.fullmatch(r"(\d+)x(\d+)", sys.argv[1]) if len(sys.argv) > 1 else None
    size = (int(found[1]), int(found[2])) if found else SIZE
    scene = lippmann.load_scene("teapot")
    display = grown(lippmann.load_display("seed-lenticular"), size)
    folder = Path(tempfile.mkdtemp())

    def render(cluster: Cluster | None, threads: int) -> None:
        runner = None if cluster is None else runner_on(cluster)
        output = folder / "frame.tif"
        options: dict[str, Any] = {"integrator": "path", "spp": SPP, "device": "cpu", "threads": threads}
        api.render_to_file(scene, output, display, runner=runner, **options)
        output.unlink()

    with ExitStack() as stack:
        one = stack.enter_context(connect(Target(local=1), threads=1))
        two = stack.enter_context(connect(Target(local=2), threads=2))
        candidates: dict[str, Callable[[], None]] = {
            "two threads": lambda: render(None, 2),
            "two workers": lambda: render(two, 2),
            "one worker": lambda: render(one, 1),
        }
        clock: dict[str, list[float]] = {name: [] for name in candidates}
        processors: dict[str, list[float]] = {name: [] for name in candidates}
        for run in range(1 + RUNS):  # the first warms everything up
            for name, call in candidates.items():
                began, used = time.perf_counter(), processor_seconds()
                call()
                if run:
                    clock[name].append(time.perf_counter() - began)
                    processors[name].append(processor_seconds() - used)
                    print(f"{name}: {clock[name][-1]:.1f} s, {processors[name][-1]:.1f} s of processors", flush=True)
    measured = {
        "spp": SPP,
        "seconds": clock,
        "processor_seconds": processors,
        "speed_up": ratio(clock, "one worker", "two workers"),
        "overhead": ratio(clock, "two workers", "two threads"),
        "processor_overhead": ratio(processors, "two workers", "two threads"),
    }
    sizes = saved("cluster").get("sizes", {}) | {f"{size[0]}x{size[1]}": measured}
    ordered = dict(sorted(sizes.items(), key=lambda entry: int(entry[0].split("x")[0])))
    save("cluster", {"sizes": ordered, "targets": {"speed_up": SPEED_UP, "overhead": OVERHEAD}})


def grown(optics: Any, size: tuple[int, int]) -> Any:
    """The same optics on a larger panel; the distance at which rays begin grows with it, as the scene does."""
    panel = replace(optics.panel, width=size[0], height=size[1])
    return replace(optics, panel=panel, aperture_distance=optics.aperture_distance * size[1] / SMALL_HEIGHT)


def processor_seconds() -> float:
    """What this process and all that it has started have used of the processors, those that still run."""
    import psutil

    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def ratio(seconds: dict[str, list[float]], above: str, below: str) -> float:
    """Median over the runs of one candidate's time to another's."""
    return statistics.median(a / b for a, b in zip(seconds[above], seconds[below], strict=True))


if __name__ == "__main__":
    main()
