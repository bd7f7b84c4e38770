"""What many tests share: the engine, started once, and the folder of real scenes."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SHARED_SCENES = ROOT.parent / "shared" / "scenes"


@pytest.fixture(scope="session")
def engine():
    """The rendering engine on the CPU."""
    from lippmann.engine import start

    return start("cpu")


@pytest.fixture(scope="session")
def shared_scenes() -> Path:
    """Real scenes made by others; the test is skipped where they are absent."""
    if not SHARED_SCENES.is_dir():
        pytest.skip("the folder ../shared/scenes with real scenes is not there")
    return SHARED_SCENES
