#!/usr/bin/env bash
# VTK: vtkOBJExporter counts normals by points, so that a mesh without normals shifts the normals of all that follow.
#
# Versions: vtk 9.7.2, Python 3.
# Believed: in an OBJ file of several actors, which PyVista's export_obj writes too, "f v//n" names the n-th "vn" line.
# What happens: after an actor whose points have no normals (here a cone of 7 points), the indices of the next one's
#   normals (a sphere of 842) begin at 8, as those of its points do, though its first normal is the file's first. The
#   last seven normals named are not in the file.
# Who is hurt: whoever exports a scene in which only some meshes have normals: readers that check indices refuse the
#   file, others shade the later meshes by the normals of other points, without a word.
# Seen: "points 849, normals 842, normals named 8 to 849"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check vtk==9.7.2
cd "$folder"
"$folder/venv/bin/python" - 2>"$folder/warnings" <<'PYTHON'
import sys

import vtk

renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.AddRenderer(renderer)
sphere = vtk.vtkSphereSource()
sphere.SetThetaResolution(30)
sphere.SetPhiResolution(30)
for source in (vtk.vtkConeSource(), sphere):
    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputConnection(source.GetOutputPort())
    actor.SetMapper(mapper)
    renderer.AddActor(actor)
exporter = vtk.vtkOBJExporter()
exporter.SetRenderWindow(window)
exporter.SetFilePrefix("scene")
exporter.Write()

lines = open("scene.obj").read().splitlines()
points, normals = (sum(line.startswith(word) for line in lines) for word in ("v ", "vn "))
corners = [corner.split("/") for line in lines if line.startswith("f ") for corner in line.split()[1:]]
named = [int(corner[2]) for corner in corners if len(corner) == 3 and corner[2]]
print("vtk", vtk.vtkVersion().GetVTKVersion())
print(f"points {points}, normals {normals}, normals named {min(named)} to {max(named)}")
sys.exit(not (normals < max(named) == points))
PYTHON
