"""Rendering tile by tile: pictures that are resumed, or larger than memory."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.console import Console
from lippmann.errors import UsageError
from lippmann.progress import Progress, ProgressCallback

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.render.tiled_picture import Rendered, Runner

Resume = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Keep finished tiles beside the output, and go on with those (of a sequence: with the frames) that an "
        "interrupted run left. See docs/large-pictures.md.",
    ),
]

#: What places the display, by the names of ``PlacementOptions``.
_PLACEMENT = {
    "place": "mode",
    "camera": "camera",
    "turn": "turn",
    "shift": "shift",
    "scale": "scale",
    "pop_out": "pop_out",
}
#: What only renderers of whole pictures know; refused where it is asked for.
_WHOLE = {"order": "--order", "respect_gloss": "--respect-gloss"}


def is_tiled(output: Path, bits: int | None, display: Display, *, resume: bool, **asked: Any) -> bool:
    """Whether a picture has to be rendered in tiles: where that is asked for, or is the only way.

    ``asked``: method, denoise, subpixels and memory, as those of :class:`~lippmann.render.settings.RenderSettings`.
    """
    from lippmann.image.formats import format_for
    from lippmann.render.pipeline import default_memory
    from lippmann.render.settings import RenderSettings
    from lippmann.render.tiled_picture import fits_whole

    name, _ = format_for(output, bits)
    if resume or name == "zarr":
        return True
    settings = RenderSettings(**asked)
    return name == "tiff" and not fits_whole(display, settings, settings.memory or default_memory())


@contextmanager
def _kept(output: Path, console: Console) -> Iterator[ProgressCallback]:
    """The console's progress; whatever ends the work once tiles are rendered, say what is left of it."""
    from lippmann.store.journal import journal_of

    has_begun = False

    def watching(report: Progress) -> None:
        nonlocal has_begun
        has_begun = has_begun or report.stage == "tiles"
        progress(report)

    try:
        with console.progress() as progress:
            yield watching
    except BaseException:
        if has_begun:
            console.remark(f"finished tiles are kept in {journal_of(output).name}: with --resume the command goes on")
        raise


def render_tiled(
    scene: str,
    output: Path,
    console: Console,
    *,
    display: Display,
    bits: int | None,
    resume: bool,
    load: Mapping[str, Any],
    runner: Runner | None = None,
    **asked: Any,
) -> Rendered:
    """Render into a file tile by tile, and say what came of it."""
    from lippmann import api
    from lippmann.cli.rendering import remarks, report
    from lippmann.scene.placement import PlacementOptions

    for name, option in _WHOLE.items():
        if asked.pop(name) is not None:
            raise UsageError("is for methods that need the whole picture", where=option, fix="leave it out")
    placement = PlacementOptions(**{_PLACEMENT[name]: asked.pop(name) for name in list(asked) if name in _PLACEMENT})
    started = time.perf_counter()
    with _kept(output, console) as progress:
        loaded = api.load_scene(scene, **load)
        rendered = api.render_to_file(
            loaded,
            output,
            display,
            bits=bits,
            resume=resume,
            placement=placement,
            runner=runner,
            progress=progress,
            **asked,
        )
    made = rendered.provenance
    remarks(console, made)
    width, height = rendered.size
    values = report(output, rendered.size, made)
    values["tiles"] = {"made": rendered.tiles - rendered.resumed, "found": rendered.resumed}
    found = f", {rendered.resumed} of {rendered.tiles} tiles found" if rendered.resumed else ""
    console.result(
        values,
        f"{output}: {width}x{height} pixels for {display.name}, {made.spp} samples per pixel{found}, "
        f"{sum(made.rays.values()) / 1e6:.1f} M rays, {time.perf_counter() - started:.1f} s",
    )
    return rendered
