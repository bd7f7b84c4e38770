"""Rendering of a picture's tiles on a Dask cluster: workers of this machine, of a network, or of a batch queue.

Dask schedules the tasks, moves data between workers and repeats tasks whose worker died. This package defines the rest:
how a scene is split into parts that are sent once, which workers take part, how many tiles are in flight, and when a
tile is given up.
"""

from __future__ import annotations

from lippmann.cluster.address import Target, TlsFiles, parse_target
from lippmann.cluster.connection import Cluster, connect

__all__ = ["Cluster", "Target", "TlsFiles", "connect", "parse_target"]
