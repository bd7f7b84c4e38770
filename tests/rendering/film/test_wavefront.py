"""Totals of rays, and times of compilation."""

from __future__ import annotations

import time

import pytest

from lippmann.rendering.film import wavefront
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


def test_kernels_of_an_interrupted_render_take_no_longer_than_this_one(monkeypatch):
    """Else tracing would take less than no time, which no provenance allows."""
    monkeypatch.setattr(wavefront.dr, "kernel_history", lambda: [{"backend_time": 5000.0}, {"codegen_time": 1000.0}])
    assert wavefront.measure_compilation(time.perf_counter() - 60.0) == 6.0
    started = time.perf_counter()
    assert 0.0 <= wavefront.measure_compilation(started) <= time.perf_counter() - started
