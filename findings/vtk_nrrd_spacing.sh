#!/usr/bin/env bash
# VTK's reader of NRRD volumes: the sizes of voxels are given to the wrong axes, and the last one is lost.
#
# Versions: vtk 9.7.2 and simpleitk 2.5.7 (PyPI), Python 3.
# Believed: vtkNrrdReader takes the size of a voxel from "spacings" or from the lengths of the "space directions", axis
#   by axis, as it does the sizes.
# What happens: each axis gets the number of the next one and the third gets 1. A volume of voxels of 2 x 5 x 7 mm has
#   the spacing (5, 7, 1), whether "spacings" or "space directions" say so, and in files that ITK has written, too. The
#   origin is right.
# Who is hurt: whoever opens a CT or MR series from ITK or 3D Slicer with VTK or PyVista: of slices 5 mm apart with
#   pixels of 0.7 mm the body is 5 times too thin, pulled in one direction, and every length measured in it is wrong;
#   nothing is reported. Volumes of cubes of 1 mm hide it. SimpleITK reads the same files rightly.
# Seen: "spacings: (5.0, 7.0, 1.0)", "space directions: (5.0, 7.0, 1.0)", "ITK: (5.0, 7.0, 1.0), ITK reads (2.0, 5.0, 7.0)"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check vtk==9.7.2 simpleitk==2.5.7
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import SimpleITK
import vtk


def read(name):
    reader = vtk.vtkNrrdReader()
    reader.SetFileName(name)
    reader.Update()
    return reader.GetOutput().GetSpacing()


def write(name, line):
    header = f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n{line}\n\n"
    open(name, "wb").write(header.encode() + bytes(24))
    return name


plain = read(write("plain.nrrd", "spacings: 2 5 7"))
print("spacings:", plain)
directions = "space dimension: 3\nspace directions: (2,0,0) (0,5,0) (0,0,7)\nspace origin: (0,0,0)"
directed = read(write("directed.nrrd", directions))
print("space directions:", directed)
image = SimpleITK.Image(4, 3, 2, SimpleITK.sitkUInt8)
image.SetSpacing((2, 5, 7))
SimpleITK.WriteImage(image, "itk.nrrd")
written, right = read("itk.nrrd"), SimpleITK.ReadImage("itk.nrrd").GetSpacing()
print(f"ITK: {written}, ITK reads {right}")
sys.exit(0 if plain == directed == written == (5, 7, 1) and right == (2, 5, 7) else 1)
PYTHON
