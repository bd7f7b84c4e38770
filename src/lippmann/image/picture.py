"""The interface of pictures in memory and on disk: values by windows, rows and pixels, and how they were made."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, get_args

import numpy as np

from lippmann.color.transfer import Transfer
from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.errors import PictureError, UsageError
from lippmann.image.encoding import linear_values
from lippmann.image.stored_values import FloatArray, Indices, Layer, Matrix, Stored, Values
from lippmann.image.views import Resampling, view_grid
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


#: Deviation of ``world_from_display`` from a rotation and scales that rounding may leave.
_TOLERANCE = 1e-6


class Picture(ABC):
    """The pixels of a panel: :class:`~lippmann.image.IntegralImage` in memory, or
    :class:`~lippmann.image.LargePicture` in a file that is decoded piece by piece.

    Attributes
    ----------
    display:
        Display of the picture; its panel has ``W x H`` pixels.
    world_from_display:
        ``(4, 4)`` affine map from the display frame (mm) to the scene.
    provenance:
        How the picture was made.
    maps:
        Layers beside the RGB by name, ``(H, W)`` or ``(H, W, 2 to 4)``.
    stored:
        Type of the values in the picture's file; ``float32`` if it has none.
    """

    display: Display
    world_from_display: Matrix
    provenance: Provenance
    maps: Mapping[str, Layer]
    stored: Stored

    @abstractmethod
    def window(self, window: PixelWindow) -> Values:
        """``(rows, columns, 3)`` values of a rectangle as the picture holds them: linear floats or codes."""

    @abstractmethod
    def take(self, row: Indices, column: Indices, channels: slice = slice(0, 3)) -> FloatArray:
        """Linear RGB ``(..., channels)`` of single pixels; ``row`` and ``column`` broadcast to ``(...)``."""

    def held_rows(self, first: int, last: int) -> Values:
        """``(last - first, W, 3)`` values of whole rows as the picture holds them: linear floats or codes."""
        return self.window(PixelWindow(0, first, self.display.panel.width, last - first))

    def rows(self, first: int, last: int) -> FloatArray:
        """``(last - first, W, 3)`` linear RGB of whole rows."""
        return linear_values(self.held_rows(first, last), self.provenance.transfer)

    @property
    def views_are_exact(self) -> bool:
        """Whether the views are a permutation of the pixels; otherwise they are resampled."""
        return view_grid(self.display).exact

    @property
    def views_note(self) -> str:
        """A sentence on how the views deviate from exact ones; empty if they do not."""
        return view_grid(self.display).note

    def replay(
        self,
        eye: tuple[float, float, float] | None = None,
        *,
        size: tuple[int, int] | None = None,
        filter: Resampling = "nearest",
        subpixels: bool | None = None,
        optics: bool = False,
    ) -> FloatArray:
        """Linear RGB ``(height, width, 3)`` that an eye at ``eye`` (mm, display frame) sees.

        Parameters, defaults and errors are those of :func:`lippmann.viewing.replay.replay`; with ``optics`` those of
        :func:`lippmann.viewing.optical_replay.replay_optics`, which takes the place of ``filter`` and ``subpixels``.
        """
        from lippmann.viewing.replay import replay

        if optics:
            from lippmann.viewing.optical_replay import replay_optics

            if (filter, subpixels) != ("nearest", None):
                rule = "the lens says which sub-pixels are seen, and how much of each"
                parameter = "subpixels" if filter == "nearest" else "filter"
                raise UsageError("given beside optics", parameter=parameter, rule=rule, fix="leave it out")
            return replay_optics(self, eye, size=size)
        return replay(self, eye, size=size, filter=filter, subpixels=subpixels)


def checked_placement(matrix: object) -> Matrix:
    """``matrix`` as a read-only ``(4, 4)`` float64 array; a :class:`PictureError` if it places no display.

    Columns 0 to 2 are the display's axes in the world: right-handed, x and y at a right angle and equally long. That of
    z may be longer, where the display shows the scene's depth compressed, and lean, where a camera's lens is shifted.
    """
    rule = "it must be 4 x 4: a rotation times a scale (z may differ and lean), a translation, and (0, 0, 0, 1) below"
    try:
        values: Matrix = np.array(matrix, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PictureError("world_from_display is no matrix", rule=rule) from None
    if values.shape != (4, 4) or not np.isfinite(values).all() or list(values[3]) != [0, 0, 0, 1]:
        raise PictureError(f"world_from_display is {values.tolist()}", rule=rule)
    linear = values[:3, :3]
    with np.errstate(all="ignore"):  # what overflows places nothing either: NaN is within no tolerance
        lengths = np.linalg.norm(linear, axis=0)
        axes = linear / lengths
        is_regular = np.linalg.det(axes) > 0.0 and abs(lengths[0] / lengths[1] - 1.0) <= _TOLERANCE
        is_square = abs(axes[:, 0] @ axes[:, 1]) <= _TOLERANCE
    if not (is_regular and is_square):
        raise PictureError(f"world_from_display is {values.tolist()}", rule=rule)
    values.flags.writeable = False
    return values
