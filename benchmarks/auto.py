"""What ``--method auto`` takes for a quality, and whether the other way would have been faster.

Path light on a part of the paper's display; asked is the PSNR of the whole picture. CPU seconds of tracing, denoising
and judging, each way after a run that warms it; at most 512 samples a pixel.

python benchmarks/auto.py [SCENE ...]
"""

from __future__ import annotations

import argparse
import time
from typing import Any

from equal_error import GLTF
from harness import save, saved

SIZE = (256, 96)
QUALITIES = (28.0, 34.0, 40.0)
MOST_SAMPLES = 512
WAYS: dict[str, dict[str, str]] = {
    "auto": {},
    "plain": {"denoise": "none"},
    "pooled": {"method": "pooled", "denoise": "oidn"},
}


def main() -> None:
    from lippmann.scene import library

    known = [*library.names(), *(name for name, path in GLTF.items() if path.exists())]
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("scenes", nargs="*", default=known)
    rows = {row["scene"]: row for row in saved("auto").get("rows", [])}
    for name in words.parse_args().scenes:
        rows[name] = {"scene": name, "goals": [_goal(name, quality) for quality in QUALITIES]}
        save("auto", {"size": SIZE, "most_samples": MOST_SAMPLES, "rows": list(rows.values())})


def _goal(name: str, quality: float) -> dict[str, Any]:
    import lippmann

    scene = lippmann.load_scene(GLTF.get(name, name))
    display = lippmann.load_display("seed-lenticular").resized(*SIZE)
    found: dict[str, Any] = {"quality_mean": quality}
    for way, options in WAYS.items():
        for _ in range(2):
            started = time.process_time()
            image = lippmann.render(
                scene, display, integrator="path", quality_mean=quality, spp=MOST_SAMPLES, **options
            )
            seconds = time.process_time() - started
        made = image.provenance
        assert made.estimate is not None
        found[way] = {
            "seconds": seconds,
            "spp": made.spp,
            "psnr": made.estimate["psnr"],
            "method": made.method,
            "why": made.options.get("auto", ""),
        }
    return found


if __name__ == "__main__":
    main()
