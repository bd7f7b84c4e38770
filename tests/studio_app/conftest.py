"""What the tests of the studio share: studios that render by a stand-in."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

# Modules that only these tests use lie beside them, the browser beside those of the viewer.
sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent.parent / "viewer")]


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    """A running studio of small pictures, made by a stand-in; see :class:`stand_in.Running`."""
    from stand_in import running

    with running(tmp_path_factory.mktemp("studio")) as made:
        yield made
