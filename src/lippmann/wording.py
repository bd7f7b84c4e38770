"""Facts as people read them: in the command line's lines and in notebooks' tables."""

from __future__ import annotations

from collections.abc import Mapping

_MINUTE, _HOUR = 60.0, 3600.0  # seconds


def samples_in_words(spp: int | None, of: str = "per pixel") -> str:
    """``1 sample per pixel``, ``16 samples per pixel``."""
    return f"{spp} sample{'' if spp == 1 else 's'} {of}"


def depths_in_words(back: float, front: float) -> str:
    """The range from ``back`` to ``front``, z in millimetres."""
    behind, before = (round(depth, 1) + 0.0 for depth in (-back, front))  # no -0.0
    return f"from {behind:.1f} mm behind to {before:.1f} mm in front of the lens plane"


def duration_in_words(seconds: float) -> str:
    """``3.2 s``, ``45 s``, ``2.5 min`` or ``1.8 h``."""
    if seconds < _MINUTE:
        return f"{seconds:.2g} s"
    if seconds < _HOUR:
        return f"{seconds / _MINUTE:.1f} min"
    return f"{seconds / _HOUR:.1f} h"


def html_table(caption: str, facts: Mapping[str, str]) -> str:
    """A table of two columns, a row for each fact."""
    import html

    rows = "".join(
        f'<tr><th style="text-align: left">{html.escape(name)}</th>'
        f'<td style="text-align: left">{html.escape(value)}</td></tr>'
        for name, value in facts.items()
    )
    return f"<table><caption>{html.escape(caption)}</caption>{rows}</table>"
