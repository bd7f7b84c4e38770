"""The modules beside the tests, which the benchmark uses too, can be imported; Mitsuba's variant stays what it was."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(autouse=True)
def same_variant():
    """Some targets choose a variant; what renders later expects that of the engine."""
    mitsuba = sys.modules.get("mitsuba")
    before = mitsuba and mitsuba.variant()
    yield
    if before is not None and mitsuba.variant() != before:
        mitsuba.set_variant(before)
