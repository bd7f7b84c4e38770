"""Scenes of Mitsuba's are loaded once in a child process before this one loads them.

Mitsuba trusts its files: indices beyond a mesh's vertices read foreign memory, and damaged ones end the process.
"""

from __future__ import annotations

import json
import os
import select
import subprocess
from contextlib import suppress
from dataclasses import dataclass

from lippmann.errors import SceneError
from lippmann.runtime.child_python import python_command
from lippmann.runtime.machine import input_memory_left
from lippmann.scene.mitsuba_trial_child import LENGTH

_CODE = "from lippmann.scene.mitsuba_trial_child import main; main()"
#: Seconds that loading a scene may take.
MOST_SECONDS = 600.0
_FIX = "are all files whole that the scene names?"


@dataclass(frozen=True, eq=False)
class _Child:
    """The child process, and the process that started it: a fork of that does not share it."""

    process: subprocess.Popen[bytes]
    parent: int


class RefusedSceneError(Exception):
    """Mitsuba's own words for what is wrong with a scene."""


_child: _Child | None = None


def try_scene(text: str, variant: str, where: str) -> None:
    """Have a child process load a scene.

    Parameters
    ----------
    text:
        XML of the scene, with absolute paths.
    variant:
        The variant that will load it.
    where:
        What messages call the scene.

    Raises
    ------
    RefusedSceneError
        Mitsuba refuses the scene, in its own words.
    SceneError
        The scene ends the process that loads it, takes more than the free memory or :data:`MOST_SECONDS`, or holds a
        mesh whose triangles name vertices that it does not have.
    """
    request = json.dumps({"variant": variant, "text": text, "memory": input_memory_left()}).encode()
    answer = _ask(LENGTH.pack(len(request)) + request)
    if answer is None:
        raise SceneError(f"Mitsuba takes more than {MOST_SECONDS:g} s to load the scene", where=where, fix=_FIX)
    if isinstance(answer, int):
        end = f"signal {-answer}" if answer < 0 else f"exit status {answer}"
        raise SceneError(f"Mitsuba breaks down at the scene ({end})", where=where, fix=_FIX)
    found = json.loads(answer)
    if "refusal" in found:
        raise RefusedSceneError(found["refusal"])
    if "fault" in found:
        raise SceneError(f"Mitsuba would be misled: {found['fault']}", where=where, fix=_FIX)


def _ask(request: bytes) -> bytes | int | None:
    """The child's answer; its exit status if it ended over the question, None if it takes too long."""
    while True:
        process, is_new = _running()
        answer = _answer(process, request)
        if answer is None:
            _end(process)
            return None
        if answer:
            return answer
        status = process.wait()
        _end(process)
        if status or is_new:  # else it had nothing to do for a while, and ended just now
            return status


def _answer(process: subprocess.Popen[bytes], request: bytes) -> bytes | None:
    """A line, empty from a process that ended; None if it takes too long."""
    assert process.stdin is not None
    assert process.stdout is not None
    with suppress(BrokenPipeError):
        process.stdin.write(request)
        process.stdin.flush()
    if os.name != "nt" and not select.select([process.stdout], [], [], MOST_SECONDS)[0]:
        return None
    return process.stdout.readline()


def _running() -> tuple[subprocess.Popen[bytes], bool]:
    """The child, and whether it was started for this."""
    global _child
    if _child is not None and _child.parent == os.getpid():
        if _child.process.poll() is None:
            return _child.process, False
        _end(_child.process)
    command, environment = python_command(_CODE)
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
    )
    _child = _Child(process, os.getpid())
    return process, True


def _end(process: subprocess.Popen[bytes]) -> None:
    global _child
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        assert pipe is not None
        with suppress(BrokenPipeError):  # what was asked last did not reach it
            pipe.close()
    _child = None
