"""Layouts of light fields and formats of films: Lippmann's own, and those of other packages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from lippmann.exchange.light_field import DEPTH, WEIGHT
from lippmann.image.stored_values import Stored
from lippmann.runtime.plugins import Door, Extension, Target

#: Keywords that some functions of layouts take: ``distance`` of the stand-in cameras in mm, ``grid``, the views across
#: and down or None, and ``progress``, to be called after every view.
LayoutOption = Literal["distance", "grid", "progress"]
#: Keywords that some writers of films take: the ``codec`` asked for, the ``quilt`` that the frames are, ``place``,
#: the file's path to come, and ``has_depth``, whether depth lies beside colour.
FilmOption = Literal["codec", "quilt", "place", "has_depth"]


class Export(Extension):
    """The object that an entry point of ``lippmann.exports`` names: a :class:`Layout` or a :class:`Film`."""

    group: ClassVar[str] = "lippmann.exports"


@dataclass(frozen=True)
class Layout(Export):
    """A layout of light fields, asked for by the name of its entry point: ``lippmann export --as NAME``.

    Functions may be given as texts, ``"module:function"``.

    Parameters
    ----------
    write:
        ``write(light_field, display, path)`` writes a :class:`LightField` and is to leave no half file.
    read:
        ``read(path)`` returns a :class:`LightField`. None: it is not read.
    bits:
        The types of values that it stores, by bits: of 8: ``"uint8"``, 16: ``"uint16"``, 32: ``"float32"``.
    ending:
        The suffix of its files; none where it is a folder.
    maps:
        Maps that it holds, such as ``"depth"``; None for all.
    write_options, read_options:
        Which of ``distance``, ``grid`` and ``progress`` the functions take as keywords.

    Examples
    --------
    >>> from lippmann.plugins import Layout
    >>> Layout("strip:write", ending=".strip").ending
    '.strip'
    """

    write: Target
    read: Target | None = None
    bits: Mapping[int, Stored] = field(default_factory=lambda: {8: "uint8", 16: "uint16"})
    ending: str = ""
    maps: tuple[str, ...] | None = ()
    write_options: tuple[LayoutOption, ...] = ()
    read_options: tuple[LayoutOption, ...] = ()


@dataclass(frozen=True)
class Film(Export):
    """A format of films, asked for by the ending of a film's name.

    Parameters
    ----------
    suffixes:
        Endings of its files, in lower case, with their dots.
    write:
        ``write(frames, path, frames_per_second)``, or ``"module:function"``: ``frames`` yields arrays ``(H, W, 3)`` of
        bytes. The file becomes that of the film once it is whole; its ending is not that of the film.
    options:
        Which of ``codec``, ``quilt``, ``place`` and ``has_depth`` ``write`` takes as keywords.

    Examples
    --------
    >>> from lippmann.plugins import Film
    >>> Film((".gif",), "my_films:write_gif").suffixes
    ('.gif',)
    """

    suffixes: tuple[str, ...]
    write: Target
    options: tuple[FilmOption, ...] = ()

    def claims(self, name: str) -> tuple[str, ...]:
        """Its suffixes."""
        return self.suffixes


_CODES: Mapping[int, Stored] = {8: "uint8", 16: "uint16"}
_FLOATS: Mapping[int, Stored] = {**_CODES, 32: "float32"}


def _layout(module: str, name: str, **fields: object) -> Layout:
    """A layout of this package."""
    home = f"lippmann.exchange.{module}"
    return Layout(f"{home}:write_{name}", f"{home}:read_{name}", **fields)  # type: ignore[arg-type]


EXPORTS = Door(
    Export,
    {
        "hci": _layout("hci", "hci", maps=(DEPTH,), write_options=("distance", "progress"), read_options=("progress",)),
        "lftoolbox": _layout("lftoolbox_mat", "matlab", bits=_FLOATS, ending=".mat", maps=(WEIGHT,)),
        "eslf": _layout("eslf", "eslf", ending=".png", maps=(WEIGHT,), read_options=("grid",)),
        "zarr": _layout(
            "zarr_store",
            "zarr",
            bits=_FLOATS,
            maps=None,
            write_options=("progress",),
            read_options=("progress",),
        ),
        "views": _layout(
            "view_folder", "view_folder", bits=_FLOATS, write_options=("progress",), read_options=("grid", "progress")
        ),
        "apng": Film((".png", ".apng"), "lippmann.codecs.apng:write_apng"),
        "mp4": Film((".mp4",), "lippmann.viewing.mp4_film:write_mp4", ("codec", "quilt", "place", "has_depth")),
    },
)

#: Names of Lippmann's own layouts.
LAYOUTS = tuple(name for name, each in EXPORTS.own.items() if isinstance(each, Layout))
