#!/usr/bin/env bash
# VTK: after triangulate(), cell arrays of a surface that also has points or lines are too long and uninitialised.
#
# Versions: vtk 9.7.2, pyvista 0.49.1, Python 3 (vtk 9.5.2 with pyvista 0.46.3 does the same, without a warning).
# Believed: PolyData.triangulate() (vtkTriangleFilter without points, PyVista's default) gives each cell that remains
#   the cell data of the one that it is cut from.
# What happens: of a PolyData with one point, one line and two triangles, three cells remain, and the cell array has
#   five values: three that nobody wrote, then those of the triangles. PyVista warns that the mesh is not valid.
#   The tracker knows of the case of lines alone (pyvista 8897, open).
# Who is hurt: whoever colours triangles by cell data of a file with lines beside its faces (outlines, CAD edges,
#   contours): colours belong to other cells, or to none.
# Seen: "3 cells, 5 values: [0.0, 0.0, 0.0, 1.0, 2.0]"; in a longer program "[6.9e-310, 6.9e-310, 6.9e-310, 1.0, 2.0]".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check vtk==9.7.2 pyvista==0.49.1
"$folder/venv/bin/python" - <<'PYTHON'
import sys
import warnings

import numpy as np
import pyvista

warnings.simplefilter("ignore")
corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (2, 2, 0)], float)
both = pyvista.PolyData(corners, faces=[3, 0, 1, 2, 3, 1, 3, 2], lines=[2, 3, 4], verts=[1, 4])
both.cell_data["heat"] = np.array([9.0, 8.0, 1.0, 2.0])
cut = both.triangulate()
print(f"{cut.n_cells} cells, {len(cut.cell_data['heat'])} values: {np.asarray(cut.cell_data['heat']).tolist()}")
sys.exit(0 if (cut.n_cells, len(cut.cell_data["heat"])) == (3, 5) else 1)
PYTHON
