"""``lippmann proof``: what the lenses and pixels of a display will show, before anything is rendered or printed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.shared import options
from lippmann.cli.shared.console import Console


def proof(
    display: Annotated[
        str,
        typer.Argument(
            help="Display: a preset, a .toml file, a Looking Glass's visual.json, print:lpi=60,... or monitor:..."
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write a page with plots: a .html, .pdf or .png file.")
    ] = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Say what a display's lenses can show: directions, crosstalk, depth, field, viewing zone and moire."""
    from lippmann.display import load_display
    from lippmann.optics.proof import prove
    from lippmann.optics.proof_page import check_proof_page, write_proof_page

    console = Console(quiet, as_json)
    target = load_display(display)
    if output is not None:
        check_proof_page(output)
    measurements = prove(target)
    if output is not None:
        write_proof_page(measurements, target, output)
    lines = [f"{name:<13}{text}" for name, text in measurements.in_words().items()]
    console.result({**measurements.to_dict(), "output": None if output is None else str(output)}, "\n".join(lines))
