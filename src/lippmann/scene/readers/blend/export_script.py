"""Run by Blender over one file: ``blender FILE --python export_script.py -- REQUEST``; never imported.

REQUEST is JSON: ``out``, the folder to write into; ``folder``, outside which the file may name nothing (null: it may);
``is_animated``; ``open``, the file for Blender's Python module to open (null where the program opened it). An
``outcome.json`` beside the scene tells how it went.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bpy

# At the end of the path, and for ``in_blender`` alone.
sys.path.append(str(Path(__file__).resolve().parent))


def main(request: dict[str, Any]) -> None:
    """Do what the request says; what went wrong is told by ``outcome.json``, and by the exit status."""
    out = Path(request["out"])
    try:
        outcome = _export(request, out)
    except Exception as error:  # noqa: BLE001  # the exporter raises errors of all kinds
        outcome = {"error": " ".join(str(error).split())[-400:] or type(error).__name__}
    (out / "outcome.json").write_text(json.dumps(outcome), encoding="utf-8")
    if "error" in outcome:
        sys.exit(1)


def _export(request: dict[str, Any], out: Path) -> dict[str, Any]:
    from in_blender.export import export_scene  # type: ignore[import-not-found]  # on the path of Blender's Python
    from in_blender.outside import first_outside  # type: ignore[import-not-found]

    if request["open"] is not None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.open_mainfile(filepath=request["open"], load_ui=False, use_scripts=False)
    if not bpy.data.filepath:
        return {"error": "it cannot be opened"}
    if request["folder"] is not None:
        outside = first_outside(Path(request["folder"]))
        if outside is not None:
            return {"outside": outside, "error": "outside"}
    exported = export_scene(out, is_animated=request["is_animated"])
    return {
        "world": exported.world is not None,
        "camera": exported.camera,
        "exposure": exported.exposure,
        "notes": list(exported.notes),
    }


if __name__ == "__main__":
    main(json.loads(sys.argv[-1]))
