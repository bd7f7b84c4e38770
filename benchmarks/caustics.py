"""Caustics by photons and by paths: light found, error of pictures of few samples, and time.

Time on two cores: an estimated 10 minutes, most of them for references.

Three bundled scenes on the paper's display (160 rows of pixels), path light. References a and b are two long renderings
with photons and chains, of 256 samples each, that know nothing of each other; the error of a picture p is the mean of
(p - a)(p - b) in codes. Time is that of the processors over their number, photons included. How far the
references agree is told beside.

python benchmarks/caustics.py [--references FOLDER] [--reference-samples N]

FOLDER may be that of equal_error.py, whose references of as many samples are the same.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from equal_error import (
    CORES,
    REFERENCE,
    Judge,
    Picture,
    Stage,
    guided_denoiser,
    light_up,
    once,
    prepare,
    reference_pair,
    trace_paths,
)
from harness import kept, save

SCENES = ("primitives", "small-balls", "gears")
DISPLAY = "lenticular-8"
SAMPLES = (4, 16)


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--references", type=Path)
    words.add_argument("--reference-samples", type=int, default=REFERENCE)
    given = words.parse_args()
    results = {}
    for name in SCENES:
        file = given.references and given.references / f"{DISPLAY}-{name}-{given.reference_samples}.npz"
        results[name] = measure(name, file, given.reference_samples)
        save("caustics", {"reference_spp": 2 * given.reference_samples, "scenes": results})


def measure(name: str, file: Path | None, reference_samples: int) -> dict[str, Any]:
    stage = prepare(name, DISPLAY, "auto")
    found = kept(file, lambda: {"pictures": reference_pair(stage, reference_samples)})
    judge = Judge(stage, found["pictures"])
    rows: list[dict[str, Any]] = []
    for samples in SAMPLES:
        for way in ("paths", "photons"):
            for method in ("full", "pooled"):
                picture(stage, way, method, 2)  # compiles
                seconds, pixels = once(lambda s=samples, w=way, m=method: picture(stage, w, m, s))
                rows.append({"spp": samples, "way": way, "method": method, "seconds": seconds, **judge(pixels)})
                print(name, rows[-1], flush=True)
    _by_paths(stage)
    light = {
        "paths": float(trace_paths(stage, reference_samples, 5).mean()),
        "photons": float(found["pictures"].mean()),
    }
    return {"judge_psnr": judge.own_psnr, "mean_light": light, "rows": rows}


def _by_paths(stage: Stage) -> None:
    """All light by paths."""
    stage.integrator = stage.integrator.lit_by(
        replace(stage.integrator.light, photons=None, photon_passes=None, chains=None)
    )


def picture(stage: Stage, way: str, method: str, samples: int) -> Picture:
    """As the program makes it: halves with photons of their own; pooled by the effort that the samples deserve."""
    from lippmann.rendering.denoise.dual_buffer import DenoisedPicture
    from lippmann.rendering.film.sample_batches import BatchedRender

    denoise = "oidn" if method == "pooled" else "none"
    request = replace(stage.session.request, method=method, denoise=denoise, spp=samples, seed=3)
    light_up(stage, replace(request, caustics="auto" if way == "photons" else "paths"))
    batches = BatchedRender(stage.integrator, stage.source, seed=3, memory=4 << 30, for_denoiser=method == "pooled")
    batches.add(samples)
    if method == "full":
        return batches.picture()
    denoiser = guided_denoiser(stage, "oidn")
    return DenoisedPicture(batches, denoiser, "srgb", CORES, denoiser.coverage).picture()


if __name__ == "__main__":
    main()
