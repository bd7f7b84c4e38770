"""What a film takes beside its frames: memory as it grows longer, and processor time of a render with and without it.

Time on two cores: about six minutes for the encoders, two for eight rendered frames, five for the peaks of twelve.

python benchmarks/film_encoding.py [--codecs NAME...] [--rendered FRAMES] [--peak FRAMES]

Each codec writes a film of ``COUNTS[-1]`` pictures of a Portrait's quilt, made without rendering, in a process of its
own. Its resident memory is sampled, without what it was before the first picture: the largest of the first so many
pictures, and what is left while the encoder waits, as it does while a frame is rendered.
``--rendered``: so many frames of a turntable, quilts of a quarter of the pixels, of one sample a pixel: the command for
files alone and the one for files and their film in H.264 run at the same time, twice, so that both meet the same load.
``--peak``: the largest memory of the whole command for so many frames and their film in H.264, and of a still of the
same options: by default, and with one sample a pixel.
Writes ``benchmarks/results/film_encoding.json``, where rows of other codecs stay.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
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


def peak(count: int) -> dict[str, Any]:
    """Peaks of whole commands in bytes: a still, and a film of so many frames, by default and of one sample a pixel."""
    checkout, words = Checkout(HERE), ["quilt", "render", "teapot", "-d", "portrait", "-q"]
    turn = ["--turntable", "48", "--frames", f"0:{count}"]
    found: dict[str, Any] = {"frames": count}
    with tempfile.TemporaryDirectory() as folder:
        for name, options in (("default", []), ("one sample", ["--spp", "1"])):
            still = checkout.run(_PROGRAM, [*words, *options, "-o", f"{folder}/still.png"])["peak"]
            film = checkout.run(_PROGRAM, [*words, *options, *turn, "-o", f"{folder}/{name}.mp4"])["peak"]
            found[name] = {"still": still, "film": film}
    return found


def rendered(count: int) -> dict[str, Any]:
    """Seconds and peaks of frames in files, and of the same with their film, which run at the same time; two turns."""
    checkout = Checkout(HERE)
    words = ["quilt", "render", "teapot", "-d", "portrait", "-q", "--size", f"{SIDE // 2}x{SIDE // 2}", "--spp", "1"]
    turn = ["--turntable", "48", "--frames", f"0:{count}"]
    turns = []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        for number in range(2):
            outputs = {"files": f"{folder}/{number}", "film": f"{folder}/{number}.mp4"}
            runs = {name: pool.submit(checkout.run, _PROGRAM, [*words, *turn, "-o", outputs[name]]) for name in outputs}
            turns.append({name: run.result() for name, run in runs.items()})
    return {"frames": count, "turns": turns}


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
        cpu, wall = (
            np.mean([turn["film"][kind] / turn["files"][kind] for turn in measured["turns"]])
            for kind in ("cpu", "wall")
        )
        text += f"""
{measured["frames"]} frames of one sample a pixel, quilts of {SIDE // 2}x{SIDE // 2} pixels, take {cpu:.3f} times as
much processor time with their film in H.264 as without it, and {wall:.3f} times as long: both commands at the same
time, means of two turns.
"""
    if measured := result.get("peak"):
        default, light = measured["default"], measured["one sample"]
        shares = ", ".join(
            f"{1 + row['waiting'][str(COUNTS[-1])] / default['still']:.2f} with `{codec}`"
            for codec, row in result["codecs"].items()
        )
        text += f"""
Measured: the command for {measured["frames"]} frames as they are by default, with their film in H.264, takes
{default["film"] / 1e6:.0f} MB at most, a still {default["still"] / 1e6:.0f} MB:
{default["film"] / default["still"]:.2f} times as much. Of one sample
a pixel, denoised, they take {light["film"] / 1e6:.0f} and {light["still"] / 1e6:.0f} MB:
{light["film"] / light["still"]:.2f} times as much.
With what encoders hold while they wait, a still as it is by default takes, by addition,
{shares}.
"""
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--codecs", nargs="*", default=CODECS)
    parser.add_argument("--rendered", type=int)
    parser.add_argument("--peak", type=int)
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
    found = {"codecs": codecs, "rendered": result.get("rendered"), "peak": result.get("peak")}
    if options.rendered:
        found["rendered"] = rendered(options.rendered)
    if options.peak:
        found["peak"] = peak(options.peak)
    save("film_encoding", found)


if __name__ == "__main__":
    main()
