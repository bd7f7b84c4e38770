"""Workers of this machine, from their start to their end."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

from lippmann.cluster import connection

pytest.importorskip("distributed")


def test_what_does_not_close_in_time_is_not_closed_again_at_the_end(monkeypatch):
    """Dask closes what stands open when the program ends, and writes a traceback where that fails."""
    released = threading.Event()

    class Slow:
        shutdown_on_close = True
        amm = SimpleNamespace(stop=lambda: None)

        def close(self):
            released.wait(30)

    slow = Slow()
    dask = SimpleNamespace(LocalCluster=lambda **options: slow, Client=lambda cluster, **options: slow)
    monkeypatch.setattr(connection, "CLOSE_SECONDS", 0.1)
    with connection._started_here(dask, 1, 1):
        pass
    released.set()
    assert not slow.shutdown_on_close
