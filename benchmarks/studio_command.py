"""``lippmann studio`` as a page meets it: a process is started, and gets views by its WebSocket as a pointer sends.

Time on two cores: about 10 minutes.

For each display and scene: seconds from starting the command to the first frame; then an orbit of the model and the
eye, a view every 16 ms, whether or not frames come: frames a second, how old a frame is when it comes (since the page
sent its view, coding and sockets included), and the size of the pictures that are traced. With ``--minutes`` the orbit
of the first display goes on for so long, with a rest of a second in every twenty, and the process's memory is watched.

python benchmarks/studio_command.py [--minutes 10] [--only mla-square/teapot]
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from typing import Any

import psutil
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from harness import save, saved
from studio import wanted_cases

#: Displays and the size of the page's picture; the studio traces fewer pixels where it must to be quick.
DISPLAYS = {"seed-lenticular": (512, 512), "mla-square": (512, 512), "looking-glass-portrait": (384, 512)}
VIEW_SECONDS, ORBIT_SECONDS = 0.016, 20.0
REST_EVERY, REST_SECONDS = 20.0, 1.0
_HEADER = struct.Struct("<BBBBIIHHIf")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=int, default=0)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    result = saved("studio_command")
    cases = result.get("cases", {})
    for name, display, source in wanted_cases(DISPLAYS, asked.only, cases):
        size = DISPLAYS[display]
        with _studio(display, source) as studio:
            cases[name] = {"asked": size} | studio.first_frame(size) | studio.orbit(size, ORBIT_SECONDS)
        print(name, cases[name], flush=True)
    save("studio_command", {"cases": cases, "endless": result.get("endless")})
    if asked.minutes:
        name, size = next(iter(DISPLAYS.items()))
        with _studio(name, "teapot") as studio:
            studio.first_frame(size)
            studio.orbit(size, ORBIT_SECONDS)  # all kernels are there
            result["endless"] = studio.endless(size, asked.minutes)
        print(result["endless"], flush=True)
        save("studio_command", {"cases": cases, "endless": result["endless"]})


class Studio:
    """A running command and the connection of its page."""

    def __init__(self, process: subprocess.Popen[str], socket: ClientConnection, began: float) -> None:
        self._process, self._socket, self._began = process, socket, began
        self._state: dict[str, Any] = json.loads(socket.recv(60))["state"]
        self._number = 0
        self._sent: dict[int, float] = {}

    def memory(self) -> float:
        """Resident MiB of the process and its children."""
        process = psutil.Process(self._process.pid)
        return sum(each.memory_info().rss for each in (process, *process.children(recursive=True))) / 2**20

    def first_frame(self, size: tuple[int, int]) -> dict[str, float]:
        self._look(size, 0.0)
        while self._next(120.0) is None:
            pass
        return {"start_s": time.perf_counter() - self._began}

    def orbit(self, size: tuple[int, int], seconds: float) -> dict[str, Any]:
        ages, sizes, moved, frames = [], [], 0.0, 0
        began = now = time.perf_counter()
        while now - began < seconds:
            rests = (now - began) % REST_EVERY > REST_EVERY - REST_SECONDS
            if not rests:
                moved += VIEW_SECONDS
                self._look(size, moved)
            due = now + VIEW_SECONDS
            while (wait := due - time.perf_counter()) > 0:
                frame = self._next(wait)
                if frame is not None and not rests:
                    view, samples, traced = frame
                    frames += 1
                    if samples == 1 and view in self._sent:
                        ages.append(time.perf_counter() - self._sent[view])
                        sizes.append(traced)
            now = time.perf_counter()
        ages.sort()
        return {
            "frames": frames,
            "frames_per_second": frames / seconds * REST_EVERY / (REST_EVERY - REST_SECONDS),
            "median_age_ms": 1000 * statistics.median(ages),
            "age_of_99_in_100_ms": 1000 * ages[int(0.99 * (len(ages) - 1))],
            "oldest_ms": 1000 * ages[-1],
            "size": statistics.median_high(sizes),
        }

    def endless(self, size: tuple[int, int], minutes: int) -> dict[str, Any]:
        """Orbits of a minute each, and the memory before the first and after each."""
        memory, orbits = [self.memory()], []
        for _ in range(minutes):
            orbits.append(self.orbit(size, 60.0))
            memory.append(self.memory())
        return {
            "frames": sum(orbit["frames"] for orbit in orbits),
            "frames_per_second": statistics.mean(orbit["frames_per_second"] for orbit in orbits),
            "oldest_ms": max(orbit["oldest_ms"] for orbit in orbits),
            "minutes": minutes,
            "memory_mib": [round(each) for each in memory],
        }

    def _look(self, size: tuple[int, int], moved: float) -> None:
        """Send a view: the model is turned, and the eye sways, as ``moved`` seconds pass."""
        self._number += 1
        state = self._state | {"turn": [(40 * moved) % 360 - 180, 10 * math.sin(moved), 0.0]}
        eye = [60 * math.sin(0.7 * moved), 20 * math.sin(0.9 * moved), 500.0]
        self._sent[self._number] = time.perf_counter()
        self._sent.pop(self._number - 2000, None)
        view = {"type": "view", "number": self._number, "size": list(size), "eye": eye, "state": state}
        self._socket.send(json.dumps(view))

    def _next(self, seconds: float) -> tuple[int, int, tuple[int, int]] | None:
        """View, samples and (width, height) of the next frame, acknowledged; None of other messages, or of none."""
        try:
            message = self._socket.recv(seconds)
        except TimeoutError:
            return None
        if isinstance(message, str):
            said = json.loads(message)
            if said["type"] == "error":
                raise RuntimeError(said["line"])
            return None
        *_, number, view, width, height, samples, _ = _HEADER.unpack_from(message)
        self._socket.send(json.dumps({"type": "shown", "frame": number}))
        return view, samples, (width, height)


@contextlib.contextmanager
def _studio(display: str, scene: str) -> Iterator[Studio]:
    began = time.perf_counter()
    with running_command(display, scene) as (process, address), live_socket(address) as socket:
        yield Studio(process, socket, began)


@contextlib.contextmanager
def running_command(display: str, scene: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The process of ``lippmann studio`` and the address that it prints."""
    command = [sys.executable, "-c", "from lippmann.cli import main; main()", "studio", scene]
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(
            [*command, "--display", display, "--no-browser"], stdout=subprocess.PIPE, text=True, cwd=folder
        ) as process,
    ):
        try:
            assert process.stdout is not None
            yield process, process.stdout.readline().split()[-1]
        finally:
            process.kill()


def live_socket(address: str) -> ClientConnection:
    """A page's WebSocket to the studio at ``address``."""
    folder = address.rstrip("/")
    origin = Origin(folder.rpartition("/")[0])  # only the studio's own pages are let in
    return connect(f"ws{folder.removeprefix('http')}/live", origin=origin, max_size=None)


if __name__ == "__main__":
    main()
