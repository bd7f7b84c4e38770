"""Where a picture came from, as plain values that every file format can carry."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, get_args

from lippmann.color.transfer import Transfer
from lippmann.errors import PictureError


@dataclass(frozen=True)
class Provenance:
    """How a picture was made. Everything has a default: a picture made by other means knows nothing of itself.

    Parameters
    ----------
    method, integrator:
        The renderer and what it gathers, by the names of the command line; empty if unknown.
    depth:
        Surfaces a path may meet, the primary ray's counting 1.
    spp, seed:
        Samples per pixel and the seed of all random choices.
    subpixels:
        Whether every sub-pixel was rendered at its own place. Replay samples the colours accordingly.
    scene:
        The scene's name.
    version:
        The Lippmann version that rendered it.
    device:
        ``cpu``, or the GPU's name.
    traced_fraction:
        Primary rays traced divided by the rays that a full rendering traces, in [0, 1] for one sample per pixel and
        method.
    pixel_shares:
        How the pixels came about, as shares of all (``traced``, ``reprojected``, ``interpolated``); empty where every
        pixel was traced.
    rays:
        Rays traced by kind (``primary``, ``shadow``, ``secondary``).
    seconds:
        Seconds spent by stage (``load``, ``build``, ``compile``, ``trace``, ``reuse``, ``total``). Files do not carry
        them, so that the same picture gives the same file.
    estimate:
        What the picture says of its own error, dB with the ends of their 95 % intervals: ``psnr``, ``psnr_low``,
        ``psnr_high`` of the whole, ``worst``, ``worst_low``, ``worst_high`` of the worst micro-image, which is probably
        ``worst_lens`` [column, row]. None where it says nothing.
    transfer:
        How integer formats code the linear values.
    options:
        Further settings of the method: names with plain values (text, numbers, booleans, None, lists of these).
    notes:
        Sentences for people: warnings of the rendering and the like.

    Raises
    ------
    PictureError
        If a value has the wrong type or range; ``where`` names it.
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
    estimate: Mapping[str, Any] | None = None
    transfer: Transfer = "srgb"
    options: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("method", "integrator", "scene", "version", "device"):
            _require(isinstance(getattr(self, name), str), name, getattr(self, name), "text")
        for name in ("depth", "spp", "seed"):
            value = getattr(self, name)
            _require(value is None or _is_count(value), name, value, "a whole number of at least 0, or nothing")
        _require(isinstance(self.subpixels, bool), "subpixels", self.subpixels, "true or false")
        if self.traced_fraction is not None:
            _require(
                _is_amount(self.traced_fraction), "traced_fraction", self.traced_fraction, "a number of at least 0"
            )
            object.__setattr__(self, "traced_fraction", float(self.traced_fraction))
        if self.estimate is not None:
            estimate = _mapping("estimate", self.estimate, _is_plain, "figures by name, or nothing", _plain)
            object.__setattr__(self, "estimate", estimate)
        _require(self.transfer in get_args(Transfer), "transfer", self.transfer, "'srgb' or 'linear'")
        shares = _mapping("pixel_shares", self.pixel_shares, _is_amount, "shares of the pixels by origin", float)
        object.__setattr__(self, "pixel_shares", shares)
        object.__setattr__(self, "rays", _mapping("rays", self.rays, _is_count, "counts by kind of ray", int))
        object.__setattr__(self, "seconds", _mapping("seconds", self.seconds, _is_amount, "seconds by stage", float))
        object.__setattr__(
            self, "options", _mapping("options", self.options, _is_plain, "plain values by name", _plain)
        )
        notes = tuple(self.notes) if isinstance(self.notes, (list, tuple)) else self.notes
        well = isinstance(notes, tuple) and all(isinstance(note, str) for note in notes)
        _require(well, "notes", self.notes, "a list of sentences")
        object.__setattr__(self, "notes", notes)

    def to_dict(self) -> dict[str, Any]:
        """All fields as JSON-able values; :meth:`from_dict` gives an equal object back."""
        plain = {f.name: getattr(self, f.name) for f in fields(self)}
        return plain | {
            "pixel_shares": dict(self.pixel_shares),
            "rays": dict(self.rays),
            "seconds": dict(self.seconds),
            "estimate": None if self.estimate is None else dict(self.estimate),
            "options": dict(self.options),
            "notes": list(self.notes),
        }

    @classmethod
    def from_dict(cls, plain: object) -> Provenance:
        """The provenance that :meth:`to_dict` wrote; names that this version does not know are passed over.

        Raises
        ------
        PictureError
            If ``plain`` is not a mapping or a value has the wrong type or range.
        """
        if not isinstance(plain, Mapping):
            raise PictureError(f"the provenance is {_shown(plain)}", rule="it must be a mapping of names to values")
        known = {f.name for f in fields(cls)}
        return cls(**{name: value for name, value in plain.items() if name in known})


def _require(well: bool, name: str, value: object, rule: str) -> None:
    if not well:
        raise PictureError(f"{name} is {_shown(value)}", where="provenance", rule=f"it must be {rule}")


def _shown(value: object) -> str:
    """``value`` for an error message, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


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


def _plain(value: Any) -> Any:
    # Lists, as JSON gives them back, so that what was read equals what was written.
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def _mapping(name: str, value: object, fits: Any, rule: str, convert: Any) -> dict[str, Any]:
    well = isinstance(value, Mapping) and all(isinstance(key, str) and fits(item) for key, item in value.items())
    _require(well, name, value, rule)
    assert isinstance(value, Mapping)
    return {key: convert(item) for key, item in value.items()}
