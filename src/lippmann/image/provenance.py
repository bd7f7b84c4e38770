"""Provenance: how a picture was made, as plain values that every file format can carry."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, get_args

from lippmann.color.transfer import Transfer
from lippmann.errors import PictureError
from lippmann.printable import shorten


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
