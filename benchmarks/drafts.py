"""What asking for less takes: whole cold commands with a draft or a modest quality, by processor time.

Time on two cores: about 10 minutes.

``python benchmarks/drafts.py``
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from harness import save

PICTURES = (
    ("teapot", "looking-glass-portrait"),
    ("teapot", "seed-lenticular"),
    ("tree", "seed-lenticular"),
    ("gears", "mla-square"),
)
ASKED = {"nothing": (), "draft": ("--effort", "draft"), "30 dB": ("--quality", "30")}
LIPPMANN = (sys.executable, "-c", "from lippmann.cli import main; main()")


def main() -> None:
    pictures = []
    for scene, display in PICTURES:
        asked = {name: _render(scene, display, words) for name, words in ASKED.items()}
        pictures.append({"scene": scene, "display": display, "asked": asked})
        save("drafts", {"pictures": pictures})


def _render(scene: str, display: str, words: tuple[str, ...]) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        out = ("-o", str(Path(folder) / "a.png"), "--json", "--integrator", "path")
        before = _processor_seconds()
        done = subprocess.run(
            [*LIPPMANN, "render", scene, "--display", display, *words, *out], check=True, capture_output=True
        )
        made = json.loads(done.stdout)
    estimate = made["estimate"]
    return {
        "seconds": _processor_seconds() - before,
        "spp": made["spp"],
        "psnr": None if estimate is None else estimate["psnr"],
    }


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
