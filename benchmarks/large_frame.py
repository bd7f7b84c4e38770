"""An 8K frame in bounded memory: peak resident memory, and time per sample against that of a small frame.

7680 x 4320 pixels, path light, 4 samples per pixel, a limit of 2 GiB, written as PNG. Between its tiles a 512 x 512
frame of the same optics is rendered again and again, out of the large one's time, so that both see the same machine.
Targets: a peak of at most 2.5 GB, and time per sample within 15 % of the small frame's.
"""

from __future__ import annotations

import resource
import statistics
import tempfile
import time
from pathlib import Path

from harness import save

MEMORY = 2 * 2**30
LARGE, SMALL = (7680, 4320), (512, 512)
SPP = 4
#: Tiles of the large frame between two small frames.
TILES_BETWEEN = 8


def main() -> None:
    import lippmann

    scene = lippmann.load_scene("teapot")
    optics = lippmann.load_display("seed-lenticular")
    display = optics.resized(*LARGE)
    for seed in range(5):
        lippmann.render(scene, optics, spp=SPP, seed=seed, memory=MEMORY)

    small: list[float] = []
    large = {"seconds": 0.0, "since": 0.0, "tiles": 0}

    def between_tiles(progress: lippmann.Progress) -> None:
        now = time.perf_counter()
        if progress.stage != "trace":
            return
        if large["tiles"]:  # the first also compiles
            large["seconds"] += now - large["since"]
        large["tiles"] += 1
        large["work"] = progress.done
        large.setdefault("first", progress.done)
        if large["tiles"] % TILES_BETWEEN == 0:
            small.append(lippmann.render(scene, optics, spp=SPP, memory=MEMORY).stats["seconds"]["trace"])
        large["since"] = time.perf_counter()

    image = lippmann.render(scene, display, spp=SPP, memory=MEMORY, progress=between_tiles)
    with tempfile.TemporaryDirectory() as folder:
        image.save(Path(folder) / "frame.png")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
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
