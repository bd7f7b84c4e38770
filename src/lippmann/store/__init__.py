"""Pictures in the making: tiles on the disk, safe from whatever ends a process, and what tells whether they fit."""

from lippmann.store.fingerprint import content_hash, differences, in_words
from lippmann.store.frames import FrameJournal
from lippmann.store.grid import TileGrid, Window
from lippmann.store.journal import TileStore, journal_of
from lippmann.store.tile_file import DamagedTile, TileResult, decode, encode

__all__ = [
    "DamagedTile",
    "FrameJournal",
    "TileGrid",
    "TileResult",
    "TileStore",
    "Window",
    "content_hash",
    "decode",
    "differences",
    "encode",
    "in_words",
    "journal_of",
]
