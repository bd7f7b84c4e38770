"""Parser of material libraries (``.mtl``): statements and their arguments, without their meaning.

Formats: Wavefront, "MTL material format" (1995), and the physically based additions that Blender and others write
(Pr, Pm, Ps, Pc, Pcr and their maps).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import decode_text, read_bytes, strip_comment

# keyword (lower case) -> numbers it takes: least, most
_NUMBERS = {
    "kd": (1, 3),
    "ks": (1, 3),
    "ke": (1, 3),
    "tf": (1, 3),
    "ns": (1, 1),
    "ni": (1, 1),
    "tr": (1, 1),
    "illum": (1, 1),
    "pr": (1, 1),
    "pm": (1, 1),
    "ps": (1, 3),
    "pc": (1, 1),
    "pcr": (1, 1),
}
_MAPS = {"map_kd", "map_ks", "map_ke", "map_ns", "map_d", "map_tr", "map_pr", "map_pm", "map_ps", "map_pc", "map_pcr"}
_MAPS |= {"bump", "norm"}
_ALIASES = {"map_bump": "bump", "map_norm": "norm", "norm_map": "norm", "map_opacity": "map_d", "pcr_map": "map_pcr"}
# Ambient light and its map belong to a model of light in which light does not bounce; the rest are switches.
_NO_EFFECT = {"ka", "map_ka", "map_aat", "sharpness", "km"}
# option -> arguments it takes: least, most
_OPTIONS = {
    "-blendu": (1, 1),
    "-blendv": (1, 1),
    "-boost": (1, 1),
    "-bm": (1, 1),
    "-cc": (1, 1),
    "-clamp": (1, 1),
    "-colorspace": (1, 1),
    "-imfchan": (1, 1),
    "-mm": (2, 2),
    "-o": (1, 3),
    "-s": (1, 3),
    "-t": (1, 3),
    "-texres": (1, 1),
    "-type": (1, 1),
}
# Models of light (``illum``) in which transparency refracts or mirrors.
_GLASS = {4, 6, 7, 9}
# First line of the libraries that MeshLab writes.
_MESHLAB = "Converted by Meshlab Group"
_NUMERIC_OPTIONS = {"-bm", "-boost", "-mm", "-o", "-s", "-t"}

#: Name that Blender's exporters write for a texture without a file.
_NO_FILE = "."


@dataclass(frozen=True)
class MapReference:
    """One texture statement: the file's name as written, where it is written, and its options' words."""

    file: str
    where: str
    options: dict[str, tuple[str, ...]]

    def numbers(self, option: str, default: Sequence[float]) -> tuple[float, ...]:
        """An option's numbers, completed from ``default``."""
        given = tuple(float(word) for word in self.options.get(option, ()))
        return given + tuple(default[len(given) :])


@dataclass
class MtlRecord:
    """One material as written: numbers and maps by keyword in lower case, and the keywords that are ignored."""

    name: str
    numbers: dict[str, tuple[float, ...]] = field(default_factory=dict)
    maps: dict[str, MapReference] = field(default_factory=dict)
    ignored: list[str] = field(default_factory=list)
    remark: str = ""

    @property
    def is_glass_model(self) -> bool:
        """Whether its model of light is one of glass."""
        return int(self.scalar("illum", 2)) in _GLASS

    def scalar(self, key: str, default: float) -> float:
        return self.numbers[key][0] if key in self.numbers else default

    def color(self, key: str, default: float) -> tuple[float, float, float]:
        """Three numbers; one alone stands for grey."""
        values = self.numbers.get(key, (default,))
        return (values[0], values[1], values[2]) if len(values) == 3 else (values[0],) * 3


def parse_mtl(path: Path) -> dict[str, MtlRecord]:
    """The materials of a library by name; a name defined twice keeps its first meaning.

    Raises
    ------
    SceneError
        The file is not text, a statement comes before any material, or its arguments are no finite numbers.
    """
    records: dict[str, MtlRecord] = {}
    commented: dict[str, MtlRecord] = {}
    current: MtlRecord | None = None
    text = decode_text(read_bytes(path), path.name)
    for number, line in enumerate(text.split("\n"), 1):
        words = line.split(None, 1)
        if not words or words[0].startswith("#"):
            continue
        where = f"{path.name}:{number}"
        key, body = words[0].lower(), words[1].strip() if len(words) > 1 else ""
        if key == "newmtl":
            current = MtlRecord(body)
            records.setdefault(body, current)
            commented.setdefault(strip_comment(body), current)
        elif current is None:
            raise SceneError(f"'{words[0][:40]}' before any newmtl", where=where, fix="is it an MTL file?")
        else:
            _read_statement(current, _ALIASES.get(key, key), words[0], body, where)
    if _tr_is_opacity(records.values(), is_of_meshlab=_MESHLAB in text):
        for record in records.values():
            if "tr" in record.numbers:
                record.numbers.setdefault("d", record.numbers.pop("tr"))
                record.remark = f"{path.name}: Tr is taken as opacity, as MeshLab writes it"
    return commented | records


def _tr_is_opacity(records: Iterable[MtlRecord], *, is_of_meshlab: bool) -> bool:
    """Whether ``Tr`` says how opaque the materials of a library are, rather than how transparent.

    Nobody writes a library of invisible materials: 1 means opaque where it is more frequent than 0. Glass, which is
    seen with either, has no say. MeshLab wrote opacities before its version 2023.12, and those are taken where its
    materials have neither 0 nor 1, or both alike.
    """
    values = [record.scalar("tr", 0.0) for record in records if _only_tr(record) and not record.is_glass_model]
    return values.count(1.0) + is_of_meshlab > values.count(0.0)


def _only_tr(record: MtlRecord) -> bool:
    return "tr" in record.numbers and "d" not in record.numbers


def _read_statement(record: MtlRecord, key: str, written: str, body: str, where: str) -> None:
    if key in _NUMBERS:
        values = _numbers(body, key, written, where)
        if values is None:
            record.ignored.append(written)
        else:
            record.numbers[key] = values
    elif key == "d":
        words = body.split("#", 1)[0].split()
        if words[:1] == ["-halo"]:  # fades towards the silhouette: a trick of shading, not of light
            record.ignored.append("d -halo")
        else:
            record.numbers["d"] = _finite(words[:1], written, where)
    elif key in _MAPS:
        if body.strip() != _NO_FILE:
            record.maps[key] = _map(body, written, where)
    elif key not in _NO_EFFECT:
        record.ignored.append(written)


def _numbers(body: str, key: str, written: str, where: str) -> tuple[float, ...] | None:
    words = body.split("#", 1)[0].split()
    if words and words[0] in ("spectral", "xyz"):
        return None
    least, most = _NUMBERS[key]
    values = _finite(words[:most], written, where)
    return values[:1] if least < len(values) < most else values  # "Kd 0.5 0.5" is no colour: its first number is grey


def _finite(words: Sequence[str], written: str, where: str) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in words)
    except ValueError:
        values = ()
    if not values or not np.isfinite(values).all():
        raise SceneError(f"'{written} {' '.join(words)[:60]}'", where=where, rule=f"{written} takes finite numbers")
    return values


def _map(body: str, written: str, where: str) -> MapReference:
    """Options first, each with its own number of arguments; the rest is the file's name, spaces and all."""
    options: dict[str, tuple[str, ...]] = {}
    rest = body
    while rest.startswith("-"):
        words = rest.split()
        option = words[0].lower()
        if option not in _OPTIONS:
            break  # a file name may begin with "-"
        least, most = _OPTIONS[option]
        count = 0
        # At least one word must be left for the name.
        while count < most and count + 2 < len(words) and (count < least or _is_number(words[count + 1])):
            count += 1
        arguments = tuple(words[1 : 1 + count])
        if count < least or (option in _NUMERIC_OPTIONS and not all(_is_number(word) for word in arguments)):
            raise SceneError(f"'{written} {body[:60]}'", where=where, rule=f"{option} takes {least} to {most} values")
        options[option] = arguments
        rest = rest.split(None, 1 + count)[-1]
    if not rest:
        raise SceneError(f"{written} without a file", where=where)
    return MapReference(rest, where, options)


def _is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False
