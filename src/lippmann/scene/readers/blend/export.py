"""Blender exports a file into a folder, in a process of its own."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lippmann.errors import SceneError
from lippmann.runtime.child_python import python_command
from lippmann.scene.parsing.files import NamedFiles, read_bytes
from lippmann.scene.readers.blend.find_blender import find_blender

#: Seconds that an export may take.
MOST_SECONDS = 600.0

_SCRIPT = Path(__file__).with_name("export_script.py")
_RUN = "import runpy, sys; runpy.run_path(sys.argv[1], run_name='__main__')"

#: First bytes of a file as it is, and compressed by Zstandard or gzip.
_BEGINNINGS = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")
#: Bytes of Blender's last words.
_LAST_WORDS = 1 << 14
_MOST_OUTCOME = 1 << 22


@dataclass(frozen=True)
class Exported:
    """Files that Blender wrote, and what it told of the scene.

    Attributes
    ----------
    scene, world:
        A GLB file; an equirectangular picture of the world's light, None of a world without any.
    camera:
        The name of the active camera; empty without one.
    exposure:
        Stops by which Blender raises its pictures of the scene.
    notes:
        Lines on what is left out.
    """

    scene: Path
    world: Path | None
    camera: str
    exposure: float
    notes: tuple[str, ...]


def export(path: Path, out: Path, named: NamedFiles, *, is_animated: bool = False) -> Exported:
    """Have Blender write the scene of a file into the folder ``out``.

    Scripts inside the file do not run. Blender reads its linked libraries before anything can be refused.

    Parameters
    ----------
    named:
        The pictures and libraries that the file may name.
    is_animated:
        Write the frames of the scene as one animation; else its present frame.

    Raises
    ------
    SceneError
        There is no Blender, or none that is new enough; the file is missing, damaged, or names files outside its
        folder; Blender fails or takes too long.
    """
    where = path.name
    if not read_bytes(path, 8).startswith(_BEGINNINGS):
        raise SceneError("is no Blender file", where=where, rule="it begins with BLENDER, or is compressed")
    place = path.resolve()
    request: dict[str, Any] = {
        "out": str(out),
        "folder": None if named.anywhere else str(place.parent),
        "is_animated": is_animated,
        "open": None,
    }
    blender = find_blender(where)
    if blender is None:
        command, environment = python_command(_RUN, str(_SCRIPT), json.dumps({**request, "open": str(place)}))
    else:
        options = ["--background", "--factory-startup", "--disable-autoexec"]
        script = ["--python-exit-code", "1", "--python", str(_SCRIPT), "--", json.dumps(request)]
        command, environment = [blender, *options, str(place), *script], dict(os.environ)
    log = out / "log.txt"
    status = _run(command, environment, log, where)
    outcome = _outcome(out / "outcome.json", where)
    if outcome is None:
        reason = _last_words(log) or f"exit status {status}"
        raise SceneError(f"Blender fails at the file ({reason})", where=where, fix="does Blender open it?")
    if "outside" in outcome:
        raise SceneError(
            f"names the file '{outcome['outside']}' outside its folder",
            where=where,
            fix="pack it into the file (File > External Data), or trust the file: allow_outside=True",
        )
    if "error" in outcome:
        raise SceneError(f"Blender fails at the file ({outcome['error']})", where=where, fix="does Blender open it?")
    if not (out / "scene.glb").is_file():
        raise SceneError("Blender wrote no scene", where=where, fix="export it in Blender as glTF 2.0 (.glb)")
    world = out / "world.exr" if outcome["world"] else None
    return Exported(out / "scene.glb", world, outcome["camera"], outcome["exposure"], tuple(outcome["notes"]))


def _run(command: list[str], environment: dict[str, str], log: Path, where: str) -> int:
    """Run Blender, with all that it says in a file; the exit status."""
    with log.open("wb") as said:
        process = subprocess.Popen(
            command,
            env={**environment, "TMPDIR": str(log.parent)},  # its own temporary files go with ours
            cwd=log.parent,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=os.name != "nt",
        )
        try:
            return process.wait(MOST_SECONDS)
        except subprocess.TimeoutExpired:
            raise SceneError(
                f"Blender takes more than {MOST_SECONDS:g} s",
                where=where,
                fix="export it in Blender as glTF 2.0 (.glb), or make the scene simpler",
            ) from None
        finally:
            if process.poll() is None:
                _kill(process)


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End a process, and those that it started."""
    if hasattr(os, "killpg"):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.wait()


def _outcome(path: Path, where: str) -> dict[str, Any] | None:
    """The script's report; None if it wrote none that can be read."""
    if not path.is_file() or path.stat().st_size > _MOST_OUTCOME:
        return None
    try:
        outcome = json.loads(read_bytes(path))
    except (ValueError, RecursionError, SceneError):
        return None
    if not isinstance(outcome, dict):
        return None
    if "error" in outcome or "outside" in outcome:
        return {key: str(value) for key, value in outcome.items()}
    notes = outcome.get("notes")
    notes = [str(line) for line in notes] if isinstance(notes, list) else []
    exposure = outcome.get("exposure")
    return {
        "world": bool(outcome.get("world")),
        "camera": str(outcome.get("camera", "")),
        "exposure": exposure if isinstance(exposure, float) and math.isfinite(exposure) else 0.0,
        "notes": notes,
    }


def _last_words(log: Path) -> str:
    """The last line of Blender's that tells of an error, or the last one at all."""
    with log.open("rb") as said:
        said.seek(max(0, log.stat().st_size - _LAST_WORDS))
        lines = [line.strip() for line in said.read().decode(errors="replace").splitlines()]
    lines = [line for line in lines if line and line != "Blender quit"]
    errors = [line for line in lines if "error" in line.lower()]
    return (errors or lines or [""])[-1][:300]
