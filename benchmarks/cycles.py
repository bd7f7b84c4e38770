"""A quilt and a native frame against the way it is done today: Blender's Cycles, view by view, with its denoiser.

Time on two cores: about half an hour, most of it for references.

The glTF teapot in the studio light that Lippmann gives to scenes without any, for a nominal Looking Glass Portrait:
48 views of 420 x 560 pixels by Cycles at 16 samples with Open Image Denoise, against Lippmann's quilt of the same size
and its native frame of 1536 x 2048 x 3 sub-pixels, two threads each. Every picture is judged by a long rendering of its
own program, the quilts on two views, the frame on every 64th row: PSNR of sRGB-coded values in [0, 1]. Lippmann
denoises, too, with light shared between views and micro-images (``--method pooled``), and is tried with ever more
samples until it reaches Cycles' PSNR; that is what counts.

Seconds are those of rendering and denoising all views or the whole frame, after a warm-up: Cycles' are its own
``render`` calls with the scene kept between views, Lippmann's are the whole call, building the scene included. With
``--sampled`` only the judged views are rendered by Cycles, and their mean time stands for all. Beside the clock stands
the processor time of all threads, which other work on the machine stretches far less. ``--keep`` names a folder for
Cycles' long renderings, which take most of the time: those of the same job that lie there are taken from it.

python benchmarks/cycles.py --python PYTHON [--small] [--sampled] [--scale FACTOR] [--keep FOLDER]

``PYTHON`` is an interpreter with the package ``bpy`` (``pip install bpy``), which wants a Python version of its own.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness import save

Picture = NDArray[np.float32]

SCENE = Path(__file__).resolve().parents[2] / "shared" / "scenes" / "gltf" / "fancy_teapot" / "scene.gltf"
DEVICE = "looking-glass-portrait"
COLUMNS, ROWS = 8, 6
THREADS, DEPTH = 2, 8
CYCLES_SPP = 16
QUILT_SAMPLES, NATIVE_SAMPLES = (8, 12, 16, 24, 32), (4, 8, 12, 16, 24)
METHOD, DENOISER = "pooled", "oidn-fast"
#: Views that are judged, one far aside and one near the middle; references of all would take hours.
JUDGED = (3, 27)
TARGET = 10.0


@dataclass(frozen=True)
class Size:
    """Sizes of one comparison."""

    view: tuple[int, int]
    panel: tuple[int, int]
    reference_spp: int


FULL = Size((420, 560), (1536, 2048), 768)
SMALL = Size((105, 140), (384, 512), 128)
#: The rows of the frame that are judged: every 64th.
JUDGED_ROWS = slice(32, None, 64)


@dataclass(frozen=True)
class Stage:
    """The scene before the device."""

    scene: Any
    display: Any
    options: Any
    placement: Any


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--python", required=True, help="an interpreter with bpy")
    words.add_argument("--small", action="store_true", help="a quarter of every side: shows that everything works")
    words.add_argument("--sampled", action="store_true", help="only the judged views by Cycles, and their mean time")
    words.add_argument("--scale", type=float, default=1.0, help="of the teapot; 1 fits it as Lippmann does by itself")
    words.add_argument("--keep", type=Path, help="a folder for Cycles' long renderings")
    given = words.parse_args()
    size = SMALL if given.small else FULL
    stage = _stage(size, given.scale)
    views = JUDGED if given.sampled or given.small else tuple(range(COLUMNS * ROWS))
    with tempfile.TemporaryDirectory() as folder:
        keep = given.keep or Path(folder) / "kept"
        keep.mkdir(exist_ok=True)
        rival = _cycles(stage, size, Path(folder), given.python, views, keep)
    print(json.dumps({"cycles": rival}), flush=True)
    ours = {
        "quilt": _best(_quilt_tries(stage, size), QUILT_SAMPLES, rival["psnr"]),
        "native": _best(_native_tries(stage, size), NATIVE_SAMPLES, rival["psnr"]),
    }
    result = {
        "scene": "glTF teapot",
        "device": DEVICE,
        "view": size.view,
        "panel": size.panel,
        "views_timed": len(views),
        "scale": given.scale,
        "reference_spp": size.reference_spp,
        "target": TARGET,
        "cycles": rival,
        **ours,
        "times_faster": {
            name: rival["seconds"] / found["chosen"]["seconds"] for name, found in ours.items() if found["chosen"]
        },
        # Of processor time, which other work on the machine does not stretch.
        "times_less_cpu": {
            name: rival["cpu_seconds"] / found["chosen"]["cpu_seconds"]
            for name, found in ours.items()
            if found["chosen"]
        },
    }
    if given.small:
        print(json.dumps(result, indent=2))
    else:
        save("cycles", result)


def _stage(size: Size, scale: float) -> Stage:
    import lippmann
    from lippmann.options.placement import PlacementOptions
    from lippmann.runtime import engine
    from lippmann.scene.placement import place

    engine.start("cpu", THREADS)
    display = lippmann.load_display(DEVICE)
    # The same panel with fewer, larger pixels behind the same lenses would be another display: a cut of it is not.
    display = display.resized(*size.panel)
    scene = lippmann.load_scene(SCENE)
    options = PlacementOptions(scale=scale)
    at = place(scene.bounds, display, cameras=scene.cameras, options=options, bounds_in=scene.bounds_in)
    return Stage(scene, display, options, at)


# ---- Cycles ----------------------------------------------------------------------------------------------------------


def _cycles(stage: Stage, size: Size, folder: Path, python: str, views: tuple[int, ...], keep: Path) -> dict[str, Any]:
    """Seconds of all views and PSNR of the judged ones."""
    from lippmann.image.write import write_plain_picture
    from lippmann.scene.studio_light import studio

    write_plain_picture(studio().pixels, folder / "studio.exr", bits=32)
    job = _job(stage, size, folder)
    # The first view of a run pays for the scene's loading.
    timed = _run(job | {"views": [views[0], *views], "spp": CYCLES_SPP, "denoise": True, "seed": 1}, folder, python)
    seconds = timed["views"][1:]
    shown = _views(folder)
    plain = _run(job | {"views": [views[0], *JUDGED], "spp": CYCLES_SPP, "denoise": False, "seed": 1}, folder, python)
    noisy = _views(folder)
    reference = _references(job | {"spp": size.reference_spp, "denoise": False, "seed": 2}, folder, python, keep)
    return {
        "blender": timed["blender"],
        "spp": CYCLES_SPP,
        "seconds_per_view": statistics.mean(seconds),
        "seconds_per_view_without_denoising": statistics.mean(plain["views"][1:]),
        "seconds": statistics.mean(seconds) * COLUMNS * ROWS,
        "cpu_seconds": statistics.mean(timed["cpu_views"][1:]) * COLUMNS * ROWS,
        "psnr": _psnr(shown, reference),
        "psnr_without_denoising": _psnr(noisy, reference),
    }


def _job(stage: Stage, size: Size, folder: Path) -> dict[str, Any]:
    """What ``cycles_views.py`` is told: cameras as those of
    :class:`lippmann.rendering.transport.ray_source.QuiltRays`."""
    from lippmann.display.view_cone import cone_tangent
    from lippmann.scene.studio_light import BACKDROP

    display, matrix = stage.display, stage.placement.world_from_display
    distance, (_, height) = display.viewing_distance, display.size_mm
    unit = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
    cameras = []
    for number in range(COLUMNS * ROWS):
        x = distance * cone_tangent(display) * (2 * (number + 0.5) / (COLUMNS * ROWS) - 1)
        pose = np.eye(4)
        pose[:3, :3] = matrix[:3, :3] / unit
        pose[:3, 3] = (matrix @ np.array([x, 0.0, distance, 1.0]))[:3]
        cameras.append({"world_from_camera": pose.tolist(), "shift": -x / height})
    return {
        "folder": str(folder),
        "scene": str(SCENE),
        "environment": str(folder / "studio.exr"),
        "background": BACKDROP,
        "cameras": cameras,
        "size": size.view,
        "field": 2 * math.atan(height / 2 / distance),
        "clip": [unit * (distance - display.aperture_distance), unit * 10 * distance],
        "threads": THREADS,
        "depth": DEPTH,
        "adaptive": False,
    }


def _run(job: dict[str, Any], folder: Path, python: str) -> dict[str, Any]:
    path = folder / "job.json"
    path.write_text(json.dumps(job))
    # -P: this folder holds a module of the name of Blender's add-on.
    command = [python, "-P", str(Path(__file__).with_name("cycles_views.py")), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"Blender failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    found: dict[str, Any] = json.loads((folder / "seconds.json").read_text())
    return found


def _references(job: dict[str, Any], folder: Path, python: str, keep: Path) -> Picture:
    """Cycles' long renderings of the judged views, from the folder where they are kept if they are there."""
    said = {name: value for name, value in job.items() if name not in ("folder", "environment")}
    stamp = hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:12]
    for number in JUDGED:
        kept = keep / f"{stamp}_view_{number:02}.exr"
        if not kept.exists():
            _run(job | {"views": [number]}, folder, python)
            shutil.copy(folder / f"view_{number:02}.exr", kept)
        shutil.copy(kept, folder / f"view_{number:02}.exr")
    return _views(folder)


def _views(folder: Path) -> Picture:
    """``(N, H, W, 3)`` judged views."""
    from lippmann.image import open_file

    return np.stack([open_file(folder / f"view_{number:02}.exr").decode()[0] for number in JUDGED])


# ---- Lippmann --------------------------------------------------------------------------------------------------------

#: Samples, seconds and what is judged of one try after the other.
Tries = tuple[Picture, Callable[[int], Picture]]


def _quilt_tries(stage: Stage, size: Size) -> Tries:
    import lippmann

    width, height = size.view

    def views(samples: int) -> Picture:
        quilt = lippmann.render_quilt(
            stage.scene,
            stage.display,
            views=(COLUMNS, ROWS),
            size=(COLUMNS * width, ROWS * height),
            placement=stage.options,
            method=METHOD,
            tone_map="none",
            spp=samples,
            depth=DEPTH,
            seed=1,
            denoise=DENOISER,
            device="cpu",
            threads=THREADS,
        )
        return np.stack([quilt.view(number) for number in JUDGED])

    return _reference_views(stage, size), views


def _reference_views(stage: Stage, size: Size) -> Picture:
    """The judged views, one by one, without what a whole quilt's pixels would take."""
    from lippmann.rendering.transport.ray_source import QuiltRays

    source = QuiltRays(stage.display, stage.placement.world_from_display, COLUMNS, ROWS, size.view)
    width, height = size.view
    tiles = list(source.tiles())
    parts = [_Cut(source, tiles[n][1].start, tiles[n][0].start, width, height) for n in JUDGED]
    return np.stack([_traced(stage, part, size.reference_spp) for part in parts])


def _native_tries(stage: Stage, size: Size) -> Tries:
    import lippmann
    from lippmann.rendering.transport.ray_source import DisplayRays

    def rows(samples: int) -> Picture:
        image = lippmann.render(
            stage.scene,
            stage.display,
            method=METHOD,
            tone_map="none",
            subpixels=True,
            placement=stage.options,
            spp=samples,
            depth=DEPTH,
            seed=1,
            denoise=DENOISER,
            device="cpu",
            threads=THREADS,
        )
        return image.pixels[JUDGED_ROWS]

    source = DisplayRays(stage.display, stage.placement.world_from_display, subpixels=True)
    first, _, step = JUDGED_ROWS.indices(source.height)
    cut = _Cut(source, 0, first, source.width, len(range(first, source.height, step)), step)
    return _traced(stage, cut, size.reference_spp), rows


class _Cut:
    """A rectangle of another source's pixels, or every so many rows of it."""

    def __init__(self, source: Any, left: int, top: int, width: int, height: int, step: int = 1) -> None:
        self._source, self._left, self._top, self._step = source, left, top, step
        self.width, self.height, self.channels = width, height, source.channels

    def rays(self, column: Any, row: Any, channel: Any, jitter: Any) -> Any:
        return self._source.rays(column + self._left, row * self._step + self._top, channel, jitter)

    def number(self, column: Any, row: Any) -> Any:
        return row * self.width + column


def _traced(stage: Stage, source: Any, samples: int) -> Picture:
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.session import open_session

    session = open_session(stage.scene, RenderRequest(integrator="path", depth=DEPTH))
    integrator = session.integrator(source, stage.placement.display_from_world)
    plan = cut_wavefronts(source.width, source.height, samples, channels=source.channels, memory=2 << 30)
    return trace_frame(integrator, source, plan, seed=2).pixels


def _best(tries: Tries, counts: tuple[int, ...], psnr: float) -> dict[str, Any]:
    """All tries, of ever more samples until one reaches the PSNR, which is the one to count."""
    reference, rendered = tries
    found: list[dict[str, Any]] = []
    rendered(counts[0])  # compiles what all of them run
    for samples in counts:
        started, used = time.perf_counter(), time.process_time()
        picture = rendered(samples)
        one: dict[str, Any] = {
            "spp": samples,
            "method": METHOD,
            "denoise": DENOISER,
            "seconds": time.perf_counter() - started,
            "cpu_seconds": time.process_time() - used,
            "psnr": _psnr(picture, reference),
        }
        print(json.dumps(one), flush=True)
        found.append(one)
        if one["psnr"] >= psnr:
            break
    return {"tries": found, "chosen": found[-1] if found[-1]["psnr"] >= psnr else None}


def _psnr(picture: Picture, reference: Picture) -> float:
    from lippmann.color.transfer import encode_srgb

    first, second = (encode_srgb(np.clip(values, 0, 1).astype(np.float64)) for values in (picture, reference))
    return -10 * math.log10(float(np.square(first - second).mean()))


if __name__ == "__main__":
    main()
