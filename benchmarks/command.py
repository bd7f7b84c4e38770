"""Whole commands as a user types them: seconds from start to exit, warm caches, medians.

Time on two cores: an estimated minute.

Targets: the teapot at 512 x 512 with direct light in at most 3 s; ``--help`` and ``import lippmann`` in at most 0.3 s.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from harness import interleaved, save, summary


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "teapot.png"
        lippmann = [sys.executable, "-c", "from lippmann.cli import main; main()"]
        commands = {
            "render": [*lippmann, "render", "teapot", "--integrator", "direct", "--spp", "1", "-q", "-o", str(out)],
            "help": [*lippmann, "--help"],
            "import": [sys.executable, "-c", "import lippmann"],
            "python": [sys.executable, "-c", "pass"],
        }
        candidates = {
            name: (lambda _, command=command: subprocess.run(command, check=True, capture_output=True))
            for name, command in commands.items()
        }
        seconds = interleaved(candidates, runs=7, warm_up=2)
    save(
        "command",
        {
            "seconds": {name: summary(values) for name, values in seconds.items()},
            "targets": {"render": 3.0, "help": 0.3, "import": 0.3},
        },
    )


if __name__ == "__main__":
    main()
