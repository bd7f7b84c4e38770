"""A picture in the making: a folder of finished tiles beside the place where the picture will lie.

``poster.tif.parts/`` holds ``job.json`` (what is being made: the fingerprint and the grid of tiles), one file per
finished tile, and an empty file whose lock says that a process is at work. Tiles appear whole or not at all and never
change, so that whatever happens to the process or the machine, what lies under a tile's name is that tile; a copy of
the folder taken at any moment is a journal too. Sizes are looked at when the folder is opened, check sums when a tile
is read: a damaged one is removed and made anew.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from lippmann.atomic import replacing
from lippmann.errors import OutputError, PictureError
from lippmann.store.fingerprint import differences
from lippmann.store.grid import TileGrid
from lippmann.store.lock import locked
from lippmann.store.tile_file import MARK, DamagedTile, TileResult, decode, encode, whole_length

#: Added to the picture's name.
ENDING = ".parts"

_JOB, _LOCK = "job.json", "lock"
_TILE = ".tile"
_KEY, _VERSION = "lippmann-journal", 1
_HALF_FILE = re.compile(r"\..*-[0-9a-f]{8}\.(part|old)(\..*)?")


class TileStore:
    """The tiles of one picture on the disk. Make one with :meth:`open`; it is a context manager.

    ``put`` and ``put_bytes`` may be called from several threads at once.

    Attributes
    ----------
    folder:
        Where the tiles lie.
    grid:
        Which tiles there are.
    resumed:
        How many of them lay there when the folder was opened.
    """

    def __init__(self, folder: Path, grid: TileGrid, lock: IO[bytes]) -> None:
        self.folder = folder
        self.grid = grid
        self._lock = lock
        self.resumed = len(grid) - len(self.missing())

    @classmethod
    def open(cls, output: Path, fingerprint: Mapping[str, str], grid: TileGrid, *, resume: bool) -> TileStore:
        """Begin the journal of ``output``, or with ``resume`` go on with the one that is there.

        Raises
        ------
        OutputError
            If there is a journal and ``resume`` is not asked for, another process works on it, or it cannot be
            written.
        PictureError
            If the journal is of something else; says what differs.
        """
        folder = journal_of(output)
        job = {_KEY: _VERSION, "fingerprint": dict(fingerprint), "grid": [grid.width, grid.height, grid.side]}
        if _holds_tiles(folder):
            if not resume:
                raise OutputError(
                    f"an unfinished picture lies in {folder.name}",
                    where=str(output),
                    fix=f"go on with --resume, or delete {folder}",
                )
            _check_same(folder, job)
        with _reported(folder):
            folder.mkdir(exist_ok=True)
        with _reported(folder):
            lock = locked(folder / _LOCK, folder)
        try:
            _sweep(folder)
            if not _holds_tiles(folder):
                text = json.dumps(job, indent=1, sort_keys=True) + "\n"
                with replacing(folder / _JOB) as temporary:
                    temporary.write_text(text, encoding="utf-8")
            return cls(folder, grid, lock)
        except BaseException:
            lock.close()
            raise

    def missing(self) -> list[int]:
        """The numbers of the tiles that are still to be made."""
        present = {entry.name: entry for entry in os.scandir(self.folder) if entry.name.endswith(_TILE)}
        found = []
        for index in range(len(self.grid)):
            entry = present.get(self.grid.name(index) + _TILE)
            if entry is None or not _is_whole(Path(entry.path), entry.stat().st_size):
                found.append(index)
        return found

    def put(self, result: TileResult) -> None:
        """Keep a tile.

        Raises
        ------
        OutputError
            If it cannot be written; what was there before is unharmed.
        """
        self.put_bytes(result.index, encode(result))

    def put_bytes(self, index: int, data: bytes) -> None:
        """Keep a tile that is :func:`~lippmann.store.tile_file.encode`-d already; raises as :meth:`put`."""
        with replacing(self._path(index)) as temporary:
            temporary.write_bytes(data)

    def get(self, index: int) -> TileResult:
        """A tile, checked.

        Raises
        ------
        DamagedTile
            If it is not there or not whole; it counts as missing then.
        """
        path = self._path(index)
        try:
            result = decode(path.read_bytes())
            if result.index != index or result.pixels.shape[:2] != self.grid[index].shape:
                raise DamagedTile("it is another tile")
        except FileNotFoundError:
            raise DamagedTile("it is not there") from None
        except DamagedTile:
            path.unlink(missing_ok=True)
            raise
        return result

    def results(self) -> Iterator[TileResult]:
        """All tiles in order; raises as :meth:`get`."""
        return (self.get(index) for index in range(len(self.grid)))

    def finish(self) -> None:
        """Remove the journal: the picture is in its place."""
        # Under another name first: a journal half removed would look like one half made.
        old = self.folder.with_name(f".{self.folder.name}-{os.urandom(4).hex()}.old")
        with _reported(self.folder):
            os.rename(self.folder, old)
        shutil.rmtree(old, ignore_errors=True)
        self.close()

    def close(self) -> None:
        """Let others at the journal."""
        self._lock.close()

    def __enter__(self) -> TileStore:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None and not _holds_tiles(self.folder):
            # What failed before its first tile leaves nothing behind.
            for name in (_JOB, _LOCK):
                (self.folder / name).unlink(missing_ok=True)
            with suppress(OSError):
                self.folder.rmdir()
        self.close()

    def _path(self, index: int) -> Path:
        return self.folder / (self.grid.name(index) + _TILE)


def journal_of(output: Path) -> Path:
    """The folder in which the tiles of a picture are kept until it is finished."""
    place = output.resolve()
    return place.with_name(place.name + ENDING)


def read_job(output: Path) -> dict[str, Any] | None:
    """What the journal of ``output`` says it is of; None if there is no journal.

    Raises
    ------
    PictureError
        If the folder is no journal of ours, or one of a later version.
    """
    folder = journal_of(output)
    if not _holds_tiles(folder):
        return None
    path = folder / _JOB
    try:
        job = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise _no_journal(folder, "it has no readable job.json") from error
    if not isinstance(job, dict):
        raise _no_journal(folder, "its job.json is none of ours")
    fingerprint = job.get("fingerprint")
    if not isinstance(fingerprint, dict) or not all(isinstance(value, str) for value in fingerprint.values()):
        raise _no_journal(folder, "its job.json is none of ours")
    if job.get(_KEY) != _VERSION:
        raise _no_journal(folder, f"its version is {job.get(_KEY)!r}, this program writes {_VERSION}")
    return job


def sweep_beside(output: Path) -> None:
    """Remove what a writer of ``output`` left half done when it was killed; only while its journal is locked."""
    place = output.resolve()
    # The names that lippmann.atomic and TileStore.finish give to what is on its way.
    file, folder = f"{place.stem[:64]}-NUMBER.part{place.suffix}", f"{place.name[:64]}-NUMBER."
    journal = f"{place.name}{ENDING}-NUMBER.old"
    names = [re.escape(name).replace("NUMBER", "[0-9a-f]{8}") for name in (file, folder, journal)]
    mine = re.compile(rf"\.({names[0]}|{names[1]}(part|old)|{names[2]})")
    for path in place.parent.iterdir():
        if mine.fullmatch(path.name):
            _remove(path)


def _check_same(folder: Path, job: Mapping[str, Any]) -> None:
    before = read_job(folder.with_name(folder.name.removesuffix(ENDING)))
    assert before is not None
    found = differences(before["fingerprint"], job["fingerprint"])
    if not found and before.get("grid") != job["grid"]:
        found = [f"the grid of tiles (was {before.get('grid')}, is {job['grid']})"]
    if found:
        raise PictureError(
            f"the unfinished picture is another one: {', '.join(found)}",
            where=str(folder),
            rule="what was begun is finished as it was begun",
            fix=f"put that back as it was, or delete {folder.name} and begin anew",
        )


def _no_journal(folder: Path, why: str) -> PictureError:
    return PictureError(f"this is no journal of an unfinished picture: {why}", where=str(folder), fix="delete it")


def _holds_tiles(folder: Path) -> bool:
    """Whether there is a journal with anything in it to lose."""
    try:
        return any(name.endswith(_TILE) and not name.startswith(".") for name in os.listdir(folder))
    except FileNotFoundError:
        return False
    except OSError as error:
        raise OutputError(f"cannot be read: {error.strerror}", where=str(folder), fix="delete it") from error


def _is_whole(path: Path, size: int) -> bool:
    """Whether a tile's file is as long as it says itself: an interrupted copy or a crashed disk cuts files off."""
    try:
        with path.open("rb") as file:
            return whole_length(file.read(len(MARK) + 12)) == size
    except OSError:
        return False


def _sweep(folder: Path) -> None:
    """Remove half-written files; only the owner of the lock may."""
    for entry in os.scandir(folder):
        if _HALF_FILE.fullmatch(entry.name):
            _remove(Path(entry.path))


def _remove(path: Path) -> None:
    with suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()


class _reported:  # noqa: N801 - reads as a statement
    """Turn an :class:`OSError` about the journal into an :class:`OutputError`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, OSError):
            reason = error.strerror or str(error)
            raise OutputError(f"cannot be written: {reason}", where=str(self._folder)) from error
