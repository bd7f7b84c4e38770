"""Loops of kernels are recorded once: what is the same in all turns is no state of theirs.

Where a loop hands anything on unchanged, Dr.Jit records it a second time without that, and loops inside it twice as
often: what takes longest of a small picture would take twice or four times as long.
"""

from __future__ import annotations

from collections import Counter

import drjit as dr
import pytest

pytestmark = pytest.mark.usefixtures("engine")


@pytest.fixture
def recordings(monkeypatch):
    """``{label: (loops, recordings of their bodies)}``."""
    loops, bodies = Counter(), Counter()
    recorded = dr.while_loop

    def counting(state, cond, body, *, label=None, **options):
        loops[label] += 1

        def counted(*values):
            bodies[label] += 1
            return body(*values)

        return recorded(state, cond, counted, label=label, **options)

    monkeypatch.setattr(dr, "while_loop", counting)
    return lambda: {label: (loops[label], bodies[label]) for label in loops}


#: Loops that the scenes below are to have: through panes, to photons, along mirrors, and to emitters.
EXPECTED = {
    "primitives": {"paths", "emitters", "visibility", "cells", "photons", "photon events"} | {"chains", "chain"},
    "tree": {"paths", "emitters", "to the first rough surface"},
    "room": {"paths", "emitters"},
}


@pytest.mark.long_cases(but=["tree"])
@pytest.mark.parametrize("name", EXPECTED)
def test_loops_are_recorded_once(name, recordings):
    import lippmann

    display = lippmann.load_display("seed-lenticular").resized(96, 48)
    lippmann.render(name, display, integrator="path", spp=16, denoise="oidn", method="pooled")
    found = recordings()
    assert EXPECTED[name] <= found.keys()
    assert {label: count for label, count in found.items() if count[0] != count[1]} == {}
