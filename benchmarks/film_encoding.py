"""What a film takes beside its frames: memory of encoders by its length, and whole commands with and without it.

Time on two cores: about six minutes for the encoders, and 50 for two turns of 48 rendered frames.

python benchmarks/film_encoding.py [--codecs [NAME...]] [--rendered FRAMES] [--turns N]

Each codec writes a film of ``COUNTS[-1]`` pictures of a Portrait's quilt, made without rendering, in a process of its
own. Its resident memory is sampled, without what it was before the first picture: the largest of the first so many
pictures, and what is left while the encoder waits, as it does while a frame is rendered.
``--rendered``: so many frames of a turntable as quilts of a Portrait, as they are by default: the command for files
alone, the one for files and their film in H.264, and one for a still, one after the other, ``--turns`` times. Every
other turn runs backwards, so that a machine that grows slower favours none. Encoders are threads of the command: its
processor time and memory hold theirs.
``--codecs --rendered 48`` measures no encoder alone.
Writes ``benchmarks/results/film_encoding.json``, where rows of other codecs stay.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from numpy.typing import NDArray

from defaults import HERE, Checkout
from harness import median_ratio, save, saved

COUNTS = (8, 16, 32, 48)
CODECS = ("h264", "hevc", "vp9", "av1")
#: Width and height of the quilt of a Portrait, 8 x 6 views.
SIDE = 3360

_PROGRAM = "from lippmann.cli import main; main()"


class Memory:
    """Resident memory of this process over what it was, in bytes, sampled every 10 ms; a context manager."""

    def __init__(self) -> None:
        self._process = psutil.Process()
        self._before = self._process.memory_info().rss
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch)
        self.peak = 0

    def now(self) -> int:
        return int(self._process.memory_info().rss) - self._before

    def _watch(self) -> None:
        while not self._done.wait(0.01):
            self.peak = max(self.peak, self.now())

    def __enter__(self) -> Memory:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()


def picture(number: int) -> NDArray[np.uint8]:
    """A gradient before which a bright rectangle wanders."""
    codes = np.zeros((SIDE, SIDE, 3), np.uint8)
    codes[..., 0] = np.linspace(0, 255, SIDE).astype(np.uint8)
    codes[..., 1] = codes[..., 0].T
    codes[SIDE // 4 : SIDE // 2, 20 * number : 20 * number + SIDE // 4] = (200, 80, 40)
    return codes


def encode(codec: Any) -> dict[str, Any]:
    """Memory of a film by its number of frames: the largest until then, and what the waiting encoder holds."""
    from lippmann.runtime.machine import return_freed_memory
    from lippmann.viewing.video_file import write_codes

    picture(0)
    peaks, waiting = {}, {}
    with Memory() as memory, tempfile.TemporaryDirectory() as folder:

        def frames() -> Iterator[NDArray[np.uint8]]:
            for number in range(COUNTS[-1]):
                yield picture(number)
                return_freed_memory()  # as between the frames of a sequence
                _wait_until_idle()
                if number + 1 in COUNTS:
                    peaks[number + 1], waiting[number + 1] = memory.peak, memory.now()

        write_codes(frames(), Path(folder) / "film_qs8x6a0.75.mp4", codec=codec)
    return {"peak": peaks, "waiting": waiting}


def _wait_until_idle() -> None:
    """Wait until this process has computed next to nothing for a while."""
    spent = -1.0
    while time.process_time() - spent > 0.03:
        spent = time.process_time()
        time.sleep(0.5)


def rendered(count: int, turns: int) -> dict[str, Any]:
    """Seconds of the clock and of processors, and peaks in bytes, of whole commands in turn; one list each, by turn."""
    checkout, words = Checkout(HERE), ["quilt", "render", "teapot", "-d", "portrait", "-q"]
    moving = [*words, "--turntable", "48", "--frames", f"0:{count}"]
    measured: dict[str, list[dict[str, float]]] = {"still": [], "frames": [], "film": []}
    for turn in range(turns):
        for name in list(measured)[:: -1 if turn % 2 else 1]:
            with tempfile.TemporaryDirectory() as folder:
                output = {"still": "still.png", "frames": "frames", "film": "film.mp4"}[name]
                command = [*(words if name == "still" else moving), "-o", f"{folder}/{output}"]
                measured[name].append(checkout.run(_PROGRAM, command))
            print(name, json.dumps(measured[name][-1]), flush=True)
    return {"count": count, **measured}


def describe(result: dict[str, Any]) -> str:
    """The section of ``docs/background/measurements.md``."""
    lines = ["| codec | " + " | ".join(f"{count} frames" for count in COUNTS) + " | waiting |", "|" + "---|" * 6]
    for codec, row in result["codecs"].items():
        peaks = " | ".join(f"{row['peak'][str(count)] / 1e6:.0f} MB" for count in COUNTS)
        lines.append(f"| `{codec}` | {peaks} | {row['waiting'][str(COUNTS[-1])] / 1e6:.0f} MB |")
    text = f"""## What a film takes beside its frames (`film_encoding.py`)

Largest memory of encoder and writer for films of {SIDE}x{SIDE} pixels, a quilt of a Portrait, over what the process had
before; and what the encoder holds while it waits for the next frame.

{chr(10).join(lines)}
"""
    if measured := result.get("rendered"):
        rows = {name: measured[name] for name in ("still", "frames", "film")}
        wall, cpu, peak = (
            {name: [one[kind] for one in row] for name, row in rows.items()} for kind in ("wall", "cpu", "peak")
        )
        most = {name: statistics.median(values) for name, values in peak.items()}
        table = "\n".join(
            f"| {title} | {statistics.median(wall[name]):.0f} s | {statistics.median(cpu[name]):.0f} s "
            f"| {most[name] / 1e6:.0f} MB |"
            for name, title in (("still", "a still"), ("frames", "frames alone"), ("film", "frames and film"))
        )
        shares = ", ".join(
            f"{(most['frames'] + row['waiting'][str(COUNTS[-1])]) / most['still']:.2f} with `{codec}`"
            for codec, row in result["codecs"].items()
        )
        text += f"""
Whole commands for {measured["count"]} frames of a turntable as quilts of a Portrait, as they are by default, one
after the other, medians of {len(measured["film"])}; the film is H.264.

| command | by the clock | processor time | largest memory |
|---|---|---|---|
{table}

The film takes {median_ratio(wall["film"], wall["frames"]):.3f} times as long as the frames alone and
{median_ratio(cpu["film"], cpu["frames"]):.3f} times as much processor time; its largest memory is
{median_ratio(peak["film"], peak["still"]):.2f} times a still's.
Frames alone and what an encoder holds while it waits are, by addition, so many times a still's:
{shares}.
"""
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--codecs", nargs="*", default=CODECS)
    parser.add_argument("--rendered", type=int)
    parser.add_argument("--turns", type=int, default=2)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(encode(options.one)))
        return
    result = saved("film_encoding")
    codecs = result.get("codecs", {})
    for codec in options.codecs:
        command = [sys.executable, __file__, "--one", codec]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        codecs[codec] = json.loads(done.stdout.splitlines()[-1])
        print(codec, codecs[codec], flush=True)
    found = {"codecs": codecs, "rendered": result.get("rendered")}
    if options.rendered:
        found["rendered"] = rendered(options.rendered, options.turns)
    save("film_encoding", found)


if __name__ == "__main__":
    main()
