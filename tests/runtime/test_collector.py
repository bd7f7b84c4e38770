"""Nothing is freed by the cyclic collector while the engine is in use."""

from __future__ import annotations

import gc
import weakref

import pytest

from lippmann.runtime.collector import no_collection
from lippmann.runtime.engine_lock import exclusive


class Ring:
    """Garbage that only the cyclic collector finds."""

    def __init__(self):
        self.own = self


def drop_a_ring():
    """A reference to what is lost already."""
    return weakref.ref(Ring())


def make_garbage():
    for _ in range(20 * gc.get_threshold()[0]):
        Ring()


def test_garbage_stays_within_the_block():
    gc.collect()
    with no_collection():
        lost = drop_a_ring()
        make_garbage()
        assert lost() is not None
    make_garbage()
    assert lost() is None


@pytest.mark.parametrize("was_enabled", [True, False])
def test_the_collector_is_left_as_it_was(was_enabled):
    (gc.enable if was_enabled else gc.disable)()
    try:
        with pytest.raises(ValueError, match="within"), no_collection():
            raise ValueError("within")
        assert gc.isenabled() == was_enabled
    finally:
        gc.enable()


def test_the_engine_is_used_without_it():
    with exclusive():
        assert not gc.isenabled()
        with exclusive():
            pass
        assert not gc.isenabled()
    assert gc.isenabled()
