"""A small cluster of real processes on loopback, whose workers can be made to fail."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import psutil
import pytest

pytest.importorskip("distributed")

#: Preloaded by workers: wraps the work on a tile. A file ``WHAT-INDEX`` (or ``WHAT-any``) in the folder makes it fail.
FAULTS = """
import os, signal, time
from pathlib import Path

import lippmann._version
from lippmann.cluster import tasks as work

if os.environ.get("OTHER_VERSION"):
    lippmann._version.VERSION = os.environ["OTHER_VERSION"]
folder = Path(os.environ["FAULTS"])
# Dask may run this twice.
real = getattr(work, "the_real_one", work.render_part)
work.the_real_one = real

def wanted(what, index, once=False):
    for name in (f"{what}-{index}", f"{what}-any"):
        try:
            if once:
                os.unlink(folder / name)
            elif not (folder / name).exists():
                continue
            return True
        except FileNotFoundError:
            continue
    return False

def render_part(key, index, *rest):
    (folder / f"begun-{index}").touch()
    if wanted("slow", index):
        time.sleep(0.4)
    if wanted("poison", index):
        raise ValueError("poisoned")
    if wanted("kill", index, once=True):
        os.kill(os.getpid(), signal.SIGKILL)
    if wanted("freeze", index, once=True):
        time.sleep(4)
    if wanted("hog", index, once=True):
        kept = []
        while True:
            kept.append(b"x" * 40_000_000)
            time.sleep(0.05)
    while wanted("hold", index):
        time.sleep(0.05)
    result = real(key, index, *rest)
    (folder / f"done-{index}").touch()
    return result

work.render_part = render_part
"""


class Lab:
    """Processes of one cluster; all are killed in the end."""

    def __init__(self, folder: Path) -> None:
        self.faults = folder / "faults"
        self.faults.mkdir()
        (folder / "fault_preload.py").write_text(FAULTS)
        self._folder = folder
        self._processes: list[subprocess.Popen[bytes]] = []
        self.port = _free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"

    def start(self, workers: int = 1, **more: Any) -> None:
        self.start_scheduler()
        for _ in range(workers):
            self.start_worker(**more)

    def start_scheduler(self, *more: str) -> subprocess.Popen[bytes]:
        options = ["--host", "127.0.0.1", "--port", str(self.port), "--dashboard-address", "127.0.0.1:0"]
        keeps = {"DASK_DISTRIBUTED__SCHEDULER__ACTIVE_MEMORY_MANAGER__START": "False"}
        found = self._run("-m", "distributed.cli.dask_scheduler", *options, *more, more=keeps)
        _until(lambda: _answers(self.port))
        return found

    def start_worker(
        self, *options: str, version: str = "", command: str = "lippmann", address: str = "", threads: str = "1"
    ) -> subprocess.Popen[bytes]:
        preload = json.dumps([str(self._folder / "fault_preload.py")])
        more = {"DASK_DISTRIBUTED__WORKER__PRELOAD": preload, "FAULTS": str(self.faults), "OTHER_VERSION": version}
        if command == "dask":
            words = ["-m", "distributed.cli.dask_worker", "--host", "127.0.0.1", "--nthreads", "1", "--no-dashboard"]
        else:
            words = ["-c", "from lippmann.cli import main; main()", "worker", "--threads", threads]
        return self._run(*words, *options, address or self.address, more=more)

    def start_program(self, script: Path, *words: str, folder: Path, **more: str) -> subprocess.Popen[bytes]:
        """A script of Python's, in a working directory of its own."""
        return self._run(str(script), *words, more=more, folder=folder)

    def processes(self) -> list[psutil.Process]:
        """Those that were started here; what they have started are their children."""
        return [psutil.Process(process.pid) for process in self._processes]

    def fail(self, what: str, index: int | str = "any") -> None:
        (self.faults / f"{what}-{index}").touch()

    def heal(self, what: str, index: int | str = "any") -> None:
        (self.faults / f"{what}-{index}").unlink(missing_ok=True)

    def begun(self) -> set[int]:
        return {int(path.name.partition("-")[2]) for path in self.faults.glob("begun-*")}

    def done(self) -> set[int]:
        return {int(path.name.partition("-")[2]) for path in self.faults.glob("done-*")}

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """As a machine that loses its power: the worker and what watches over it at once."""
        os.killpg(process.pid, signal.SIGKILL)
        process.wait(timeout=20)

    def close(self) -> None:
        for process in self._processes:
            if process.poll() is None:
                self.kill(process)

    def log(self) -> str:
        return (self._folder / "log.txt").read_text(errors="replace")

    def _run(
        self, *words: str, more: dict[str, str] | None = None, folder: Path | None = None
    ) -> subprocess.Popen[bytes]:
        with (self._folder / "log.txt").open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, *words],
                stdout=log,
                stderr=log,
                # Killed workers leave their scratch files.
                env={**os.environ, "PYTHONWARNINGS": "ignore", "TMPDIR": str(self._folder), **(more or {})},
                start_new_session=True,
                cwd=folder or self._folder,
            )
        self._processes.append(process)
        return process


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _until(condition: Callable[[], object], seconds: float = 60) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not come to that"
        time.sleep(0.05)


@pytest.fixture
def until() -> Callable[..., None]:
    """Wait until a condition holds."""
    return _until


@pytest.fixture
def lab(tmp_path) -> Iterator[Lab]:
    found = Lab(tmp_path)
    try:
        yield found
    finally:
        found.close()


class Render(Thread):
    """The small picture of the tests, rendered on a cluster; ``error`` and ``result`` tell how that ended."""

    def __init__(self, address: str, output: Path, resume: bool = False) -> None:
        super().__init__(daemon=True)
        self.output, self.remarks = output, list[str]()
        self.error: BaseException | None = None
        self.result: Any = None
        self._address, self._resume = address, resume

    def run(self) -> None:
        from lippmann import api
        from lippmann.cluster import connect, parse_target
        from lippmann.cluster.runner import runner_on

        try:
            with connect(parse_target(self._address), remark=self.remarks.append) as cluster:
                runner = runner_on(cluster)
                self.result = api.render_to_file(
                    "primitives", self.output, resume=self._resume, runner=runner, **OPTIONS
                )
        except BaseException as error:  # noqa: BLE001 - the test looks at it
            self.error = error

    def finish(self, seconds: float = 120) -> Render:
        """Wait for the end."""
        self.join(seconds)
        assert not self.is_alive(), "it never ends"
        return self


OPTIONS: dict[str, Any] = {"integrator": "direct", "method": "full", "spp": 2, "device": "cpu"}
#: Tiles that the picture has.
TILES = 16


@pytest.fixture
def render(tmp_path) -> Callable[..., Render]:
    """Begin to render on a cluster."""

    def begin(address: str, name: str = "there.png", resume: bool = False) -> Render:
        found = Render(address, tmp_path / name, resume)
        found.start()
        return found

    return begin


@pytest.fixture(scope="session")
def here(engine, tmp_path_factory) -> bytes:
    """The same picture, rendered in this process."""
    from lippmann import api

    output = tmp_path_factory.mktemp("here") / "here.png"
    result = api.render_to_file("primitives", output, **OPTIONS)
    assert result.tiles == TILES
    return output.read_bytes()
