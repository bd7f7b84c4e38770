"""Lens view: points already traced are reprojected into the other micro-images, and missed pixels are traced.

The paper's renderer. ``order="paper"`` goes lens by lens from the left exactly as it does; the default order reaches the
same ends faster (see :mod:`lippmann.render.reuse.schedule`).
"""

from __future__ import annotations
