"""Displays from files: the presets that come with Lippmann, and one's own, as TOML.

A file holds the keys of :class:`Display`, with the tables ``[panel]`` and ``[lens_array]``::

    title = "A 15.6-inch panel behind a slanted sheet"
    gap = 0.885                         # a number is millimetres
    viewing_distance = "60 cm"          # or a string with a unit: um, mm, cm, m, mil, in; "infinite" is allowed here
    aperture_distance = 10

    [panel]
    width = 3840
    height = 2160
    pixel_pitch = "282.4 dpi"           # dpi and ppi for the pixel pitch
    subpixel_offsets = "rgb"            # or "bgr" ..., "none", or three pairs [right, down] in pixels

    [lens_array]
    layout = "lenticular"
    pitch = "45.5 lpi"                  # lpi (lenses per inch) and px (pixels of the panel) for what the lenses repeat
    slant = 9.46                        # degrees

A file without a ``name`` has its own, less the ending.

Tables ``[lens]`` and ``[pixel]`` describe a real lens, in place of the gap, and the part of a sub-pixel that shines,
see :mod:`lippmann.display.formats.lens_tables`.

An eye-tracked monitor has a table ``[stereo]``, see :mod:`lippmann.display.formats.stereo_toml`. A slanted monitor may
be given by pitch, slope and centre instead, see :mod:`lippmann.display.formats.monitor_toml`. A JSON file is the
calibration of a Looking Glass, see :mod:`lippmann.display.formats.looking_glass`. Prints and monitors also have short
forms, see :func:`display_of_short_form`.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import ClassVar, Literal

from lippmann.display import validation
from lippmann.display.display import INFINITE, Display, check_tables
from lippmann.display.formats.bridge import NAME as BRIDGE
from lippmann.display.formats.bridge import display_of_bridge
from lippmann.display.formats.lens_tables import aperture_of_table, monitor_display, with_profile
from lippmann.display.formats.looking_glass import display_of_calibration
from lippmann.display.formats.monitor_toml import TABLE as MONITOR
from lippmann.display.formats.monitor_toml import monitor_of_texts
from lippmann.display.formats.recorded_depth import default_aperture
from lippmann.display.formats.stereo_toml import TABLE as STEREO
from lippmann.display.formats.stereo_toml import stereo_display
from lippmann.display.panel import stripe
from lippmann.display.validation import MILLIMETRES, Arguments, millimetres, positive
from lippmann.errors import DisplayError
from lippmann.printable import shorten
from lippmann.runtime.plugins import Door, Extension, Target, function_of
from lippmann.runtime.regular_file import read_small_text

#: Kinds of displays, before the colon.
KINDS = ("print", "monitor")


def is_short_form(name: str) -> bool:
    """Whether a display's name is a short form; the kind alone is one too."""
    return name.partition(":")[0] in KINDS


def display_of_short_form(name: str) -> Display:
    """The display of a short form.

    Raises
    ------
    DisplayError
        If a key is missing, doubled or unknown, or a value is out of its range; names the key.
    """
    kind, _, rest = name.partition(":")
    try:
        return display_of_texts(kind, _pairs(rest))
    except DisplayError as error:
        where = f"{kind}: {error.where}" if error.where else kind
        raise DisplayError(error.what, where=where, rule=error.rule, fix=error.fix) from None


def display_of_texts(kind: str, texts: Mapping[str, str]) -> Display:
    """The ``print`` or ``monitor`` of values by their keys; raises as :func:`display_of_short_form`."""
    if kind != "print":
        return monitor_of_texts(texts).display()
    from lippmann.display.formats.print_sheet import print_of_texts

    return print_of_texts(texts).display()


@dataclass(frozen=True)
class ShortFormSize:
    """The size in a short form, and the text around it: ``head``, ``WxH``, ``tail`` is the form with another one.

    Attributes
    ----------
    width, height:
        Sides in ``unit``.
    unit:
        ``mm`` for prints, ``px`` for monitors.
    head, tail:
        Text before and after ``WxH``; ``tail`` begins with the unit of a print.
    """

    width: float
    height: float
    unit: Literal["mm", "px"]
    head: str
    tail: str


def size_of_short_form(name: str) -> ShortFormSize | None:
    """The size that a display's name sets; None for fixed devices, whose names are no short forms.

    Raises
    ------
    DisplayError
        As :func:`display_of_short_form`.
    """
    if not is_short_form(name):
        return None
    kind, _, rest = name.partition(":")
    parts = rest.split(",")
    at = next((k for k, part in enumerate(parts) if part.partition("=")[0].strip() == "size"), None)
    if at is None:
        raise DisplayError("size is missing", where=kind, rule="it has no default", fix="add it")
    text = parts[at].partition("=")[2].strip()
    head = f"{kind}:{','.join([*parts[:at], 'size='])}"
    tail = "".join(f",{part}" for part in parts[at + 1 :])
    if kind == "print":
        width, height = validation.size(text, "size")
        return ShortFormSize(width, height, "mm", head, f"mm{tail}")
    panel = display_of_short_form(name).panel
    return ShortFormSize(panel.width, panel.height, "px", head, tail)


def _pairs(text: str) -> dict[str, str]:
    pairs: dict[str, str] = {}
    for part in text.split(",") if text.strip() else []:
        key, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or not key or not value:
            raise DisplayError(f"{part.strip()!r} is no pair", rule="it must be key=value pairs with commas between")
        if key in pairs:
            raise DisplayError(f"{key} is given twice", where=key, fix="leave one out")
        pairs[key] = value
    return pairs


if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

#: Name of Lippmann's own displays among all.
_OWN = "lippmann"

#: How the names of all Looking Glass devices begin.
_FAMILY = "looking-glass-"

_MAXIMUM_BYTES = 1_000_000  # a picture given by mistake is not read to its end

#: Lengths of a file by table; beside plain lengths, the units per inch and whether the panel's pixel may be the unit.
_LENGTHS: dict[str, dict[str, tuple[tuple[str, ...], bool]]] = {
    "": {"gap": ((), False), "viewing_distance": ((), False), "aperture_distance": ((), False)},
    "panel": {"pixel_pitch": (("dpi", "ppi"), False)},
    "lens_array": {"pitch": (("lpi",), True), "row_pitch": (("lpi",), True), "offset": ((), True)},
}


@dataclass(frozen=True)
class Displays(Extension):
    """Displays of a maker, and a format of files that describe some.

    Parameters
    ----------
    presets:
        Texts by name: TOML, as :func:`lippmann.load_display` reads it from a file.
    suffixes:
        Endings of files, in lower case, with their dots, that ``read`` is for.
    read:
        ``read(path)``, or ``"module:function"``, returns a :class:`lippmann.Display`. It raises a
        :class:`lippmann.LippmannError`, such as ``DisplayError``, for a file that it cannot read.

    Examples
    --------
    >>> from lippmann.plugins import Displays
    >>> Displays(suffixes=(".lens",), read="lens_maker:read").suffixes
    ('.lens',)
    """

    presets: Mapping[str, str] = field(default_factory=dict)
    suffixes: tuple[str, ...] = ()
    read: Target | None = None

    group: ClassVar[str] = "lippmann.displays"

    def claims(self, name: str) -> tuple[str, ...]:
        """Names of its presets, and its suffixes."""
        return (*self.presets, *self.suffixes)

    def fault(self) -> str:
        """The fault in its fields; empty if all is well."""
        if self.suffixes and self.read is None:
            return "it has suffixes, and no function reads such files"
        try:
            for name in self.presets:
                _from_preset(name, self.presets)
        except DisplayError as error:
            return str(error)
        return ""


def load_display(name_or_path: str | os.PathLike[str]) -> Display:
    """The preset of that name, the display of a TOML file or a Looking Glass's ``visual.json``, or of a short form.

    A Looking Glass preset goes by the end of its name, too, such as ``portrait`` or
    ``lkg-portrait``, and by what its device is called, such as ``Looking Glass Go`` or ``27 inch landscape``.
    ``bridge`` is the panel that Looking Glass Bridge finds on this machine, ``bridge:SERIAL`` one of several.

    Parameters
    ----------
    name_or_path:
        Such a name, a file, or a short form such as ``print:lpi=60,ppi=720,size=20x10cm``.

    Returns
    -------
    Display
        With its lengths in millimetres.

    Raises
    ------
    DisplayError
        If there is neither, or the file cannot be read or does not describe a possible display; several devices are
        called so.

    Examples
    --------
    >>> lippmann.load_display("Looking Glass Go").name
    'looking-glass-go'
    """
    own = displays().own[_OWN]
    presets = own.presets
    try:
        name = os.fspath(name_or_path)
    except TypeError:
        rule = "it must be a name such as 'seed-lenticular', a file or a Display"
        what = f"{shorten(name_or_path)} is no display"
        raise DisplayError(what, parameter="display", rule=rule) from None
    # Owners of a Looking Glass know their device as "portrait".
    short = _FAMILY + name.removeprefix("lkg-")
    name = short if short in presets else name
    if name in presets:
        return _from_preset(name, presets)
    if is_short_form(name):
        return display_of_short_form(name)
    if name.partition(":")[0] == BRIDGE:
        return display_of_bridge(name)
    path = Path(name)
    if path.suffix in own.suffixes:
        return _read_file(path)
    if not path.exists() and (device := _device_called(name, presets)):
        return _from_preset(device, presets)
    return _of_plugin(name, path) or _read_file(path)


def _of_plugin(name: str, path: Path) -> Display | None:
    """The display that another package knows by name or reads from a file; None for a file that none reads.

    Raises
    ------
    DisplayError
        There is no such display and no such file, or it cannot be read.
    """
    door = displays()
    plugin = door.find(name) or door.find(path.suffix.lower())
    if plugin is None and not path.exists():
        known = [each for each in door.claims() if not each.startswith(".")]
        names = dict.fromkeys([*known, *(preset.removeprefix(_FAMILY) for preset in door.own[_OWN].presets)])
        rule = "'lippmann displays' lists those known; a .toml file, or a Looking Glass's visual.json, is one, too"
        raise DisplayError.unknown("display", name, names, parameter="display", rule=rule, fix=door.problems)
    if plugin is None or not plugin.distribution:
        return None
    if name in plugin.value.presets:
        return _from_preset(name, plugin.value.presets)
    assert plugin.value.read is not None
    with plugin.guard(DisplayError, name):
        display = function_of(plugin.value.read)(path)
    if not isinstance(display, Display):
        what = f"the plugin {plugin} made a {type(display).__name__} of it"
        raise DisplayError(what, where=name, rule="a display is read as a Display")
    return display


def list_displays() -> list[Display]:
    """All presets, by name.

    Returns
    -------
    list of Display
        Those of this package in the order of their names, then those of plugins.

    Examples
    --------
    >>> [display.name for display in lippmann.list_displays()][0]
    'displayxr'
    """
    door = displays()
    plugins = [each.value for each in door.plugins if not each.problem]
    return [_from_preset(name, each.presets) for each in (door.own[_OWN], *plugins) for name in each.presets]


@cache
def displays() -> Door[Displays]:
    """All presets and formats."""
    return Door(Displays, {_OWN: Displays(_preset_texts(), (".toml", ".json"), _read_file)})


def _from_preset(name: str, presets: Mapping[str, str]) -> Display:
    return _from_toml(presets[name], where=f"{name}.toml", stem=name)


def _read_file(path: Path) -> Display:
    """The display of a TOML file, or of a Looking Glass's calibration."""
    rule = "a display is a preset's name, a TOML file or a Looking Glass's visual.json"
    text, where = read_small_text(path, _MAXIMUM_BYTES, DisplayError, rule), os.fspath(path)
    if text.lstrip("\ufeff \t\r\n").startswith("{") or path.suffix.lower() == ".json":
        return display_of_calibration(text, where=where)
    return _from_toml(text, where=where, stem=path.stem)


def _preset_texts() -> dict[str, str]:
    # Not by importlib.resources, which loads what reads zip files.
    presets = sorted((Path(__file__).parent.parent / "presets").glob("*.toml"))
    return {path.stem: path.read_text(encoding="utf-8") for path in presets}


def _device_called(name: str, presets: Mapping[str, str]) -> str | None:
    """The Looking Glass preset whose name and title hold all words of ``name``; None if there is none."""
    words = _words(name)
    titles = {device: tomllib.loads(text)["title"] for device, text in presets.items() if device.startswith(_FAMILY)}
    called = [device for device, title in titles.items() if words and words <= _words(f"{device} {title}")]
    exact = [device for device in called if words | _words(_FAMILY) == _words(device)]
    if len(exact or called) > 1:
        raise DisplayError(f"{name!r} is the name of {len(called)} displays", rule=f"say which: {', '.join(called)}")
    return next(iter(exact or called), None)


def _words(name: str) -> set[str]:
    return set(re.findall(r"[a-z0-9.]+", name.lower())) - {"inch", "in", "lkg"}


def _from_toml(text: str, *, where: str, stem: str) -> Display:
    try:
        values = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also numbers of absurd length, lists in lists in lists
        raise DisplayError(f"not valid TOML: {error}", where=where) from None
    try:
        values = {"name": stem, **values}
        if MONITOR in values:
            return monitor_display(values)
        if STEREO in values:
            return stereo_display(values)
        lens, pixel = values.pop("lens", None), values.pop("pixel", None)
        check_tables(values if lens is None else {"gap": None, **values})
        parts = _convert_tables(values)
        if lens is not None:
            parts = with_profile({**parts, "lens": lens})
        display = Display.from_dict(parts)
        if pixel is not None:
            display = replace(display, pixel=aperture_of_table(pixel, display.panel.pixel_pitch))
        return display if "aperture_distance" in values else _with_aperture(display)
    except DisplayError as error:
        place = _locate(text, error.where, where)
        raise DisplayError(error.what, where=place, rule=error.rule, fix=error.fix) from None


def _with_aperture(display: Display) -> Display:
    aperture = default_aperture(
        display.viewing_distance,
        lens_pitch=display.lens_array.pitch,
        gap=display.gap,
        pixel_pitch=display.panel.pixel_pitch,
    )
    return replace(display, aperture_distance=aperture)


def _locate(text: str, key: str, where: str) -> str:
    """``file:line`` of a dotted key, or the file and the table if it is not written there."""
    table, _, name = key.rpartition(".")
    current = ""
    for line, content in enumerate(text.splitlines(), start=1):
        if header := re.match(r"\s*\[\s*([\w.]+)\s*\]", content):
            current = header[1]
            if current == key:
                return f"{where}:{line}"
        elif current == table and re.match(rf"\s*[\"']?{re.escape(name)}[\"']?\s*=", content):
            return f"{where}:{line}"
    return f"{where} [{table or key}]" if key else where


def _convert_tables(values: Arguments) -> Arguments:
    """Tables with all lengths in millimetres and sub-pixels as offsets; values that are no strings stay as they are."""
    panel = _convert_lengths(values["panel"], "panel", None)
    offsets = panel.get("subpixel_offsets")
    if isinstance(offsets, str):
        panel["subpixel_offsets"] = stripe(offsets, "panel.subpixel_offsets")
    pixel = positive(panel["pixel_pitch"], "panel.pixel_pitch")
    lenses = _convert_lengths(values["lens_array"], "lens_array", pixel)
    return {**_convert_lengths(values, "", None), "panel": panel, "lens_array": lenses}


def _convert_lengths(values: Arguments, table: str, pixel: float | None) -> dict[str, object]:
    """The keys of one table with all lengths in millimetres; ``pixel`` is the pixel pitch, if it may be a unit."""
    converted = dict(values)
    for name, (per_inch, in_pixels) in _LENGTHS[table].items():
        value, key = values.get(name), f"{table}.{name}" if table else name
        scales = {**MILLIMETRES, "px": pixel} if in_pixels and pixel is not None else MILLIMETRES
        if isinstance(value, list):
            converted[name] = [millimetres(item, key, scales, per_inch) for item in value]
        elif not (name == "viewing_distance" and value == INFINITE) and name in values:
            converted[name] = millimetres(value, key, scales, per_inch)
    return converted
