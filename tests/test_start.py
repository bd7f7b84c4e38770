"""What common commands load: Python takes longer to load modules than to trace a small picture."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

PROGRAM = """
import atexit, json, sys
file = sys.argv.pop()
atexit.register(lambda: json.dump(sorted(sys.modules), open(file, "w")))
from lippmann.cli import main
main()
"""

#: Packages beside Python's own that each command may load, and the most modules of this program. Raised by hand alone:
#: first see whether a module is needed before the command uses it.
HELP = {"annotated_doc", "lippmann", "shellingham", "typer"}
RENDER = HELP | {"cython_runtime", "drjit", "imagecodecs", "mitsuba", "numpy"}
BUDGETS = {
    "--help": (HELP, 21),
    "preview teapot": (RENDER, 197),
    "render teapot": (RENDER, 202),
    "render model.glb": (RENDER, 226),
}


def loaded(words, folder):
    """The modules that a command has loaded in the end."""
    file = folder / "modules.json"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, "-W", "ignore", "-c", PROGRAM, *words, str(file)]
    subprocess.run(command, env=environment, cwd=folder, stdout=subprocess.DEVNULL, check=True)
    return json.loads(file.read_text())


@pytest.mark.slow
@pytest.mark.parametrize("command", BUDGETS)
def test_a_command_loads_no_more_than_it_may(command, tmp_path, cut_display, request):
    packages, most = BUDGETS[command]
    words = command.split()
    if words != ["--help"]:
        request.getfixturevalue("engine")
        words += ["-q", "-o", "picture.png"]
    if "render" in words:
        words += ["-d", str(cut_display(96, 96))]
    if "model.glb" in words:
        import trimesh

        trimesh.creation.box().export(tmp_path / "model.glb")
    modules = loaded(words, tmp_path)
    tops = {name.partition(".")[0] for name in modules}
    ours = [name for name in modules if name.partition(".")[0] == "lippmann"]
    # Others begin with an underline: parts of compiled modules.
    newcomers = {name for name in tops - sys.stdlib_module_names - packages if not name.startswith("_")}
    assert not newcomers, f"{command} loads {sorted(newcomers)}"
    assert len(ours) <= most, f"{command} loads {len(ours)} modules of this program, {most} are allowed: {ours}"
