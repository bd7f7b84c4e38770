"""What all benchmarks share: fair timing, the machine in words, results as JSON.

Times are medians of several runs, interleaved where things are compared, after a warm-up of each: a shared machine
drifts, and what runs side by side drifts alike. Absolute times are this machine's; the ratios are what counts.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

RESULTS = Path(__file__).parent / "results"


def kept(file: Path | None, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Named arrays that take long to make: those in ``file`` if it is there; else they are made, and kept there."""
    if file is not None and file.exists():
        with np.load(file) as found:
            return dict(found)
    made = make()
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(file, **made)
    return made


def interleaved(
    candidates: Mapping[str, Callable[[int], object]], runs: int = 9, warm_up: int = 2
) -> dict[str, list[float]]:
    """Seconds of each candidate, called in turn with the number of the run; the first ``warm_up`` are not counted."""
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    for run in range(warm_up + runs):
        for name, call in candidates.items():
            start = time.perf_counter()
            call(run)
            if run >= warm_up:
                seconds[name].append(time.perf_counter() - start)
    return seconds


def summary(seconds: list[float]) -> dict[str, float]:
    """Minimum, median and maximum."""
    return {"min": min(seconds), "median": statistics.median(seconds), "max": max(seconds)}


def median_ratio(a: list[float], b: list[float]) -> float:
    """Median over the pairs of a/b: what drift both share cancels."""
    return statistics.median(x / y for x, y in zip(a, b, strict=True))


def machine() -> dict[str, Any]:
    """The machine and the versions in words, without its name."""
    import drjit
    import mitsuba

    model = platform.processor()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = [line for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        model = lines[0].split(":", 1)[1].strip() if lines else model
    return {
        "processor": model,
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "python": platform.python_version(),
        "mitsuba": mitsuba.__version__,
        "drjit": drjit.__version__,
        "date": datetime.now(timezone.utc).date().isoformat(),
    }


def save(name: str, values: Mapping[str, Any], *, show: bool = True) -> None:
    """Write ``results/NAME.json`` and show it."""
    RESULTS.mkdir(exist_ok=True)
    text = json.dumps({"machine": machine(), **values}, indent=2)
    (RESULTS / f"{name}.json").write_text(text + "\n")
    if show:
        print(text, file=sys.stderr)


def saved(name: str) -> dict[str, Any]:
    """What ``results/NAME.json`` holds; nothing if there is none."""
    path = RESULTS / f"{name}.json"
    values: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    return values
