"""The classic integrator against Tachyon, the program whose light model it is.

The same scene file, from its own camera, 2048 x 2048 and 512 x 512 pixels, one sample each, ray depth 2, two threads,
run in turn. Tachyon's figure is the "Ray Tracing Time" that it prints itself; ours is the time of tracing with warm
kernels, picture on the host. Both leave out reading and building. Targets at 2048 x 2048: 2 times faster on teapot,
room and smallballs, 4 times on gears, 8 times on tree_fcyl; at 512 x 512 slower on none.

``gears`` are all 36 610 triangles of the Standard Procedural Databases' scene, written as a Tachyon file first.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from harness import median_ratio, save, summary
from lippmann.runtime import engine
from lippmann.scene.readers.nff import read_nff
from lippmann.scene.readers.tachyon.reader import read_tachyon
from lippmann.scene.values.whitted_scene import ClassicScene

SCENES = Path(__file__).resolve().parent.parent.parent / "shared" / "scenes"
TARGETS = {"teapot": 2.0, "room": 2.0, "smallballs": 2.0, "gears": 4.0, "tree_fcyl": 8.0}
DEPTH = 2
THREADS = 2
SIZES = {2048: 5, 512: 9}  # pixels a side: runs
WARM_UP = 2


def tachyon_text(scene: ClassicScene) -> str:
    """A scene of triangles as a Tachyon file."""
    camera = scene.camera
    zoom = 1 / (2 * np.tan(np.radians(camera.angle or 45.0) / 2))
    lines = [
        "BEGIN_SCENE RESOLUTION 512 512",
        f"CAMERA ZOOM {zoom:.9g} ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH {DEPTH} CENTER {_row(camera.center)} "
        f"VIEWDIR {_row(camera.view)} UPDIR {_row(camera.up)} END_CAMERA",
        f"BACKGROUND {_row(scene.background.color)}",
    ]
    lines += [f"LIGHT CENTER {_row(lamp.center)} RAD 0.002 COLOR {_row(lamp.color)}" for lamp in scene.lights]
    lines += [
        f"TEXDEF m{number} AMBIENT {m.ambient} DIFFUSE {m.diffuse} SPECULAR {m.specular} OPACITY {m.opacity} "
        f"PHONG PLASTIC {m.phong} PHONG_SIZE {m.phong_size} COLOR {_row(m.color)} TEXFUNC 0"
        for number, m in enumerate(scene.materials)
    ]
    lines += [
        f"TRI V0 {_row(a)} V1 {_row(b)} V2 {_row(c)} m{material}"
        for (a, b, c), material in zip(scene.triangles.positions, scene.triangles.material, strict=True)
    ]
    return "\n".join([*lines, "END_SCENE", ""])


def _row(values: Any) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def tachyon_seconds(path: Path, size: int, out: Path) -> float:
    """What Tachyon says that tracing took."""
    command = ["tachyon", path.name, "-numthreads", str(THREADS), "-res", str(size), str(size)]
    command += ["-raydepth", str(DEPTH), "-aasamples", "0", "-o", str(out), "-format", "TARGA"]
    said = subprocess.run(command, cwd=path.parent, check=True, capture_output=True, text=True).stdout
    found = re.search(r"Ray Tracing Time:\s+([\d.]+) seconds", said)
    assert found, said
    return float(found[1])


def tracer(path: Path, size: int) -> Callable[[], Any]:
    """Our picture of the scene, everything but the tracing done."""
    from lippmann.device.whitted.scene import build_classic
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.film.wavefront_plan import make_plan
    from lippmann.rendering.transport.whitted import WhittedIntegrator
    from lippmann.rendering.transport.whitted_camera import WhittedCameraRays

    scene = read_tachyon(path)
    integrator = WhittedIntegrator(build_classic(scene), DEPTH)
    source = WhittedCameraRays(scene.camera, scene.handedness, size, size)
    plan = make_plan(size, size, 1, memory=2**32)
    return lambda: trace_frame(integrator, source, plan, box_filter=False)


def compare(name: str, path: Path, size: int, runs: int, out: Path) -> dict[str, Any]:
    trace = tracer(path, size)
    ours, theirs = [], []
    for run in range(WARM_UP + runs):
        started = time.perf_counter()
        frame = trace()
        seconds = time.perf_counter() - started
        rival = tachyon_seconds(path, size, out) if run >= WARM_UP else 0.0
        if run >= WARM_UP:
            ours.append(seconds)
            theirs.append(rival)
    rays = frame.rays.primary + frame.rays.shadow + frame.rays.secondary
    result = {
        "scene": name,
        "size": size,
        "seconds": {"lippmann": summary(ours), "tachyon": summary(theirs)},
        "times_faster": median_ratio(theirs, ours),
        "target": TARGETS[name] if size == 2048 else 1.0,
        "megarays_per_second": rays / summary(ours)["median"] / 1e6,
        "rays": {"primary": frame.rays.primary, "shadow": frame.rays.shadow, "secondary": frame.rays.secondary},
    }
    print(f"{name} {size}: {result['times_faster']:.1f} times (target {result['target']})", file=sys.stderr)
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"some of {', '.join(TARGETS)}; without: all")
    chosen = parser.parse_args().scenes or list(TARGETS)
    if not set(chosen) <= set(TARGETS):
        parser.error(f"scenes are {', '.join(TARGETS)}")
    if shutil.which("tachyon") is None or not SCENES.is_dir():
        sys.exit("needs the program tachyon and the folder ../shared/scenes")
    engine.start("cpu", THREADS)
    with tempfile.TemporaryDirectory() as folder:
        gears = Path(folder) / "gears.dat"
        gears.write_text(tachyon_text(read_nff(SCENES / "spd" / "gears.nff")))
        paths = {name: gears if name == "gears" else SCENES / "tachyon" / f"{name}.dat" for name in chosen}
        out = Path(folder) / "out.tga"
        results = [compare(name, path, size, runs, out) for size, runs in SIZES.items() for name, path in paths.items()]
    save("tachyon", {"threads": THREADS, "ray_depth": DEPTH, "results": results})


if __name__ == "__main__":
    main()
