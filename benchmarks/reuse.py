"""What reusing points saves, and what it costs in quality: six scenes, both methods, with and without gloss respected.

Time on two cores: about half an hour.

Three experiments: the paper's display of 512 x 512 pixels, and the same optics before 3840 x 2160 pixels (480 lenses of
8 pixels), both with the classic light, ray depth 2 and one ray through each pixel's middle, as in the paper; and dear
shading at 1920 x 1080: path light of the default depth, 16 samples per pixel, emitters of some size.

Seconds are processor seconds of tracing and reuse with one thread, so that a machine with other work measures the same:
medians of runs that take turns after one to warm up. What a method saves is the median over the turns of its share of
what ``full`` took in the same turn. Large pictures are timed once after one to warm up; dear shading once and by the
clock with all cores: seconds are many, and those of compiling are counted apart.

python benchmarks/reuse.py [small] [large] [dear]
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

from harness import median_ratio, save, saved


@dataclass(frozen=True)
class Case:
    """One experiment: a panel, the light, and how often each way is rendered, after so many runs to warm up."""

    size: tuple[int, int]
    light: dict[str, Any]
    runs: int
    warm_up: int = 1
    threads: int | None = 1


AS_THE_PAPER = {"integrator": "classic", "depth": 2, "spp": 1, "pixel_filter": "point"}
CASES = {
    "small": Case((512, 512), AS_THE_PAPER, 7),
    "large": Case((3840, 2160), AS_THE_PAPER, 1),
    "dear": Case((1920, 1080), {"integrator": "path", "spp": 16}, 1, warm_up=0, threads=None),
}
METHODS = ("lens-view", "interpolated")
WAYS = {
    "full": {},
    **{f"{method}, {words}": {"method": method, "respect_gloss": careful}
       for words, careful in (("gloss not respected", False), ("gloss respected", True)) for method in METHODS},
    **{f"{method}, paper's order": {"method": method, "order": "paper"} for method in METHODS},
}  # fmt: skip
#: Ways of the large experiments: the paper's order goes lens by lens and is shown on the paper's own display.
WAYS_OF_LARGE = [way for way in WAYS if not way.endswith("order")]
#: The paper's order and gloss are no part of what is asked of dear shading.
WAYS_OF_DEAR = ["full", *(f"{method}, gloss not respected" for method in METHODS)]


def main(cases: list[str]) -> None:
    results = saved("reuse").get("results", {})
    for name in cases:
        results[name] = list(_measure(CASES[name], name))
        save("reuse", {"results": results})


def _measure(case: Case, name: str) -> Iterator[dict[str, Any]]:
    time.perf_counter = lambda: Clock.now()  # before anything takes it as a default

    import lippmann
    from lippmann.scene import bundled

    display = lippmann.load_display("seed-lenticular").resized(*case.size)
    ways = {"small": list(WAYS), "large": WAYS_OF_LARGE, "dear": WAYS_OF_DEAR}[name]
    for scene_name in bundled.names():
        scene = lippmann.load_scene(scene_name)
        images: dict[str, Any] = {}
        seconds: dict[str, list[float]] = {way: [] for way in ways}
        for run in range(-case.warm_up, case.runs):
            for way in ways:
                with _processor_time() if run >= 0 and case.warm_up else nullcontext():
                    images[way] = lippmann.render(
                        scene, display, tone_map="none", threads=case.threads, **case.light, **WAYS[way]
                    )
                if run >= 0:
                    spent = images[way].provenance.seconds
                    seconds[way].append(spent["trace"] + spent["reuse"])
        full = images["full"]
        for way in ways[1:]:
            share = median_ratio(seconds[way], seconds["full"])
            yield {
                "scene": scene_name,
                "way": way,
                "seconds": statistics.median(seconds[way]),
                "full_seconds": statistics.median(seconds["full"]),
                "saved": 1 - share,
                "pixel_shares": dict(images[way].provenance.pixel_shares),
                **_quality(full, images[way]),
            }


class Clock:
    """What stages of a render are timed by."""

    now = staticmethod(time.perf_counter)


@contextmanager
def _processor_time() -> Iterator[None]:
    """All stages of a render are timed by the processor's seconds; warm kernels take none to compile."""
    from lippmann.rendering.film import wavefront
    from lippmann.rendering.reprojection import pixel_tracer

    with patch.object(Clock, "now", time.process_time), ExitStack() as patches:
        for module in (wavefront, pixel_tracer):
            patches.enter_context(patch.object(module, "measure_compilation", lambda: 0.0))
        yield


def _quality(full: Any, image: Any) -> dict[str, float]:
    """The paper's average, and the worst micro-image, against full tracing."""
    from lippmann.metrics import compare

    found = compare(full, image)
    return {"paper_mean_psnr": found.paper.mean_psnr, "psnr": found.psnr, "worst_psnr": found.worst.psnr}


if __name__ == "__main__":
    main(sys.argv[1:] or list(CASES))
