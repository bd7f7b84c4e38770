"""Notes on parts of a picture file that are not shown, one line each."""

from __future__ import annotations

from collections.abc import Iterable


def aspect_note(across: float, down: float) -> tuple[str, ...]:
    """The note on pixels that are not square, by the pixels per length across and down; none for square ones.

    Programs write whole numbers per inch or per metre, which differ by a part of a hundred at most.
    """
    if across <= 0.0 or down <= 0.0 or abs(across / down - 1.0) < 0.01:
        return ()
    return (f"its pixels are {down / across:.4g} times as wide as high: they are shown square",)


def pictures_note(count: int) -> tuple[str, ...]:
    """The note on a file of several pictures; none for one."""
    return (f"it holds {count} pictures: the first is shown",) if count > 1 else ()


class FileNotes:
    """Notes on several files: one of a kind, with the first file that it is of."""

    def __init__(self) -> None:
        self._files: dict[str, str] = {}

    def add(self, name: str, notes: Iterable[str]) -> None:
        """Take the notes on the file ``name``."""
        for note in notes:
            self._files.setdefault(note, name)

    def lines(self) -> tuple[str, ...]:
        """All of them, in one line each."""
        return tuple(f"{name}: {note}" for note, name in self._files.items())
