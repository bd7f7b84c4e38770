"""What joining paths to light vertices saves, and what it takes: pictures by `full` with and without, side by side.

Time on two cores: an estimated 10 minutes.

The scenes of equal_error.py on 64 lenses of 8 pixels, and small rooms behind an array of 12 x 12 lenses. *Halves*: the
PSNR between two pictures of 16 samples with seeds of their own, which are exposed alike; time is that of the processors
over their number for such a picture, all preparation of its light included, the median of five, interleaved.

python benchmarks/light_vertices.py
"""

from __future__ import annotations

import statistics
from contextlib import nullcontext
from functools import partial
from typing import Any
from unittest import mock

import numpy as np

from caustic_scenes import CAUSTIC_SCENES
from equal_error import Stage, coded, once, prepare, trace_lit
from hard_caustics import psnr, small_array, turned
from hard_scenes import HARD_SCENES
from harness import save

SAMPLES, RUNS = 16, 5
SUITE = ("room", "primitives", "gears", "small-balls", "clearcoat", "teapot", "fancy-teapot", "tree")
ROOMS = ("mixed", "mirrors", "crack", "water", "curved_mirrors", "mirror_balls")


def main() -> None:
    from lippmann.runtime import engine

    engine.start("cpu", 2)
    results = {}
    for name in (*SUITE, *ROOMS):
        results[name] = _measured(prepare(name, "lenticular-8", caustics="auto") if name in SUITE else _room(name))
        print(name, results[name], flush=True)
        save("light_vertices", {"spp": SAMPLES, "scenes": results})


def _room(name: str) -> Stage:
    from lippmann.api import load_scene
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.session import open_session
    from lippmann.rendering.transport.ray_source import DisplayRays
    from lippmann.scene.placement import place

    scene = load_scene((CAUSTIC_SCENES.get(name) or HARD_SCENES[name])())
    display = small_array()
    at = place(scene.bounds, display, options=turned())
    session = open_session(scene, RenderRequest(integrator="path", pixel_filter="box", exposure=0.0), memory=4 << 30)
    source = DisplayRays(display, at.world_from_display)
    integrator = session.integrator(source, at.display_from_world)
    return Stage(session, integrator, source, display, at.display_from_world)


def _measured(stage: Stage) -> dict[str, Any]:
    from lippmann.rendering.preparation import prepare

    seconds: dict[str, list[float]] = {"alone": [], "joined": []}
    halves: dict[str, list[Any]] = {"alone": [], "joined": []}
    for run in range(RUNS + 1):
        for way, found in seconds.items():
            left_out = mock.patch.object(prepare, "trace_light_vertices", return_value=None)
            with left_out if way == "alone" else nullcontext():
                took, picture = once(partial(trace_lit, stage, SAMPLES, 1001 * (run + 1)))
            if run:  # the first is the warm-up
                found.append(took)
            halves[way].append(coded(picture))
            if way == "joined":
                is_joined = stage.integrator.light.light_vertices is not None
    return {
        "is_joined": is_joined,
        "halves": {way: psnr(np.square(pair[0] - pair[1]).mean()) for way, pair in halves.items()},
        "seconds": {way: statistics.median(found) for way, found in seconds.items()},
    }


if __name__ == "__main__":
    main()
