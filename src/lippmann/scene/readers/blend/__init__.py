"""Blender files (``.blend``), exported as glTF by the Blender that is installed, and read by the glTF reader.

``find_blender`` finds the program, ``export`` runs it over a file, ``reader`` makes a scene of what it wrote, and
``moving`` a scene that moves. ``in_blender`` runs inside Blender and imports nothing of this package.
"""

from lippmann.scene.readers.blend.reader import read_blend

__all__ = ["read_blend"]
