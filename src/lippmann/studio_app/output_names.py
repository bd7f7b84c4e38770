"""Names of new outputs: of all studios that write into one folder, each name is taken by one."""

from __future__ import annotations

import os
from contextlib import suppress
from itertools import count, islice
from pathlib import Path
from typing import IO

from lippmann.errors import LippmannError, OutputError
from lippmann.journal.file_lock import take_lock
from lippmann.journal.frame_journal import ENDING as FRAMES_ENDING
from lippmann.journal.tile_journal import journal_of, read_job
from lippmann.runtime.atomic_write import disk_name, output_error

#: Bytes of a name without its number and ending: endings of journals and temporary files are added to it.
_MOST_STEM = 150


class OutputClaim:
    """A name that no other studio takes until :meth:`release`, or until the process ends.

    Attributes
    ----------
    output:
        The file to be written.
    """

    def __init__(self, output: Path, lock: IO[bytes]) -> None:
        self.output = output
        self._lock = lock

    def release(self) -> None:
        """Leave the name to whoever finds it free. A second call does nothing."""
        if not self._lock.closed:
            with suppress(OSError):
                _claim_file(self.output).unlink()
            self._lock.close()


def claim_output(folder: Path, stem: str, ending: str) -> OutputClaim:
    """Claim the first free name: ``STEM.ENDING``, then ``STEM-2.ENDING``.

    A name is free where neither an output nor an unfinished one of an earlier run has it, and no studio claims it.

    Raises
    ------
    OutputError
        The folder cannot be written to.
    """
    stem = disk_name(stem, _MOST_STEM)
    for number in count(1):
        output = folder / f"{stem}{'' if number == 1 else f'-{number}'}{ending}"
        if _is_taken(output) and not _claim_file(output).exists():
            continue
        claim = _claim(output)
        # Only now: the one who had claimed it may just have written it. What a killed studio claimed is released.
        if claim is not None and not _is_taken(output):
            return claim
        if claim is not None:
            claim.release()
    raise AssertionError


def frames_of(output: Path) -> Path:
    """Folder of the frames of a film."""
    return output.with_name(f"{output.stem}-frames")


def is_unfinished(output: Path) -> bool:
    """Whether tiles of a picture, or frames of a film, are finished and kept: a run goes on with them."""
    try:
        if read_job(output) is not None:
            return True
    except LippmannError:  # whatever it is, no run goes on with it
        return False
    frames = frames_of(output)
    try:
        with open(frames / (frames.name + FRAMES_ENDING), "rb") as journal:
            return len(list(islice(journal, 2))) > 1  # the first line holds the settings
    except OSError:
        return False


def _is_taken(output: Path) -> bool:
    return any(os.path.lexists(path) for path in (output, journal_of(output), frames_of(output)))


def _claim(output: Path) -> OutputClaim | None:
    """The claim of a name; None if another studio has it."""
    file = _claim_file(output)
    try:
        lock = take_lock(file, output)
    except OutputError:  # held by another studio
        return None
    except OSError as error:
        raise output_error(output, error) from None
    claim = OutputClaim(output, lock)
    try:
        if os.path.samestat(os.fstat(lock.fileno()), os.stat(file)):
            return claim
    except OSError:
        pass
    lock.close()  # the file of a claim that was released between its opening and its locking
    return _claim(output)


def _claim_file(output: Path) -> Path:
    return output.with_name(f".{output.name}.claim")
