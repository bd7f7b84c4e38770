"""Metadata of picture files: display, placement and provenance as one JSON text."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, get_args

from lippmann.color.transfer import Transfer
from lippmann.display import Display
from lippmann.errors import LippmannError, PictureError
from lippmann.image.stored_values import Matrix
from lippmann.printable import shorten
from lippmann.scene.matrices import check_placement

#: Version of this text; rises when a known name changes its meaning.
VERSION = 1

#: The key that holds the version and marks the JSON as ours.
KEY = "lippmann"

#: The key that marks the metadata of a quilt, which is no picture of a panel.
QUILT_KEY = "quilt"


@dataclass(frozen=True)
class Provenance:
    """How a picture was made. Every field has a default, for pictures of unknown origin.

    Parameters
    ----------
    method, integrator:
        Rendering method and integrator, as the command line names them; empty if unknown.
    depth:
        Most surfaces on a path; the primary ray's counts 1.
    spp, seed:
        Samples per pixel, and seed of all random numbers.
    subpixels:
        Whether every sub-pixel was rendered at its own place. Replay samples the colours accordingly.
    scene:
        Name of the scene.
    version:
        Lippmann version that rendered the picture.
    device:
        ``cpu``, or the GPU's name.
    traced_fraction:
        Primary rays traced, divided by those of a full rendering (>= 0).
    pixel_shares:
        Shares of the pixels by origin (``traced``, ``reprojected``, ``interpolated``); empty if all were traced.
    rays:
        Rays traced by kind (``primary``, ``shadow``, ``secondary``).
    seconds:
        Seconds by stage (``load``, ``build``, ``compile``, ``trace``, ``reuse``, ``total``). Files leave them out, so
        that the same picture gives the same file.
    estimate:
        Estimated PSNR in dB with 95 % confidence intervals: ``psnr``, ``psnr_low``, ``psnr_high`` of the whole;
        ``worst``, ``worst_low``, ``worst_high`` of the worst micro-image, which is probably ``worst_lens`` [column,
        row]. None if nothing was estimated.
    transfer:
        Transfer function of the codes in integer formats.
    options:
        Further settings of the method by name: text, numbers, booleans, None, or lists of these.
    notes:
        Sentences for people, such as warnings.

    Raises
    ------
    PictureError
        If a value has the wrong type or range; names the field.
    """

    method: str = ""
    integrator: str = ""
    depth: int | None = None
    spp: int | None = None
    seed: int | None = None
    subpixels: bool = False
    scene: str = ""
    version: str = ""
    device: str = ""
    traced_fraction: float | None = None
    pixel_shares: Mapping[str, float] = field(default_factory=dict)
    rays: Mapping[str, int] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    estimate: Mapping[str, object] | None = None
    transfer: Transfer = "srgb"
    options: Mapping[str, object] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("method", "integrator", "scene", "version", "device"):
            self._require(name, isinstance(getattr(self, name), str), "text")
        for name in ("depth", "spp", "seed"):
            value = getattr(self, name)
            self._require(name, value is None or _is_count(value), "a whole number of at least 0, or nothing")
        self._require("subpixels", isinstance(self.subpixels, bool), "true or false")
        if self.traced_fraction is not None:
            self._require("traced_fraction", _is_amount(self.traced_fraction), "a number of at least 0")
            object.__setattr__(self, "traced_fraction", float(self.traced_fraction))
        self._require("transfer", self.transfer in get_args(Transfer), "'srgb' or 'linear'")
        if self.estimate is not None:
            self._keep("estimate", _is_plain, _plain, "figures by name, or nothing")
        self._keep("pixel_shares", _is_amount, float, "shares of the pixels by origin")
        self._keep("rays", _is_count, int, "counts by kind of ray")
        self._keep("seconds", _is_amount, float, "seconds by stage")
        self._keep("options", _is_plain, _plain, "plain values by name")
        is_list = isinstance(self.notes, (list, tuple))
        self._require("notes", is_list and all(isinstance(note, str) for note in self.notes), "a list of sentences")
        object.__setattr__(self, "notes", tuple(self.notes))

    def _require(self, name: str, well: bool, rule: str) -> None:
        if not well:
            what = f"{name} is {shorten(getattr(self, name))}"
            raise PictureError(what, where="provenance", rule=f"it must be {rule}")

    def _keep(self, name: str, fits: Callable[[object], bool], convert: Callable[[Any], object], rule: str) -> None:
        """Replace a mapping by a checked and converted copy."""
        value = getattr(self, name)
        is_mapping = isinstance(value, Mapping)
        well = is_mapping and all(isinstance(key, str) and fits(item) for key, item in value.items())
        self._require(name, well, rule)
        object.__setattr__(self, name, {key: convert(item) for key, item in value.items()})

    def to_dict(self) -> dict[str, object]:
        """All fields as JSON-able values; :meth:`from_dict` gives an equal object back."""
        plain = {part.name: getattr(self, part.name) for part in fields(self)}
        copies = {name: dict(value) for name, value in plain.items() if isinstance(value, Mapping)}
        return {**plain, **copies, "notes": list(self.notes)}

    @classmethod
    def from_dict(cls, plain: object) -> Provenance:
        """The provenance that :meth:`to_dict` wrote; unknown names are left out.

        Raises
        ------
        PictureError
            If ``plain`` is no mapping, or a value has the wrong type or range.
        """
        if not isinstance(plain, Mapping):
            raise PictureError(f"the provenance is {shorten(plain)}", rule="it must be a mapping of names to values")
        known = {part.name for part in fields(cls)}
        return cls(**{name: value for name, value in plain.items() if name in known})


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_amount(value: object) -> bool:
    # NaN fails the comparison, infinity the second half of it: neither has a place in JSON.
    return isinstance(value, (int, float)) and not isinstance(value, bool) and 0 <= value <= sys.float_info.max


def _is_plain(value: object) -> bool:
    if isinstance(value, (list, tuple)):
        return all(_is_plain(item) for item in value)
    if isinstance(value, float):
        return value - value == 0  # neither NaN nor infinite
    return value is None or isinstance(value, (str, bool, int))


def _plain(value: object) -> object:
    # Lists, as JSON gives them back, so that what was read equals what was written.
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value


@dataclass(frozen=True, eq=False)
class Metadata:
    """Everything that a picture file carries beside the pixels.

    Parameters
    ----------
    display:
        Display of the picture.
    world_from_display:
        ``(4, 4)`` similarity from the display frame (mm) to the scene.
    provenance:
        How the picture was made.
    """

    display: Display
    world_from_display: Matrix
    provenance: Provenance

    def to_dict(self) -> dict[str, object]:
        """JSON-able values, with the version; without seconds, so that the same picture gives the same file."""
        provenance = self.provenance.to_dict()
        del provenance["seconds"]
        return {
            KEY: VERSION,
            "display": self.display.to_dict(),
            "world_from_display": self.world_from_display.tolist(),
            "provenance": provenance,
        }


def to_text(metadata: Metadata) -> str:
    """ASCII JSON of the metadata, for :func:`from_text`; numbers come back exactly."""
    return json.dumps(metadata.to_dict(), allow_nan=False, separators=(",", ":"))


def from_text(text: str, where: str) -> Metadata | None:
    """Metadata of a text by :func:`to_text`; None for any other text, such as a quilt's.

    Raises
    ------
    PictureError
        If a value makes no sense, or the text is of a later version; names ``where``.
    """
    values = parse_json(text)
    if not isinstance(values, dict) or KEY not in values or QUILT_KEY in values:
        return None
    return from_dict(values, where)


def is_quilt_text(text: str) -> bool:
    """Whether a text is the metadata of a quilt."""
    values = parse_json(text) if text else None
    return isinstance(values, dict) and KEY in values and QUILT_KEY in values


def parse_json(text: str) -> object:
    """Value of a JSON text; None if it is no JSON. NaN and infinities are no JSON."""
    try:
        value: object = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError):
        return None
    return value


def from_dict(values: Mapping[str, object], where: str) -> Metadata:
    """Metadata of the values of :meth:`Metadata.to_dict`.

    Raises
    ------
    PictureError
        If a value makes no sense, or the values are of a later version; names ``where``.
    """
    version = values.get(KEY)
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise PictureError(f"its metadata has the version {version!r}", where=where, rule="it must be a whole number")
    if version > VERSION:
        what, rule = f"its metadata has the version {version}", f"up to {VERSION} is read"
        raise PictureError(what, where=where, rule=rule, fix="get a newer Lippmann")
    try:
        display = Display.from_dict(values.get("display"))  # type: ignore[arg-type]  # it refuses what is no mapping
        matrix = check_placement(values.get("world_from_display"))
        provenance = Provenance.from_dict(values.get("provenance"))
    except LippmannError as error:
        what = f"{error.where}: {error.what}" if error.where else error.what
        raise PictureError(f"its metadata makes no sense: {what}", where=where, rule=error.rule) from error
    if not isinstance(display.name, str) or not isinstance(display.title, str):
        raise PictureError("its metadata makes no sense: the display's name is no text", where=where)
    return Metadata(display, matrix, provenance)


def _refuse_constant(name: str) -> None:
    raise ValueError(name)
