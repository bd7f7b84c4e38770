"""An 8K frame in bounded memory: peak resident memory, and time per sample against that of a small frame.

7680 x 4320 pixels, path light, 4 samples per pixel, a limit of 2 GiB; the small frame has 512 x 512 pixels of the same
optics and is repeated until it has run about as long. Each runs in a process of its own, so that the peak is its own.
Targets: a peak of at most 2.5 GB, and time per sample within 15 % of the small frame's.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time

from harness import save, summary

MEMORY = 2 * 2**30
LARGE, SMALL = (7680, 4320), (512, 512)
SPP = 4


def measure(width: int, height: int, repeats: int) -> None:
    """Child process: render ``repeats`` times, warm, and print seconds and the peak of resident memory."""
    import lippmann

    scene = lippmann.load_scene("teapot")
    optics = lippmann.load_display("seed-lenticular")
    # The panel keeps its size in millimetres' proportion to the scene: the placement fits the scene to the panel.
    display = optics.resized(width, height)
    lippmann.render(scene, optics, spp=1, memory=MEMORY, place="fit")
    seconds = []
    for seed in range(repeats):
        image = lippmann.render(scene, display, spp=SPP, seed=seed, memory=MEMORY, place="fit")
        seconds.append(image.stats["seconds"]["trace"])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(json.dumps({"seconds": seconds, "peak": peak, "mean": float(image.pixels.mean())}))


def run(size: tuple[int, int], repeats: int) -> dict[str, object]:
    command = [sys.executable, __file__, str(size[0]), str(size[1]), str(repeats)]
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return json.loads(out.splitlines()[-1])


def main() -> None:
    started = time.time()
    small_before = run(SMALL, 25)
    large = run(LARGE, 1)
    small_after = run(SMALL, 25)
    small = small_before["seconds"][5:] + small_after["seconds"][5:]
    per_sample = {
        "large": summary(large["seconds"])["median"] / (LARGE[0] * LARGE[1] * SPP),
        "small": summary(small)["median"] / (SMALL[0] * SMALL[1] * SPP),
    }
    save(
        "large_frame",
        {
            "size": LARGE,
            "spp": SPP,
            "memory_limit": MEMORY,
            "peak_resident_bytes": large["peak"],
            "target_peak_bytes": 2.5e9,
            "nanoseconds_per_sample": {name: value * 1e9 for name, value in per_sample.items()},
            "time_per_sample_relative_to_small": per_sample["large"] / per_sample["small"],
            "target_relative": 1.15,
            "seconds_in_all": time.time() - started,
        },
    )


if __name__ == "__main__":
    if len(sys.argv) == 4:
        measure(*map(int, sys.argv[1:]))
    else:
        main()
