"""An 8K frame in bounded memory: peak resident memory, and time per sample against that of a small frame.

Time on two cores: about a quarter of an hour.

7680 x 4320 pixels, path light, 4 samples per pixel, a limit of 2 GiB, written as PNG. Between its tiles a frame of
680 x 384 pixels (as many as 512 x 512) is rendered again and again, out of the large one's time, so that both see the
same machine; it has the same optics and the same shape, so that both see the same scene: a square frame would show more
sky. The teapot grows with the panel, and with it the distance at which rays begin: else those of the large frame would
start inside it. Targets: a peak of at most 2.5 GB, and time per sample within 15 % of the small frame's.
"""

from __future__ import annotations

import resource
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from harness import save

MEMORY = 2 * 2**30
LARGE, SMALL = (7680, 4320), (680, 384)
SPP = 4
#: Tiles of the large frame between two small frames.
TILES_BETWEEN = 8


def main() -> None:
    import lippmann
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.session import open_session
    from lippmann.rendering.transport.ray_source import DisplayRays
    from lippmann.scene.placement import place

    scene = lippmann.load_scene("teapot")
    optics = lippmann.load_display("seed-lenticular")
    grown = optics.aperture_distance * LARGE[1] / SMALL[1]
    display = replace(optics.resized(*LARGE), aperture_distance=grown)
    image = lippmann.render(scene, display, spp=SPP, memory=MEMORY)
    with tempfile.TemporaryDirectory() as folder:
        image.save(Path(folder) / "frame.png")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

    session = open_session(scene, RenderRequest(integrator="path", spp=SPP))
    frames = {}
    for name, shown in (("large", display), ("small", optics.resized(*SMALL))):
        at = place(scene.bounds, shown, cameras=scene.cameras, home_camera=scene.home_camera)
        source = DisplayRays(shown, at.world_from_display)
        integrator = session.integrator(source, at.display_from_world)
        frames[name] = (integrator, source, cut_wavefronts(source.width, source.height, SPP, memory=MEMORY))

    for seed in range(5):
        trace_frame(*frames["small"], seed=seed)
    small: list[float] = []
    large = {"seconds": 0.0, "since": 0.0, "tiles": 0.0, "first": 0.0, "work": 0.0}

    def between_tiles(progress: lippmann.Progress) -> None:
        now = time.perf_counter()
        if large["tiles"]:  # the first also compiles
            large["seconds"] += now - large["since"]
        else:
            large["first"] = progress.done
        large["tiles"] += 1
        large["work"] = progress.done
        if large["tiles"] % TILES_BETWEEN == 0:
            trace_frame(*frames["small"])  # the caches are the large frame's: not counted
            start = time.perf_counter()
            trace_frame(*frames["small"])
            small.append(time.perf_counter() - start)
        large["since"] = time.perf_counter()

    trace_frame(*frames["large"], progress=between_tiles)
    per_sample = {
        "large": large["seconds"] / (large["work"] - large["first"]),
        "small": statistics.mean(small) / (SMALL[0] * SMALL[1] * SPP),
    }
    save(
        "large_frame",
        {
            "size": LARGE,
            "spp": SPP,
            "memory_limit": MEMORY,
            "peak_resident_bytes": peak,
            "target_peak_bytes": 2.5e9,
            "small_frames": len(small),
            "nanoseconds_per_sample": {name: value * 1e9 for name, value in per_sample.items()},
            "time_per_sample_relative_to_small": per_sample["large"] / per_sample["small"],
            "target_relative": 1.15,
        },
    )


if __name__ == "__main__":
    main()
