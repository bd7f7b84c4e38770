#!/usr/bin/env bash
# Mitsuba 3: a principal point to the right of the film's centre and below it has a negative offset in both directions.
#
# Versions: mitsuba 3.9.1, numpy 2.3.5 (PyPI), Python 3.
# Believed: principal_point_offset_x and _y of a perspective sensor, "the position of the camera's principal point
#   relative to the center of the film", are (cx / W - 0.5) and (cy / H - 0.5) of a calibrated camera: with 0.2 and
#   0.1 on a film of 100 x 60 pixels, whatever lies straight ahead of the camera appears at (70, 36).
# What happens: it appears at (30, 24). Both offsets count against the axes of the picture, so the view looks through
#   the window on the opposite side. Blender's shift_x has the same sign as Mitsuba's, shift_y the opposite one.
# Who is hurt: whoever renders quilts or multi-view films with shifted sensors, or fits a render to a photograph by a
#   calibration matrix: the plane of no parallax moves behind the cameras, depth is wrong by twice the shift, and no
#   view alone looks wrong. Symmetric cameras hide it.
# Seen: "no offset: (50, 30); 0.2 and 0.1: (30, 24)"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.3.5
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")


def place(x, y):
    """Pixel at which a small luminous ball straight ahead of the camera appears, from the upper left corner."""
    ball = {"type": "sphere", "radius": 0.1, "emitter": {"type": "area", "radiance": 1.0}}
    film = {"type": "hdrfilm", "width": 100, "height": 60, "rfilter": {"type": "box"}, "pixel_format": "luminance"}
    sensor = {"type": "perspective", "fov": 40, "film": film, "sampler": {"type": "independent", "sample_count": 16}}
    sensor["to_world"] = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    sensor |= {"principal_point_offset_x": x, "principal_point_offset_y": y}
    scene = mi.load_dict({"type": "scene", "integrator": {"type": "direct"}, "ball": ball, "sensor": sensor})
    light = np.array(mi.render(scene))[..., 0]
    rows, columns = np.indices(light.shape) + 0.5
    return round((columns * light).sum() / light.sum()), round((rows * light).sum() / light.sum())


centred, shifted = place(0, 0), place(0.2, 0.1)
print(f"no offset: {centred}; 0.2 and 0.1: {shifted}")
sys.exit(0 if centred == (50, 30) and shifted == (30, 24) else 1)
PYTHON
