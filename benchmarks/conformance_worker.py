"""Renders the files that ``conformance.py`` names, one after the other, and reports what became of each.

Time on two cores: as long as its files take, about a second each.
"""

from __future__ import annotations

import json
import os
import sys
import traceback
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture

#: Pixels a side and samples per pixel of the display's picture, and of the camera's.
SIZE, SAMPLES = 48, 4
PICTURE, PICTURE_SAMPLES = 128, 8


def main(reading: int, writing: int, memory: int) -> None:
    display = lippmann.load_display("seed-lenticular")
    display = replace(display, panel=replace(display.panel, width=SIZE, height=SIZE))
    with os.fdopen(reading) as requests, os.fdopen(writing, "w") as reports:
        for line in requests:
            request = json.loads(line)
            with warnings.catch_warnings(record=True) as warned:
                warnings.simplefilter("always")
                report = _render(request, display, memory)
            if warned and report["outcome"] != "fault":
                report |= {"outcome": "fault", "line": f"warning: {warned[0].category.__name__}: {warned[0].message}"}
            print(json.dumps(report), file=reports, flush=True)


def _render(request: dict[str, Any], display: lippmann.Display, memory: int) -> dict[str, Any]:
    try:
        scene = lippmann.load_scene(request["file"], allow_outside=request["allow_outside"])
        image = lippmann.render(
            scene, display, spp=SAMPLES, layers=True, denoise="none", memory=memory, tone_map="none"
        )
        shown = np.isfinite(image.maps["depth"])
        sides = np.ptp(scene.bounds, axis=0)
        light = image.pixels[shown]
        if request["picture"] is not None:
            seen = lippmann.preview(
                scene, size=(PICTURE, PICTURE), spp=PICTURE_SAMPLES, memory=memory, tone_map="none"
            ).pixels
            write_plain_picture(seen, Path(request["picture"]))
        return {
            "outcome": "rendered",
            "shown": round(float(shown.mean()), 4),
            "sides": np.round(sides / sides.max(), 4).tolist(),
            "light": round(float(light.mean()), 5) if light.size else 0.0,
            "finite": bool(np.isfinite(image.pixels).all()),
            "notes": list(scene.notes),
        }
    except lippmann.LippmannError as error:
        line = str(error)
        outcome = "refused" if len(line.splitlines()) == 1 else "fault"
        return {"outcome": outcome, "kind": type(error).__name__, "line": line, "what": error.what, "rule": error.rule}
    except Exception as error:  # noqa: BLE001  # which is what is looked for
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}:{place.lineno}"
        return {"outcome": "fault", "line": f"{type(error).__name__}: {str(error)[:300]} at {where}"}


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
