"""Pictures with nothing but a scene and a display named: an earlier checkout and this one side by side.

Time on two cores: an estimated half hour with three runs.

python benchmarks/defaults.py OTHER [--today CHECKOUT] [--scenes NAME...] [--displays NAME...] [--runs N]

``OTHER`` is the folder of an earlier checkout; its own ``.venv`` runs it if there is one, else this Python does. Each
picture is a whole command in a process of its own, whose kernels are compiled; the two take turns. Measured are
processor time and the clock's of the whole tree of processes, the largest one's peak memory, and in a further run the
modules and the program's files that it loads. The PSNR is that of pixels all over the panel against a long plain
rendering of these by the same checkout, which is made twice, so that its own error is known. Scenes and references are
kept in ``--cache``.
Writes ``benchmarks/results/defaults.json``, where rows of other scenes and displays stay.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import defaults_scenes
from harness import median_ratio, save, saved

HERE = Path(__file__).resolve().parent.parent
BUNDLED = ("teapot", "room", "small-balls", "primitives", "tree", "gears")
DISPLAYS = ("seed-lenticular", "mla-square", "looking-glass-portrait", "panel-4k")
#: Pixels all over the panel that are judged, and samples of each half of their reference.
JUDGED, REFERENCE_SAMPLES = 3000, 1024
#: Commands that are timed beside the pictures.
COMMANDS = {"--help": ["--help"], "preview teapot": ["preview", "teapot", "-q", "-o", "{out}"]}

_PROGRAM = "from lippmann.cli import main; main()"
#: The same, with what is loaded in the end as JSON in the file that the last word names.
_COUNTING = (
    """
import atexit, json, sys
file = sys.argv.pop()
@atexit.register
def count():
    own = [name for name in sys.modules if name.split(".")[0] == "lippmann"]
    with open(file, "w") as out:
        json.dump({"modules": len(sys.modules), "files": len(own)}, out)
"""
    + _PROGRAM
)

#: Runs a command and prints its figures. A process of its own: a child's peak is at least that of who starts it.
_TIMING = """
import json, os, sys, time
started = time.perf_counter()
_, status, usage = os.wait4(os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ), 0)
figures = {"wall": time.perf_counter() - started, "cpu": usage.ru_utime + usage.ru_stime}
print(json.dumps({**figures, "peak": usage.ru_maxrss * 1024, "code": status}))
"""


@dataclass(frozen=True)
class Checkout:
    """A folder of the program's source and the Python that runs it."""

    folder: Path

    def run(self, program: str, words: list[str]) -> dict[str, float]:
        """Run one command; seconds of the clock, of the processors, and the peak of its memory in bytes."""
        command = [sys.executable, "-S", "-c", _TIMING, self._python(), "-c", program, *words]
        done = subprocess.run(command, env=self._environment(), capture_output=True, text=True, check=True)
        figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
        if figures.pop("code"):
            raise RuntimeError(f"{' '.join(words)}: {done.stderr.strip()}")
        return figures

    def trace_reference(self, scene: str, display: str, file: Path) -> None:
        """Write the long rendering that this checkout's pictures are judged by."""
        unfinished = file.with_suffix(".part.npz")
        script = Path(__file__).parent / "defaults_reference.py"
        words = [str(script), scene, display, str(JUDGED), str(REFERENCE_SAMPLES), str(unfinished)]
        subprocess.run([self._python(), *words], env=self._environment(), check=True)
        unfinished.replace(file)

    def _python(self) -> str:
        own = self.folder / ".venv" / "bin" / "python"
        return str(own) if own.exists() else sys.executable

    def _environment(self) -> dict[str, str]:
        environment = {**os.environ, "PYTHONPATH": str(self.folder.resolve() / "src")}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)  # Python keeps compiled modules, as for a user
        return environment

    def commit(self) -> str:
        found = subprocess.run(
            ["git", "-C", str(self.folder), "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True
        )
        return found.stdout.strip()


def measure(checkouts: dict[str, Checkout], words: list[str], out: Path, runs: int) -> dict[str, Any]:
    """Figures of one command by checkout, and their ratios; pictures lie beside ``out``, the checkout's name before."""
    timed: dict[str, list[dict[str, float]]] = {name: [] for name in checkouts}
    loaded = {}
    for turn in range(-1, runs):
        for name, checkout in checkouts.items():
            picture = out.with_stem(f"{name}_{out.stem}")
            said = [word.format(out=picture) for word in words]
            counts = out.with_suffix(".json")
            program, more = (_COUNTING, [str(counts)]) if turn < 0 else (_PROGRAM, [])
            figures = checkout.run(program, said + more)
            if turn < 0:  # which also warms the caches
                loaded[name] = json.loads(counts.read_text())
            else:
                timed[name].append(figures)
    result: dict[str, Any] = {
        name: {key: statistics.median(one[key] for one in rows) for key in rows[0]} | loaded[name]
        for name, rows in timed.items()
    }
    result["ratios"] = {
        key: median_ratio(*([one[key] for one in timed[name]] for name in ("today", "other")))
        for key in ("wall", "cpu", "peak")
    }
    return result


class Reference:
    """Long renderings of pixels of one scene on one display by one checkout, at an exposure of 0."""

    def __init__(self, checkout: Checkout, scene: str, display: str, file: Path) -> None:
        if not file.exists():
            checkout.trace_reference(scene, display, file)
        with np.load(file) as values:
            self.columns, self.rows, self.halves = values["columns"], values["rows"], values["halves"]

    def judge(self, file: Path) -> dict[str, Any]:
        """PSNR of a picture in dB, what it states of itself, and the reference's own PSNR as the picture shows it."""
        import lippmann
        from lippmann.color.transfer import encode_srgb, pbr_neutral

        image = lippmann.read_picture(file)
        options = image.provenance.options
        stops = options.get("exposure", 0.0)

        def shown(radiance: NDArray[Any]) -> NDArray[Any]:
            light = radiance * 2.0 ** (stops if isinstance(stops, (int, float)) else 0.0)
            return encode_srgb(pbr_neutral(light) if options.get("tone_map") == "pbr-neutral" else light)

        picture = encode_srgb(image.pixels)[self.rows, self.columns]
        a, b = (shown(half) for half in self.halves)
        estimate = image.provenance.estimate or {}
        return {
            "psnr": psnr(picture - shown(self.halves.mean(axis=0))),
            "reference_psnr": psnr((a - b) / 2),
            "stated_psnr": estimate.get("psnr"),
            "spp": image.provenance.spp,
            "method": image.provenance.method,
        }


def psnr(difference: NDArray[Any]) -> float:
    return float(-10 * np.log10(max(np.mean(np.square(difference, dtype=np.float64)), 1e-12)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path)
    parser.add_argument("--today", type=Path, default=HERE)
    parser.add_argument("--scenes", nargs="*", help="bundled scenes, downloaded and made ones by name; default all")
    parser.add_argument("--displays", nargs="*", default=DISPLAYS)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--cache", type=Path, default=Path.home() / ".cache" / "lippmann-benchmarks")
    options = parser.parse_args()
    files, missing = defaults_scenes.scenes(options.cache)
    named: dict[str, str] = {name: name for name in BUNDLED} | {name: str(path) for name, path in files.items()}
    wanted = list(named) + list(missing) if options.scenes is None else options.scenes
    if unknown := set(wanted) - set(named) - set(missing):
        raise SystemExit(f"no such scene: {', '.join(sorted(unknown))}; there are: {', '.join(named)}")
    checkouts = {"other": Checkout(options.other), "today": Checkout(options.today)}
    commits = {name: checkout.commit() for name, checkout in checkouts.items()}
    last = saved("defaults")
    rows = [row for row in last.get("rows", []) if row["commits"] == commits]

    def add(row: dict[str, Any]) -> None:
        rows[:] = [old for old in rows if (old["scene"], old["display"]) != (row["scene"], row["display"])]
        rows.append({**row, "commits": commits, "runs": options.runs})
        print(row["scene"], row["display"], json.dumps(row["ratios"]), flush=True)
        save("defaults", {"missing": missing, "rows": rows}, show=False)

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "picture.png"
        for name, words in COMMANDS.items():
            add({"scene": name, "display": "", **measure(checkouts, words, out, options.runs)})
        for display in options.displays:
            for name in wanted:
                if name in missing:
                    print(f"{name}: left out, {missing[name]}", file=sys.stderr)
                    continue
                words = ["render", named[name], "-d", display, "-q", "-o", "{out}"]
                row = measure(checkouts, words, out, options.runs)
                for side, checkout in checkouts.items():
                    kept = f"{name.replace(' ', '_')}_{display}_{REFERENCE_SAMPLES}_{commits[side]}.npz"
                    reference = Reference(checkout, named[name], display, options.cache / kept)
                    row[side] |= reference.judge(out.with_stem(f"{side}_{out.stem}"))
                add({"scene": name, "display": display, "seen": name in BUNDLED, **row})


if __name__ == "__main__":
    main()
