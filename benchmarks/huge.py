"""A poster larger than memory: peak resident memory, and time per pixel against that of a picture of 8 megapixels.

Time on two cores: about 12 hours at the full size.

python benchmarks/huge.py [--size 34000x22000] [--small 3520x2272] [--folder FOLDER] [--no-commands]
                          [--method full|pooled] [--denoise none|oidn|oidn-fast|oidn-high] [--formats tif zarr]
                          [--commands-only]

The print preset's optics (60 lenses per inch at 720 pixels per inch), the teapot, direct light, 1 sample per pixel,
into a tiled BigTIFF and into Zarr, by ``full`` or with pooled or denoised light, whose tiles overlap
(``results/huge.json``, or ``huge_METHOD_DENOISE.json``); then every command that reads a picture, on what was written
(``results/huge_commands.json``).
Each step is a process of its own, whose peak memory and processor time the system tells. The small picture is rendered
before and after each large one, so that both see the same machine; the scene grows with the panel, and with it the
viewing distance and that at which rays begin, so that both see the same scene.

With ``--commands-only`` the commands alone, on the small picture's pixels again and again.

Targets: at most 3 GB; time per pixel within 15 % of the small picture's.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import huge_commands
from harness import save

MEMORY = 2 * 10**9
TARGET_BYTES, TARGET_RELATIVE = 3e9, 1.15


def main() -> None:
    options = _options()
    large, small = (tuple(int(side) for side in size.split("x")) for size in (options.size, options.small))
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder = Path(name)
        if options.commands_only:
            for ending in ("tif", "zarr"):
                _rendered(folder / f"small.{ending}", small, small, ("full", "none"))
            huge_commands.repeat(folder, (large[0], large[1]))
            _save_commands(folder, large, small)
            return
        results: dict[str, Any] = {
            "size": large,
            "small": small,
            "memory_limit": MEMORY,
            "target_peak_bytes": TARGET_BYTES,
            "target_relative": TARGET_RELATIVE,
            "method": options.method,
            "denoise": options.denoise,
            "renders": {
                ending: _compared(folder, ending, large, small, (options.method, options.denoise))
                for ending in options.formats
            },
        }
        plain = (options.method, options.denoise) == ("full", "none")
        save("huge" if plain else f"huge_{options.method}_{options.denoise}", results)
        if options.commands:
            _save_commands(folder, large, None)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("--size", default="34000x22000")
    parser.add_argument("--small", default="3520x2272")
    parser.add_argument("--folder", default=None, help="where there is room for twice the picture")
    parser.add_argument("--no-commands", dest="commands", action="store_false")
    parser.add_argument("--commands-only", action="store_true")
    parser.add_argument("--method", default="full", choices=("full", "pooled"))
    parser.add_argument("--denoise", default="none", choices=("none", "oidn", "oidn-fast", "oidn-high"))
    parser.add_argument("--formats", nargs="+", default=["tif", "zarr"], choices=("tif", "zarr"))
    found = parser.parse_args()
    if found.commands and len(found.formats) < 2:
        parser.error("the commands read both formats: add --no-commands")
    return found


def _save_commands(folder: Path, large: tuple[int, ...], repeated: tuple[int, ...] | None) -> None:
    found = huge_commands.measured(folder)
    save("huge_commands", {"size": large, "repeated": repeated, "target_peak_bytes": TARGET_BYTES, "commands": found})


def _compared(
    folder: Path, ending: str, large: tuple[int, ...], small: tuple[int, ...], method: tuple[str, str]
) -> dict[str, Any]:
    before = _rendered(folder / f"small.{ending}", small, small, method)
    found = _rendered(folder / f"large.{ending}", large, small, method)
    after = _rendered(folder / f"small2.{ending}", small, small, method)
    path = folder / f"large.{ending}"
    files = [path] if path.is_file() else [part for part in path.rglob("*") if part.is_file()]
    ratios = {
        kind: 2 * found[kind] / (before[kind] + after[kind])
        for kind in ("nanoseconds_per_pixel", "cpu_nanoseconds_per_pixel")
    }
    return {
        **found,
        "bytes": sum(part.stat().st_size for part in files),
        "small": [before, after],
        "relative_to_small": ratios["nanoseconds_per_pixel"],
        "cpu_relative_to_small": ratios["cpu_nanoseconds_per_pixel"],
    }


def _rendered(output: Path, size: tuple[int, ...], small: tuple[int, ...], method: tuple[str, str]) -> dict[str, Any]:
    figures = output.with_name("figures.json")
    numbers = [str(number) for number in (*size, small[0], MEMORY)]
    script = str(Path(__file__).with_name("huge_render.py"))
    usage = huge_commands.run([sys.executable, script, *numbers, str(output), str(figures), *method])
    return {**json.loads(figures.read_text()), **usage}


if __name__ == "__main__":
    main()
