"""A state as the page has it: an object of JSON with all fields of :class:`StudioState`, and what the page displays."""

from __future__ import annotations

import math
import os
import re
import shlex
import subprocess
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lippmann.display import Display
from lippmann.display.formats.load import size_of_short_form
from lippmann.errors import UsageError
from lippmann.options.option import options_of
from lippmann.options.texts import from_plain, to_plain
from lippmann.printable import one_line
from lippmann.scene.placement import Placement
from lippmann.studio_app.state import StudioState
from lippmann.viewer.manifest import optics

#: Longest text of a field: a path or a short form.
_MOST_TEXT = 4096

#: Settings as warnings name them for programs.
_PARAMETER = re.compile(r"\b([a-z]+(?:_[a-z]+)*)=(\S+)")


def values_of_state(state: StudioState) -> dict[str, object]:
    """Fields of a state as types of JSON."""
    return {name: to_plain(value) for name, value in vars(state).items()}


def state_of_values(values: object) -> StudioState:
    """State of fields as types of JSON; fields left out have their default.

    Raises
    ------
    UsageError
        A field is unknown, or a value is of another type or out of its range.
    """
    if not isinstance(values, Mapping):
        raise UsageError("the state", rule="must be an object of JSON")
    kinds = {each.name: each.type for each, _ in options_of(StudioState)}
    settings: dict[str, Any] = {}
    for name, value in values.items():
        if name not in kinds:
            raise UsageError.unknown("setting", name, kinds)
        _check_of_page(value, name)
        try:
            settings[name] = from_plain(kinds[name], value)
        except UsageError as error:
            raise UsageError(error.what, parameter=name, rule=error.rule) from None
    return StudioState(**settings)


def facts_of_view(display: Display, placement: Placement, exposure: float) -> dict[str, object]:
    """Values that the page displays beside a picture: depth (mm toward the viewer), warnings, automatic values."""
    return {
        "depth": {
            "scene": _pair(placement.depth_range),
            "sharp": _pair(placement.depth_budget),
        },
        "eye_tracked": display.stereo is not None,
        "warnings": [_in_words(line) for line in placement.warnings],
        "depth_scale": placement.depth_scale,
        "exposure": exposure,
        "display_facts": _display_facts(display),
    }


def display_size(state: StudioState) -> dict[str, object] | None:
    """Size of a display that can have another one, see :class:`ShortFormSize`; None for a fixed device."""
    size = size_of_short_form(state.display)
    return None if size is None else asdict(size)


def optics_of(display: Display, *, subpixels: bool | None) -> dict[str, object]:
    """Geometry of a display for the page's eye; see :func:`lippmann.viewer.manifest.optics`."""
    return optics(display, subpixels=bool(subpixels))


def title_of(state: StudioState) -> str:
    """Name of a state's scene for people."""
    return Path(state.scene).name


def _display_facts(display: Display) -> list[list[str]]:
    grid, panel, (across, down) = display.lens_grid, display.panel, display.pixels_per_lens
    width, height = display.size_mm
    rows = [
        ("Panel", f"{panel.width} x {panel.height} pixels"),
        ("Size", f"{width:.4g} x {height:.4g} mm"),
        ("Lenses", f"{grid.columns}" + ("" if down is None else f" x {grid.rows}")),
        ("Pixels per lens", f"{across:.3g}" + ("" if down is None else f" x {down:.3g}")),
        ("Field of view", f"{display.field_of_view:.3g}°"),
    ]
    if math.isfinite(display.viewing_distance):
        rows.append(("Viewing distance", f"{display.viewing_distance:.4g} mm"))
    return [list(row) for row in rows]


def _in_words(warning: str) -> str:
    return _PARAMETER.sub(lambda match: f"{match[1].replace('_', ' ')} {match[2]}", warning)


def _pair(ends: tuple[float, float]) -> list[float | None]:
    return [end if math.isfinite(end) else None for end in ends]


def _check_of_page(value: object, name: str) -> None:
    """Refuse numbers and texts that no field of the page holds."""
    if isinstance(value, (list, Mapping)):
        for part in value.values() if isinstance(value, Mapping) else value:
            _check_of_page(part, name)
    elif isinstance(value, str) and not (0 < len(value) <= _MOST_TEXT and one_line(value) == value):
        raise UsageError(f"{value[:60]!r}", parameter=name, rule=f"a line of at most {_MOST_TEXT} letters")
    elif isinstance(value, float) and not abs(value) < 1e12:
        raise UsageError(f"{value!r}", parameter=name, rule="a number below 1e12")


def shell_line(words: list[str]) -> str:
    """The words as one line to paste into the system's shell."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)
