"""Whole commands, run in this process for speed: what they print, and the exit code they leave with."""

from __future__ import annotations

import json
import signal
from dataclasses import dataclass
from typing import Any

import pytest


@dataclass
class Outcome:
    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """Standard output as the one object that ``--json`` prints."""
        return json.loads(self.out)


@pytest.fixture
def hangup_ends():
    """Processes started here end at a hang-up, also where the tests were started to ignore it (``nohup``)."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.fixture
def lippmann(capfd):
    """Run one command: ``lippmann("info", path)``."""
    from lippmann.cli import run

    def call(*words: object) -> Outcome:
        capfd.readouterr()
        code = run([str(word) for word in words])
        captured = capfd.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call


@pytest.fixture
def short_probe(monkeypatch):
    """Plans trace for the twentieth of a second, not for two: less exactly, but the rest of a plan is the same."""
    from lippmann.rendering import forecast

    monkeypatch.setattr(forecast, "PROBE_SECONDS", 0.05)


@pytest.fixture(scope="session")
def picture(engine, tmp_path_factory):
    """A small picture with all its metadata, rendered once."""
    from lippmann.cli import run

    path = tmp_path_factory.mktemp("pictures") / "teapot.png"
    assert run(["render", "teapot", "--integrator", "direct", "--spp", "1", "--quiet", "-o", str(path)]) == 0
    return path
