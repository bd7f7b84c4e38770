#!/usr/bin/env bash
# PyVista: Plotter.export_gltf turns the shapes upright, but not the camera, which then looks past them.
#
# Versions: pyvista 0.49.1, vtk 9.7.2, numpy 2, Python 3.
# Believed: a plotter's glTF file, opened by the camera that it holds, shows what the plotter shows.
# What happens: with the default rotate_scene=True each actor is turned, from z up to y up (x, y, z become z, x, y); the
#   camera is written as it stood before. Here a ball at (0, 0, 5), on the axis of the camera, goes to (0, 5, 0): 26.6
#   degrees off that axis, outside of the picture.
# Who is hurt: whoever opens such a file in a program that begins with the file's camera: the shapes are cut off, lie
#   on their side or are not seen. export_gltf(..., rotate_scene=False) keeps camera and shapes together, z up.
# Seen: "off the axis: turned 26.6 degrees, not turned 0.0; half of the field 15.0"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyvista==0.49.1 vtk==9.7.2
cd "$folder"
"$folder/venv/bin/python" - 2>"$folder/warnings" <<'PYTHON'
import json
import sys

import numpy as np
import pyvista
import vtk


def angle_off_axis(rotate):
    plotter = pyvista.Plotter(off_screen=True)
    plotter.add_mesh(pyvista.Sphere(center=(0, 0, 5)))
    plotter.camera_position = [(0, -5, 5), (0, 0, 5), (0, 0, 1)]
    plotter.export_gltf("ball.gltf", rotate_scene=rotate)
    file = json.load(open("ball.gltf"))
    matrices = {"camera" in node: np.reshape(node["matrix"], (4, 4)).T for node in file["nodes"] if "matrix" in node}
    ball = matrices.get(False, np.eye(4)) @ (0, 0, 5, 1)  # no matrix is the identity
    x, y, z, _ = np.linalg.inv(matrices[True]) @ ball
    return np.degrees(np.arctan2(np.hypot(x, y), -z)), np.degrees(file["cameras"][0]["perspective"]["yfov"]) / 2


(turned, field), (plain, _) = angle_off_axis(True), angle_off_axis(False)
print("pyvista", pyvista.__version__, "vtk", vtk.vtkVersion().GetVTKVersion())
print(f"off the axis: turned {turned:.1f} degrees, not turned {plain:.1f}; half of the field {field:.1f}")
sys.exit(not (turned > field and plain < 0.1))
PYTHON
