"""Totals of rays: sums by kind."""

from __future__ import annotations

import pytest

from lippmann.rendering.film.wavefront import RayTotals


def test_totals_add_kind_by_kind():
    total = first = RayTotals(1, 2, 3, 4)
    total += RayTotals(primary=10, discarded=40)
    assert total == RayTotals(11, 2, 3, 44)
    assert first == RayTotals(1, 2, 3, 4)


def test_unknown_kinds_are_refused():
    kinds = {"sideways": 1}
    with pytest.raises(TypeError, match="sideways"):
        RayTotals(**kinds)
