"""One picture of ``huge.py``, in a process of its own.

Time on two cores: as long as its picture takes, hours at the full size.

Arguments: WIDTH HEIGHT SMALL_WIDTH MEMORY OUTPUT FIGURES METHOD DENOISE.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from pathlib import Path


def main() -> None:
    import lippmann
    from lippmann.display.formats.print_sheet import Print

    width, height, small, memory = (int(word) for word in sys.argv[1:5])
    sheet = Print(lpi=60.0, ppi=720.0, size=(200.0, 130.0)).display()
    # The scene grows with the panel, and so do the distances of the viewer and of where rays begin: both see the same.
    growth = width / small
    display = replace(
        sheet.resized(width, height),
        viewing_distance=sheet.viewing_distance * growth,
        aperture_distance=sheet.aperture_distance * growth,
    )
    scene = lippmann.load_scene("teapot")
    started = time.process_time()
    method, denoise = sys.argv[7:9]
    rendered = lippmann.render_to_file(
        scene,
        Path(sys.argv[5]),
        display,
        method=method,
        denoise=denoise,
        integrator="direct",
        depth=1,
        spp=1,
        memory=memory,
    )
    # Loading and building take as long whatever the size is.
    seconds = {name: rendered.provenance.seconds[name] for name in ("trace", "write")}
    pixels = width * height
    figures = {
        "pixels": pixels,
        "seconds_by_stage": seconds,
        "nanoseconds_per_pixel": sum(seconds.values()) / pixels * 1e9,
        "cpu_nanoseconds_per_pixel": (time.process_time() - started) / pixels * 1e9,
        "rays_per_pixel": sum(rendered.provenance.rays.values()) / pixels,
        "tiles": rendered.tiles,
        "options": dict(rendered.provenance.options),
        "notes": list(rendered.provenance.notes),
    }
    Path(sys.argv[6]).write_text(json.dumps(figures))


if __name__ == "__main__":
    main()
