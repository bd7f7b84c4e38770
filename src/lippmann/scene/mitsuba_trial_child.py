"""The process in which Mitsuba loads a scene for the first time: what brings it down ends nothing else."""

from __future__ import annotations

import json
import re
from typing import Any

from lippmann.runtime.helper_process import limit_memory, serve

#: C++ messages of a lack of memory, within Mitsuba's.
NO_ROOM = re.compile("bad_alloc|bad_array_new_length|length_error")
NO_MEMORY = "more memory than there is would be needed"


def main() -> None:
    """Answer requests, JSON with ``variant``, ``text`` of a scene, and ``memory`` in bytes that may be taken."""
    serve(_answer)


def _answer(data: bytes) -> bytes:
    request = json.loads(data)
    return json.dumps(_try(request["variant"], request["text"], request["memory"])).encode()


def _try(variant: str, text: str, memory: int) -> dict[str, str]:
    """Load a scene. Gives the ``fault`` of what Mitsuba takes, or its ``refusal`` in its own words; else nothing."""
    import gc

    import mitsuba as mi

    from lippmann.runtime.engine import search_package_alone

    limit_memory(memory)
    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)
    search_package_alone(mi)
    try:
        fault = fault_of_meshes(mi, mi.load_string(text))
        return {} if fault is None else {"fault": fault}
    except MemoryError:
        return {"fault": NO_MEMORY}
    except Exception as error:  # noqa: BLE001  # of all kinds, for a misspelt word
        # It may be refused here and bring the next process down: whoever asks does not load it.
        return {"fault": NO_MEMORY} if NO_ROOM.search(str(error)) else {"refusal": str(error) or type(error).__name__}
    finally:
        gc.collect()


def fault_of_meshes(mi: Any, scene: Any) -> str | None:
    """The fault in the triangles of a loaded scene, those of shape groups included; None if there is none."""
    import numpy as np

    values = mi.traverse(scene)
    for name in values.properties:
        if not name.endswith("faces"):
            continue
        vertices = len(values[name.removesuffix("faces") + "vertex_positions"]) // 3
        faces = np.asarray(values[name])
        if not len(faces):
            return "a mesh has no triangles"
        if faces.max() >= vertices:
            return f"a mesh names vertex {int(faces.max())}; it has {vertices}"
    return None
