"""Journal of a picture: a folder of finished tiles beside the picture's file.

``poster.tif.parts/`` holds ``job.json`` (the fingerprint of the picture and the grid of tiles), one file per finished
tile, and an empty lock file. A tile's file appears whole or not at all and never changes, so a copy of the folder taken
at any moment is a journal too. Sizes are checked when the folder is opened, check sums when a tile is read; a damaged
tile is removed and rendered again.

A folder of that name that is no journal, or a link, is refused; links in the places of its files are not followed.
Files that are no part of a journal stay.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import IO, NamedTuple

from lippmann.display.panel import TileGrid
from lippmann.errors import OutputError, PictureError
from lippmann.journal.file_lock import take_lock
from lippmann.journal.fingerprint import differences
from lippmann.journal.journal_folder import JOB, LOCK, TILE, clear, foreign_names, holds_tiles, is_tile, no_tile, sweep
from lippmann.journal.tile_file import MARK, DamagedTile, TileResult, decode, encode, whole_length
from lippmann.runtime.atomic_write import Unfinished, pattern_of, remark, remove, replacing, undone

#: Added to the picture's name.
ENDING = ".parts"
#: Bytes of a name on all usual file systems.
_LONGEST_NAME = 255

_KEY, _VERSION = "lippmann-journal", 1
#: Largest job in bytes; a job has some kilobytes.
_MOST_JOB = 1 << 24
#: Largest tile in bytes: a constant, and an amount per pixel; pixels, maps and sums take some 200.
_MOST_BYTES, _MOST_PER_PIXEL = 1 << 20, 1 << 10


class Job(NamedTuple):
    """A journal's job: the fingerprint of the picture, and its grid of tiles as [width, height, side].

    The grid comes from a file, unchecked.
    """

    fingerprint: Mapping[str, str]
    grid: object


class TileStore:
    """Tiles of one picture on disk; made by :meth:`open`, and a context manager.

    ``put`` and ``put_bytes`` may be called from several threads at once.

    Attributes
    ----------
    folder:
        The journal's folder.
    grid:
        The grid of tiles.
    resumed:
        Number of tiles that were finished when the folder was opened.
    """

    def __init__(self, folder: Path, grid: TileGrid, lock: IO[bytes], begun: Unfinished) -> None:
        self.folder = folder
        self.grid = grid
        self._lock = lock
        self._begun = begun
        self.resumed = len(grid) - len(self.missing())

    @classmethod
    def open(cls, output: Path, fingerprint: Mapping[str, str], grid: TileGrid, *, resume: bool) -> TileStore:
        """Open and lock the journal of a picture.

        Parameters
        ----------
        output:
            The picture's file.
        fingerprint:
            Settings of the picture by name, see :mod:`lippmann.journal.fingerprint`.
        grid:
            The grid of tiles.
        resume:
            Whether to go on with an existing journal; without one a new journal is begun.

        Raises
        ------
        OutputError
            If there is a journal and ``resume`` is False, another process works on it, or it cannot be written.
        PictureError
            If the journal is of another picture (names the differences), or the folder is no journal.
        """
        folder = journal_of(output)
        _check_name(output, folder)
        job = Job(dict(fingerprint), [grid.width, grid.height, grid.side])
        _is_begun(output, folder, job, resume)  # refuses before anything is created
        begun = Unfinished(lambda: _remove_without_tiles(folder))
        with ExitStack() as stack:
            stack.callback(begun.undo)
            with _report_errors(folder):
                folder.mkdir(exist_ok=True)
            if (folder / LOCK).is_symlink():
                raise _no_journal(folder, "its lock is a symbolic link")
            with _report_errors(folder):
                lock = stack.enter_context(take_lock(folder / LOCK, folder))
                sweep(folder)
            if not _is_begun(output, folder, job, resume):  # again: another process may have begun and ended meanwhile
                text = json.dumps({_KEY: _VERSION, **job._asdict()}, indent=1, sort_keys=True) + "\n"
                _write(folder / JOB, text.encode())
            store = cls(folder, grid, lock, begun)
            stack.pop_all()
            return store

    def missing(self) -> list[int]:
        """Numbers of the unfinished tiles."""
        present = set(os.listdir(self.folder))
        return [
            index
            for index in range(len(self.grid))
            if self._name(index) not in present or not _is_whole(self._path(index), self._most_bytes(index))
        ]

    def put(self, result: TileResult) -> None:
        """Write a finished tile.

        Raises
        ------
        OutputError
            If it cannot be written; an earlier file of the tile stays.
        """
        self.put_bytes(result.index, encode(result))

    def put_bytes(self, index: int, data: bytes) -> None:
        """Write tile ``index`` as encoded by :func:`lippmann.journal.tile_file.encode`; errors as for :meth:`put`."""
        _write(self._path(index), data)

    def get(self, index: int) -> TileResult:
        """Read and check a tile.

        Raises
        ------
        DamagedTile
            If the tile is missing or cannot be read; or it is incomplete, and is removed.
        """
        path, most = self._path(index), self._most_bytes(index)
        try:
            if path.is_symlink() or not path.is_file():
                raise DamagedTile("not found")
            if path.stat().st_size > most:
                raise DamagedTile("it is larger than its pixels need")
            result = decode(path.read_bytes(), most)
            if result.index != index or result.pixels.shape[:2] != self.grid[index].shape:
                raise DamagedTile("it is another tile")
        except OSError as error:
            raise DamagedTile(f"it cannot be read: {error.strerror or error}") from error
        except DamagedTile:
            self.drop(index)
            raise
        return result

    def drop(self, index: int) -> None:
        """Remove a tile's file, so that the tile counts as missing."""
        with suppress(OSError):  # a folder in its place stays
            self._path(index).unlink()

    def results(self) -> Iterator[TileResult]:
        """All tiles in order; errors as for :meth:`get`."""
        return (self.get(index) for index in range(len(self.grid)))

    def finish(self) -> tuple[str, ...]:
        """Remove the journal, after the picture is in its place.

        Returns
        -------
        A sentence for the user if the folder stays, because it holds files that are no part of the journal.
        """
        place, tiles = self.folder, {self._name(index) for index in range(len(self.grid))}
        # Under another name first: a journal half removed would look like one half made.
        old = self.folder.with_name(f".{self.folder.name}-{os.urandom(4).hex()}.old")
        with _report_errors(self.folder), undone(lambda: _clear_old(old)):
            if not foreign_names(self.folder, tiles.__contains__):
                os.rename(self.folder, old)
                place = old
            left = clear(place, tiles.__contains__, self.close)
            if not left:
                return ()
            if place != self.folder:  # something was put into it meanwhile
                os.rename(place, self.folder)
        more = f", and {len(left) - 1} more" if len(left) > 1 else ""
        return (f"the folder {self.folder.name} stays: it holds {left[0]!r}, which is no part of the journal{more}",)

    def close(self) -> None:
        """Release the lock."""
        self._lock.close()

    def __enter__(self) -> TileStore:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
        if kind is not None:
            self._begun.undo()
            with suppress(OSError):  # it is the first error that counts
                if holds_tiles(self.folder):
                    remark(f"finished tiles are kept in {self.folder.name}: with resume=True the command goes on")
        self._begun.settle()

    def _most_bytes(self, index: int) -> int:
        rows, columns = self.grid[index].shape
        return _MOST_BYTES + rows * columns * _MOST_PER_PIXEL

    def _name(self, index: int) -> str:
        return self.grid.name(index) + TILE

    def _path(self, index: int) -> Path:
        return self.folder / self._name(index)


def journal_of(output: Path) -> Path:
    """Folder of the tiles of the unfinished picture ``output``."""
    place = output.resolve()
    return place.with_name(place.name + ENDING)


def read_job(output: Path) -> Job | None:
    """Job of the journal of the picture ``output``; None if there is no journal with tiles.

    Raises
    ------
    PictureError
        If the folder is no journal, or one of another version.
    OutputError
        If the journal cannot be read.
    """
    folder = journal_of(output)
    try:
        with _report_errors(folder, "read"):
            if not os.path.lexists(folder):
                return None
            if folder.is_symlink() or not folder.is_dir():
                raise _no_journal(folder, "it is a symbolic link" if folder.is_symlink() else "it is no folder")
            if not (folder / JOB).exists():
                if foreign := foreign_names(folder, no_tile):
                    raise _no_journal(folder, f"it holds {foreign[0]!r} and no {JOB}")
                return None  # of a run that ended before it wrote its job
        with _report_errors(folder, "read"), (folder / JOB).open("rb") as file:
            job = json.loads(file.read(_MOST_JOB))
    except (ValueError, RecursionError) as error:
        raise _no_journal(folder, f"it has no readable {JOB}") from error
    if not isinstance(job, dict) or _KEY not in job:
        raise _no_journal(folder, f"its {JOB} is none of ours")
    with _report_errors(folder, "read"):
        if not holds_tiles(folder):
            return None
    if job[_KEY] != _VERSION:
        raise _no_journal(folder, f"its version is {job[_KEY]!r}, this program writes {_VERSION}")
    fingerprint = job.get("fingerprint")
    if not isinstance(fingerprint, dict) or not all(isinstance(value, str) for value in fingerprint.values()):
        raise _no_journal(folder, f"its {JOB} is none of ours")
    return Job(fingerprint, job.get("grid"))


def _check_name(output: Path, folder: Path) -> None:
    """Refuse a name with which the journal beside it could not be named, or put away in the end."""
    too_long = len(os.fsencode(folder.name)) + len(".-01234567.old") - _LONGEST_NAME
    if too_long > 0:
        raise OutputError(
            "the name is too long for the journal beside it",
            where=str(output),
            rule=f"{too_long} bytes less fit",
            fix="choose a shorter name",
        )


def sweep_beside(output: Path) -> None:
    """Remove temporary files of killed writers of ``output``; to be called only while its journal is locked."""
    place = output.resolve()
    # The names that lippmann.runtime.atomic_write and TileStore.finish give to what is on its way.
    half, old = pattern_of(place), re.compile(rf"\.{re.escape(place.name + ENDING)}-[0-9a-f]{{8}}\.old")
    with suppress(OSError):  # a folder that cannot be listed keeps them
        for name in os.listdir(place.parent):
            path = place.with_name(name)
            if old.fullmatch(name) and path.is_dir():
                clear(path, is_tile)
            elif half.fullmatch(name) or old.fullmatch(name):
                remove(path)


def _is_begun(output: Path, folder: Path, job: Job, resume: bool) -> bool:
    """Whether there is a journal of this job; errors as for :meth:`TileStore.open`."""
    before = read_job(output)
    if before is None:
        return False
    if not resume:
        raise OutputError(
            f"an unfinished picture lies in {folder.name}",
            where=str(output),
            fix=f"go on with resume=True, or {_put_away(folder)}",
        )
    phrases = differences(before.fingerprint, job.fingerprint)
    if not phrases and before.grid != job.grid:
        phrases = [f"the grid of tiles (was {before.grid}, is {job.grid})"]
    if phrases:
        raise PictureError(
            f"the unfinished picture is another one: {', '.join(phrases)}",
            where=str(folder),
            rule="what was begun is finished as it was begun",
            fix=f"put that back as it was, or {_put_away(folder)} and begin anew",
        )
    return True


def _remove_without_tiles(folder: Path) -> None:
    """Remove a journal to which no tile came, unless another process works on it."""
    with suppress(OSError, OutputError):
        if folder.is_dir() and not (folder / LOCK).is_symlink():
            with take_lock(folder / LOCK, folder) as lock:
                if not holds_tiles(folder):
                    clear(folder, no_tile, lock.close)


def _clear_old(folder: Path) -> None:
    with suppress(OSError):  # not found, mostly
        clear(folder, is_tile)


def _put_away(folder: Path) -> str:
    """Advice for removing a journal; a folder with the user's own files is only to be moved."""
    return f"move {folder} away" if foreign_names(folder, is_tile) else f"delete {folder}"


def _no_journal(folder: Path, why: str) -> PictureError:
    return PictureError(
        f"this is no journal of an unfinished picture: {why}",
        where=str(folder),
        rule="finished tiles are kept under this name",
        fix="choose another name for the picture, or move what lies there",
    )


def _write(path: Path, data: bytes) -> None:
    """Write a file of the journal; a link in its place goes, and what it leads to stays."""
    if path.is_symlink():
        path.unlink()
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def _is_whole(path: Path, most: int) -> bool:
    """Whether a tile's file has the length that its head states, at most ``most`` bytes.

    Interrupted copies and crashed disks cut files off.
    """
    try:
        size = path.stat().st_size
        if path.is_symlink() or not path.is_file() or size > most:
            return False
        with path.open("rb") as file:
            return whole_length(file.read(len(MARK) + 12)) == size
    except OSError:
        return False


@contextmanager
def _report_errors(folder: Path, done: str = "written") -> Iterator[None]:
    """Turn an :class:`OSError` about the journal into an :class:`OutputError`."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"cannot be {done}: {error.strerror or error}", where=str(folder)) from error
