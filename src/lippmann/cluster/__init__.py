"""Tiles of a picture on a Dask cluster: on this machine, on a lab's, or on one that a queue lends.

Dask does the distributing: it starts what it is given where there is room, moves the scene from worker to worker, and
starts anew what died with its worker. Here is only what it cannot know: how a scene travels in parts that are sent
once, which workers may take part, how many tiles may be under way, and when a tile is given up.
"""

from __future__ import annotations

from lippmann.cluster.address import Target, TlsFiles, parse_target
from lippmann.cluster.connection import Cluster, connect

__all__ = ["Cluster", "Target", "TlsFiles", "connect", "parse_target"]
