"""USD stages (``.usd``, ``.usda``, ``.usdc``, ``.usdz``) into plain scene values, by the library ``usd-core``.

The library is native code: it opens stages in a process of its own. ``stage_child`` and the other ``stage_`` modules
run there, and pack what a stage holds (``records``); ``process`` asks them. ``reader`` makes a scene of the records:
``subdivision`` refines cages, ``meshes`` makes triangles, ``materials`` reads ``UsdPreviewSurface``, ``lights`` makes
light sources and glowing surfaces.
"""

from lippmann.scene.readers.usd.reader import read_usd

__all__ = ["read_usd"]
