"""The process that opens stages: native code that damaged files may bring down, with nothing else in it."""

from __future__ import annotations

import json
import os
import re

from pxr import Sdf, Usd, UsdGeom

from lippmann.runtime.helper_process import limit_memory, serve
from lippmann.scene.readers.usd.records import Arrays, Record, pack
from lippmann.scene.readers.usd.stage_layers import StageError, check_layers, choose_variants, used_files
from lippmann.scene.readers.usd.stage_shading import declare_outputs
from lippmann.scene.readers.usd.stage_traversal import Traversal

#: C++ messages of a lack of memory.
_NO_ROOM = re.compile("bad_alloc|bad_array_new_length|length_error")

#: The stage that was asked for last, with what it was opened by: frames of a sequence share it.
_opened: dict[str, Usd.Stage] = {}


def main() -> None:
    """Answer requests, each a JSON object; see :func:`lippmann.scene.readers.usd.process.ask_stage`."""
    serve(_answer)


def _answer(data: bytes) -> bytes:
    request = json.loads(data)
    limit_memory(request["memory"])
    arrays = Arrays()
    try:
        return pack(_read(request, arrays), arrays)
    except StageError as error:
        tree: Record = {"error": {"what": error.what, "rule": error.rule, "fix": error.fix}}
    except Exception as error:  # noqa: BLE001  # USD raises errors of many kinds, for values of a wrong type too
        words = _words(error, request["path"])
        if isinstance(error, MemoryError) or _NO_ROOM.search(words):
            tree = {"error": {"what": "takes more memory than is left", "rule": "", "fix": "allow more: memory=..."}}
        else:
            tree = {"error": {"what": f"USD refuses it: {words}", "rule": "", "fix": ""}}
    _opened.clear()
    return pack(tree, Arrays())


def _words(error: Exception, path: str) -> str:
    """USD's own words without what names source files and lines of C++, and without the folder of the file."""
    try:
        said = " ".join(str(error).split())
    except UnicodeDecodeError:  # it quotes the file
        return "it holds text that is not UTF-8"
    message = said.rpartition(" : ")[2].strip("'\" ")
    return message.replace(os.path.join(os.path.dirname(path), ""), "")[:300]


def _read(request: Record, arrays: Arrays) -> Record:
    stage, notes = _open(request)
    rate = stage.GetTimeCodesPerSecond() or 24.0
    start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    has_range = stage.HasAuthoredTimeCodeRange()
    is_timed = has_range and end > start
    seconds = request["seconds"]
    if seconds is None:
        time = Usd.TimeCode(start) if has_range else Usd.TimeCode.EarliestTime()
    else:
        time = Usd.TimeCode(start + seconds * rate)
    traversal = Traversal(stage, time, arrays, notes)
    traversal.run()
    return {
        **traversal.tree(),
        # pxr's own call refuses a float, as Blender 2.8 and TinyUSDZ write it.
        "meters_per_unit": float(stage.GetMetadata(UsdGeom.Tokens.metersPerUnit)),
        "up": str(UsdGeom.GetStageUpAxis(stage)),
        "duration": (end - start) / rate if is_timed else 0.0,
        "moves": is_timed and _moves(stage),
        "files": used_files(stage),
        "notes": list(traversal.notes),
    }


def _moves(stage: Usd.Stage) -> bool:
    """Whether any value changes with time: many programs write a range of time codes in stages that stand still."""
    prims = (prim for root in (stage.GetPseudoRoot(), *stage.GetPrototypes()) for prim in Usd.PrimRange(root))
    return any(each.ValueMightBeTimeVarying() for prim in prims for each in prim.GetAuthoredAttributes())


def _open(request: Record) -> tuple[Usd.Stage, dict[str, None]]:
    key = json.dumps([request[name] for name in ("path", "stamp", "folder", "variants")])
    if key not in _opened:
        _opened.clear()
        layer = Sdf.Layer.FindOrOpen(request["path"])
        if layer is None:
            raise StageError("is no USD file", rule="its beginning is not that of one")
        layer.Reload()  # another file may have had this name
        held, missing = check_layers(request["path"], request["folder"])
        stage = Usd.Stage.Open(layer, Usd.Stage.LoadAll)
        stage.held_layers, stage.missing_layers = held, missing
        choose_variants(stage, request["variants"])
        declare_outputs(stage)
        _opened[key] = stage
    stage = _opened[key]
    return stage, dict.fromkeys(stage.missing_layers)
