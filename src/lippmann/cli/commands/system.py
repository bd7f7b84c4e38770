"""``lippmann doctor`` and ``lippmann displays``."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

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
    """Check the rendering engine of this machine, say how to fix what is missing, and list plugins."""
    from lippmann.plugins import Reader, installed
    from lippmann.runtime import engine

    diagnosis = engine.diagnose()
    if fix and not diagnosis.ok:
        diagnosis = _fix(diagnosis, Console(as_json=as_json))
    width = max(len(check.name) for check in diagnosis.checks)
    lines = []
    for check in diagnosis.checks:
        lines.append(f"{_mark(check)} {check.name:<{width}}  {check.value}")
        if check.fix:
            lines.append(f"{'':<{width + 4}} -> {check.fix}")
    plugins = []
    for group, plugin in installed():
        settings = dict(plugin.extension.settings) if isinstance(plugin.extension, Reader) else {}
        plugins.append(
            {
                "group": group,
                "name": plugin.name,
                "distribution": plugin.distribution,
                "claims": list(plugin.claims),
                "options": settings,
                "problem": plugin.problem,
            }
        )
        options_said = f"; options: {', '.join(f'{name}={value}' for name, value in settings.items())}" * bool(settings)
        said = plugin.problem or ", ".join(plugin.claims) + options_said
        lines.append(f"{'!! ' if plugin.problem else 'ok '} plugin {plugin} ({group}): {said}")
    verdict = "ready to render" if diagnosis.ok else "not ready to render"
    checks = [asdict(check) for check in diagnosis.checks]
    result = {"ok": diagnosis.ok, "checks": checks, "plugins": plugins}
    Console(as_json=as_json).result(result, "\n".join([*lines, verdict]))
    raise typer.Exit(0 if diagnosis.ok else 1)


def _fix(diagnosis: Diagnosis, console: Console) -> Diagnosis:
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

    presets = list_displays()
    table = [display.in_words() for display in presets]
    columns = [[name, *(row[name] for row in table)] for name in table[0]]
    padded = [[text.ljust(max(map(len, column))) for text in column] for column in columns]
    lines = ["  ".join(row).rstrip() for row in zip(*padded, strict=True)]
    result = {"displays": [display.summary() for display in presets]}
    Console(as_json=as_json).result(result, "\n".join(lines))
