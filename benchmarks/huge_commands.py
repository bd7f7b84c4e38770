"""Every command that reads a picture, on pictures larger than memory: the second half of ``huge.py``.

Time on two cores: about 40 minutes at the full size.

Commands are processes of their own, whose peak memory and processor time the system tells. A process begins with the
memory of the one that starts it, so what these commands read is made by processes of their own, too:

python benchmarks/huge_commands.py repeated FOLDER WIDTH HEIGHT
python benchmarks/huge_commands.py quilt FILE
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

LIPPMANN = [sys.executable, "-c", "from lippmann.cli import main; main()"]

#: The largest quilt that there is, and its views: 12, as many as a lens of the print has pixels.
QUILT_SIDE, QUILT_VIEWS = 16384, (4, 3)

#: Tiles of the viewer's page that are asked for, spread over the picture.
TILES = 40


def repeat(folder: Path, size: tuple[int, int]) -> None:
    """Make ``large.tif`` and ``large.zarr`` in a folder that holds ``small.tif`` and ``small.zarr``."""
    run([sys.executable, __file__, "repeated", str(folder), *(str(side) for side in size)])


def _repeated(folder: Path, size: tuple[int, int]) -> None:
    """``large.tif`` and ``large.zarr`` of this size: ``small.tif`` and ``small.zarr``, rendered, again and again.

    The lenses go on, so that an eye sees nothing sensible; for reading, decoding and judging that is all the same.
    """
    from lippmann.display import Display
    from lippmann.image import read_picture
    from lippmann.image.metadata import Metadata
    from lippmann.image.write import write_rows

    for ending in ("tif", "zarr"):
        small = read_picture(folder / f"small.{ending}")
        height, width = small.pixels.shape[:2]
        growth = size[0] / width
        display: Display = replace(
            small.display.resized(*size),
            viewing_distance=small.display.viewing_distance * growth,
            aperture_distance=small.display.aperture_distance * growth,
        )
        columns = np.arange(size[0]) % width

        def rows(first: int, last: int) -> Any:
            return small.pixels[np.arange(first, last) % height][:, columns]  # noqa: B023

        metadata = Metadata(display, small.world_from_display, small.provenance)
        write_rows(rows, metadata, folder / f"large.{ending}")


def measured(folder: Path) -> dict[str, dict[str, Any]]:
    """Seconds, processor seconds and peak memory of each command on ``large.tif``, and of some on ``large.zarr``."""
    picture, other = folder / "large.tif", folder / "large.zarr"
    quilt, woven = folder / f"waves_qs{QUILT_VIEWS[0]}x{QUILT_VIEWS[1]}.png", folder / "woven.tif"
    run([sys.executable, __file__, "quilt", str(quilt)])
    display = _display_file(picture, folder / "print.toml")
    calls: dict[str, list[Any]] = {
        "info": ["info", picture],
        "info (Zarr)": ["info", other],
        "replay": ["replay", picture, "-o", folder / "seen.png"],
        "replay (Zarr)": ["replay", other, "-o", folder / "seen.png"],
        "refocus": ["refocus", picture, "--plane", "1", "-o", folder / "focused.png"],
        "views": ["views", picture, "--format", "tiff", "-o", folder / "views"],
        "compare": ["compare", picture, other],
        "quilt unpack": ["quilt", "unpack", quilt, "-o", folder / "unpacked"],
        "quilt pack": ["quilt", "pack", folder / "unpacked", "-o", folder / quilt.name.replace("waves", "packed")],
        "weave": ["weave", quilt, "--display", display, "-o", woven],
    }
    found = {}
    for name, words in calls.items():
        found[name] = run([*LIPPMANN, *(str(word) for word in words)])
        print(name, found[name], file=sys.stderr)
    for done in ("views", "unpacked"):
        shutil.rmtree(folder / done, ignore_errors=True)
    woven.unlink()
    for name, shown in (("view", picture), ("view (Zarr)", other)):
        found[name] = _viewed(shown)
        print(name, found[name], file=sys.stderr)
    return found


def run(words: list[str]) -> dict[str, Any]:
    """Seconds, processor seconds and peak resident memory of a process."""
    started = time.perf_counter()
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    found = _ended(process, started)
    if process.returncode:
        raise SystemExit(f"{' '.join(words)} left with {process.returncode}")
    return found


def _ended(process: subprocess.Popen[Any], started: float) -> dict[str, Any]:
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return {
        "seconds": time.perf_counter() - started,
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "peak_resident_bytes": usage.ru_maxrss * 1024,
    }


def _viewed(picture: Path) -> dict[str, Any]:
    """The viewer's server: asked for its page, the manifest and some tiles, as a browser does, then stopped."""
    started = time.perf_counter()
    words = [*LIPPMANN, "view", str(picture), "--no-browser", "--json"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    address = json.loads(process.stdout.readline())["address"]
    _asked(address)
    tiles = json.loads(_asked(f"{address}pictures/0/manifest.json"))["tiles"]
    opened = time.perf_counter() - started
    count = tiles["columns"] * tiles["rows"]
    for number in np.linspace(0, count - 1, min(TILES, count)).astype(int).tolist():
        row, column = divmod(number, tiles["columns"])
        _asked(f"{address}pictures/0/tiles/picture/{column}_{row}")
    # What a shell runs in the background passes on that Ctrl-C is ignored; this is not.
    process.terminate()
    found = _ended(process, started)
    if process.returncode != -signal.SIGTERM:
        raise SystemExit(f"the viewer left with {process.returncode}")
    return {**found, "open_seconds": opened, "tiles": min(TILES, count)}


def _asked(address: str) -> bytes:
    with urllib.request.urlopen(address) as answer:
        body: bytes = answer.read()
    return body


def _quilt(path: Path) -> None:
    """A quilt as large as they come, of waves."""
    from lippmann.codecs.png import encode_png

    line = np.arange(QUILT_SIDE, dtype=np.float32)
    codes = np.empty((QUILT_SIDE, QUILT_SIDE, 3), dtype=np.uint8)
    for channel, (down, across) in enumerate(((91.0, 57.0), (40.0, 73.0), (63.0, 29.0))):
        codes[..., channel] = 128 + 120 * np.sin(line / down)[:, None] * np.cos(line / across)
    path.write_bytes(encode_png(codes, text={}, srgb=True))


def _display_file(picture: Path, path: Path) -> Path:
    """The display of a picture as a file."""
    from lippmann.image import read_metadata

    display = read_metadata(picture).display
    panel, lenses = display.panel, display.lens_array
    path.write_text(
        f"gap = {display.gap!r}\nviewing_distance = {display.viewing_distance!r}\n"
        f"aperture_distance = {display.aperture_distance!r}\n"
        f"[panel]\nwidth = {panel.width}\nheight = {panel.height}\npixel_pitch = {panel.pixel_pitch!r}\n"
        'subpixel_offsets = "none"\n'
        f'[lens_array]\nlayout = "{lenses.layout}"\npitch = {lenses.pitch!r}\n'
    )
    return path


if __name__ == "__main__":
    what, place, *numbers = sys.argv[1:]
    if what == "repeated":
        _repeated(Path(place), (int(numbers[0]), int(numbers[1])))
    else:
        _quilt(Path(place))
