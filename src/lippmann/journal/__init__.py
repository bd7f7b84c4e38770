"""Journals of unfinished pictures and sequences: finished tiles and frames on disk, for resuming after a crash."""

from lippmann.display.panel import TileGrid
from lippmann.journal.fingerprint import content_hash, differences, in_words
from lippmann.journal.frame_journal import FrameJournal
from lippmann.journal.tile_file import DamagedTile, TileResult, decode, encode
from lippmann.journal.tile_journal import TileStore, journal_of

__all__ = [
    "DamagedTile",
    "FrameJournal",
    "TileGrid",
    "TileResult",
    "TileStore",
    "content_hash",
    "decode",
    "differences",
    "encode",
    "in_words",
    "journal_of",
]
