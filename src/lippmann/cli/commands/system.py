"""``lippmann doctor`` and ``lippmann displays``."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.shared import options
from lippmann.cli.shared.console import Console

if TYPE_CHECKING:
    from lippmann.runtime.engine import Check, Diagnosis


def doctor(
    fix: Annotated[
        bool,
        typer.Option(
            "--fix",
            help="Install the LLVM runtime if it is missing, where that needs no rights beyond this process's own; "
            "else print the command.",
        ),
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Check the rendering engine of this machine and say how to fix what is missing."""
    from lippmann.runtime import engine

    diagnosis = engine.diagnose()
    if fix and not diagnosis.ok:
        diagnosis = _fixed(diagnosis, Console(as_json=as_json))
    width = max(len(check.name) for check in diagnosis.checks)
    lines = []
    for check in diagnosis.checks:
        lines.append(f"{_mark(check)} {check.name:<{width}}  {check.value}")
        if check.fix:
            lines.append(f"{'':<{width + 4}} -> {check.fix}")
    verdict = "ready to render" if diagnosis.ok else "not ready to render"
    checks = [asdict(check) for check in diagnosis.checks]
    Console(as_json=as_json).result({"ok": diagnosis.ok, "checks": checks}, "\n".join([*lines, verdict]))
    raise typer.Exit(0 if diagnosis.ok else 1)


def _fixed(diagnosis: Diagnosis, console: Console) -> Diagnosis:
    """Install what is missing, or say how; the diagnosis afterwards."""
    import os

    from lippmann.runtime import engine, llvm, llvm_install

    if all(check.ok for check in diagnosis.checks if check.name == "LLVM"):
        console.remark("no package to install would mend this; the check below says what does")
        return diagnosis
    if os.environ.get(llvm.PATH_VARIABLE):
        console.remark(f"unset {llvm.PATH_VARIABLE}, or correct it: no other library is considered")
        return diagnosis
    remedy = llvm_install.remedy(llvm.OLDEST, llvm.NEWEST_TRIED)
    if remedy.obstacle:
        console.remark(f"{remedy.obstacle}. Do this: {remedy.text}")
        return diagnosis
    console.remark(f"running: {' '.join(remedy.command)}")
    problem = llvm_install.run(remedy)
    if problem:
        console.remark(f"{problem}. Do this: {remedy.text}")
    return engine.diagnose()


def _mark(check: Check) -> str:
    if check.ok:
        return "ok "
    return "!! " if check.needed else "-  "


def displays(as_json: options.Json = False) -> None:
    """List the bundled displays."""
    from lippmann.display import list_displays

    rows = [display.summary() for display in list_displays()]
    header = {
        "name": "name",
        "pixels": "pixels",
        "lenses": "lenses",
        "pixels_per_lens": "pixels/lens",
        "field_of_view": "field",
        "depth": "depth behind/in front",
        "title": "",
    }
    table = [header, *({key: _cell(key, row) for key in header} for row in rows)]
    widths = {key: max(len(line[key]) for line in table) for key in header}
    lines = ["  ".join(line[key].ljust(widths[key]) for key in header).rstrip() for line in table]
    Console(as_json=as_json).result({"displays": rows}, "\n".join(lines))


def _cell(key: str, row: dict[str, Any]) -> str:
    if key == "pixels":
        return "x".join(str(count) for count in row["pixels"])
    if key == "lenses":
        columns, rows = row["lenses"]
        return str(columns) if row["layout"] == "lenticular" else f"{columns}x{rows}"
    if key == "pixels_per_lens":
        across, down = row["pixels_per_lens"]
        return f"{across:.3g}" if down is None else f"{across:.3g}x{down:.3g}"
    if key == "field_of_view":
        return f"{row['field_of_view']:.1f} deg"
    if key == "depth":
        front, back = row["depth_budget"]
        return f"{-back:.0f}/{front:.0f} mm"
    return str(row[key])
