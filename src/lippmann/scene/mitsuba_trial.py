"""Scenes of Mitsuba's are loaded once in a child process before this one loads them.

Mitsuba trusts its files: indices beyond a mesh's vertices read foreign memory, and damaged ones end the process.
"""

from __future__ import annotations

import json

from lippmann.errors import SceneError
from lippmann.runtime.helper_process import HelperEndedError, HelperProcess
from lippmann.runtime.machine import input_memory_left

#: Seconds that loading a scene may take.
_MOST_SECONDS = 600.0
_FIX = "are all files whole that the scene names?"

_process = HelperProcess("from lippmann.scene.mitsuba_trial_child import main; main()", _MOST_SECONDS)


class RefusedSceneError(Exception):
    """Mitsuba's own words for what is wrong with a scene."""


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
        The scene ends the process that loads it, takes more than the free memory or ten minutes, or holds a mesh whose
        triangles name vertices that it does not have.
    """
    request = json.dumps({"variant": variant, "text": text, "memory": input_memory_left()}).encode()
    try:
        answer = json.loads(_process.ask(request, where=where))
    except HelperEndedError as error:
        raise SceneError(f"Mitsuba breaks down at the scene ({error})", where=where, fix=_FIX) from None
    if "refusal" in answer:
        raise RefusedSceneError(answer["refusal"])
    if "fault" in answer:
        raise SceneError(f"Mitsuba would be misled: {answer['fault']}", where=where, fix=_FIX)
