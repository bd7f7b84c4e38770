"""Values that the 2014 paper prints, as far as this project knows them. Nothing here is measured."""

from __future__ import annotations

#: The display of its experiments (Table I), which the preset of this name describes, and its ray depth.
DISPLAY = "seed-lenticular"
RAY_DEPTH = 2

#: Table I, line by line.
TABLE_I = (
    ("Pixels", "512 x 512 at 96 dpi"),
    ("Lenses", "64 cylindrical, of 8 pixels"),
    ("Lens pitch", "2.116667 mm"),
    ("Gap", "6.8 mm"),
    ("Field of view", "17.7 degrees"),
    ("Rays begin in front of the lens plane by", "10 mm"),
    ("Viewing distance", "infinite"),
    ("Ray depth", "2"),
)

#: Table II: the range over its scenes of the seconds of full tracing, and of the share saved by the interpolation in %.
FULL_SECONDS = (2, 14)
SAVED_PERCENT = (57, 66)

#: Table II, the row of the tree: the share that it prints, and what its own seconds come to.
TREE = "tree"
TREE_PRINTED_PERCENT = 66
TREE_COMPUTED_PERCENT = 69.9

#: Table III: the teapot's PSNR in dB, averaged over so many lenses.
TEAPOT = "teapot"
TEAPOT_PSNR = 37.67
TEAPOT_LENSES = 8
