"""What a film takes beside its frames: memory of encoders by its length, and whole commands with and without it.

Time on two cores: about six minutes for the encoders, and an estimated 20 for 48 rendered frames.

python benchmarks/film_encoding.py [--codecs [NAME...]] [--rendered FRAMES] [--blocks N]

Each codec writes a film of ``COUNTS[-1]`` pictures of a Portrait's quilt, made without rendering, in a process of its
own. Its resident memory is sampled, without what it was before the first picture: the largest of the first so many
pictures, and what is left while the encoder waits, as it does while a frame is rendered.
``--rendered``: so many frames of a turntable as quilts of a Portrait, as they are by default, in ``--blocks`` runs of
consecutive frames. Each block is rendered by the command for files alone (A) and by the one for files and their film in
H.264 (B), in the order ABBA ABBA: a machine that drifts evenly favours none. Each run pays its own start and its film's
opening and end, which one long film pays once. A still is rendered before and after. Encoders are threads of the
command: its processor time and memory hold theirs.
``--codecs --rendered 48`` measures 48 frames in four blocks, and no encoder alone.
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
from harness import save, saved

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


def rendered(count: int, blocks: int) -> dict[str, Any]:
    """Seconds of the clock and of processors, and peaks in bytes, of whole commands; one list each, by block."""
    checkout, words = Checkout(HERE), ["quilt", "render", "teapot", "-d", "portrait", "-q"]
    outputs = {"still": "still.png", "frames": "frames", "film": "film.mp4"}
    measured: dict[str, list[dict[str, float]]] = {name: [] for name in outputs}

    def run(name: str, *more: str) -> None:
        with tempfile.TemporaryDirectory() as folder:
            measured[name].append(checkout.run(_PROGRAM, [*words, *more, "-o", f"{folder}/{outputs[name]}"]))
        print(name, *more, json.dumps(measured[name][-1]), flush=True)

    run("still")
    ranges = [f"{count * block // blocks}:{count * (block + 1) // blocks}" for block in range(blocks)]
    for block, frames in enumerate(ranges):
        for name in ("film", "frames") if block % 2 else ("frames", "film"):
            run(name, "--turntable", "48", "--frames", frames)
    run("still")
    return {"blocks": ranges, **measured}


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
            f"| {title} | {sum(wall[name]) / runs:.0f} s | {sum(cpu[name]) / runs:.0f} s | {most[name] / 1e6:.0f} MB |"
            for name, title, runs in (
                ("still", "a still", len(wall["still"])),
                ("frames", "frames alone", 1),
                ("film", "frames and film", 1),
            )
        )
        shares = ", ".join(
            f"{(most['frames'] + row['waiting'][str(COUNTS[-1])]) / most['still']:.2f} with `{codec}`"
            for codec, row in result["codecs"].items()
        )
        text += f"""
Whole commands for the frames {", ".join(measured["blocks"])} of a turntable as quilts of a Portrait, as they are by
default. Frames alone and film render these blocks in turn (ABBA); the film is H.264. Seconds are sums of all blocks,
memory is their median.

| command | by the clock | processor time | largest memory |
|---|---|---|---|
{table}

The film takes {_ratio(wall)} times as long as the frames alone,
and {_ratio(cpu)} times as much processor time;
its largest memory is {most["film"] / most["still"]:.2f} times a still's.
Frames alone and what an encoder holds while it waits are, by addition, so many times a still's:
{shares}.
"""
    return text


def _ratio(values: dict[str, list[float]]) -> str:
    """A film's sum over that of its frames alone, and the range of single blocks, in words."""
    blocks = [film / frames for film, frames in zip(values["film"], values["frames"], strict=True)]
    return f"{sum(values['film']) / sum(values['frames']):.3f} ({min(blocks):.3f} to {max(blocks):.3f} by block)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--codecs", nargs="*", default=CODECS)
    parser.add_argument("--rendered", type=int)
    parser.add_argument("--blocks", type=int, default=4)
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
        found["rendered"] = rendered(options.rendered, options.blocks)
    save("film_encoding", found)


if __name__ == "__main__":
    main()
