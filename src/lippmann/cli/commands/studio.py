"""``lippmann studio``, a display seen live while it is set up, and ``lippmann show``, a picture on its display."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.commands import view as viewing
from lippmann.cli.shared import options, parse
from lippmann.cli.shared.command_options import only, with_options
from lippmann.cli.shared.console import Console
from lippmann.errors import UsageError
from lippmann.options.option import changed_options
from lippmann.options.outputs import AccessOptions
from lippmann.options.quality import MachineOptions
from lippmann.options.scene import SceneOptions

if TYPE_CHECKING:
    from lippmann.studio_app.state import StudioState

Model = Annotated[
    str | None, typer.Argument(help="Scene file, or a bundled scene's name; by default the teapot.", show_default=False)
]
DisplayChoice = Annotated[
    str | None,
    typer.Option(
        "--display", "-d", "--target", help="Name, TOML file or short form of the display.", show_default=False
    ),
]
State = Annotated[
    Path | None, typer.Option("--state", help="State that the studio saved (.toml); options win over it.")
]
Folder = Annotated[Path, typer.Option("--folder", help="Folder that renders are written into.")]


@with_options
def studio(
    model: Model = None,
    display: DisplayChoice = None,
    state: State = None,
    folder: Folder = Path(),
    host: viewing.Host = "127.0.0.1",
    port: viewing.Port = 0,
    no_browser: viewing.NoBrowser = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    asked: Annotated[SceneOptions, only("environment", "up")],
    access: AccessOptions,
    machine: MachineOptions,
) -> None:
    """Set up a display by hand in a browser, see live what it will show, and render."""
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.studio_app.open_session import open_session
    from lippmann.studio_app.site import StudioSite
    from lippmann.viewer.secret_folder import secret_folder

    console = Console(quiet, as_json)
    first = _state(state, model, display, asked)
    request = RenderRequest.from_options(machine)
    with open_session(first, folder, request, allow_outside=access.allow_outside) as session:
        viewing.serve(
            StudioSite(session, "jpeg" if viewing.is_remote() else "rgb"),
            f"studio, {Path(first.scene).name} on {first.display}",
            console,
            host=host,
            port=port,
            browser=not no_browser,
            folder=secret_folder(),
            started=session.warm_up,
        )


def show(
    picture: options.Picture,
    display: options.PictureDisplay = None,
    host: viewing.Host = "127.0.0.1",
    port: viewing.Port = 0,
    no_browser: viewing.NoBrowser = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Show a picture on the display itself: a window to put full screen there, native pixels one to one.

    A quilt is shown by Looking Glass Bridge on the panels that it finds.
    """
    from lippmann.quilts.cast import cast_quilt
    from lippmann.quilts.files import is_quilt, read_quilt

    if is_quilt(picture):
        given = {"--display": display is not None, "--host": host != "127.0.0.1", "--port": port != 0}
        for name in (name for name, is_given in {**given, "--no-browser": no_browser}.items() if is_given):
            raise UsageError("a quilt goes through Bridge, which knows its panels", where=name, fix="leave it out")
        quilt = read_quilt(picture)
        if quilt.layout.views == 2:
            rule = "the player of an eye-tracked monitor shows stereo pairs"
            raise UsageError("this is a stereo pair", where=str(picture), rule=rule, fix="open it there")
        panels = cast_quilt(quilt, picture)
        line = f"{picture}: shown by Bridge on {', '.join(panels)}"
        Console(quiet, as_json).result({"picture": str(picture), "panels": panels}, line)
        return
    from lippmann.studio_app.panel_site import PanelSite
    from lippmann.viewer.served_picture import PictureFile

    file = PictureFile(picture, parse.display(display), "png" if viewing.is_remote() else "rgb")
    viewing.serve(PanelSite(file), str(picture), Console(quiet, as_json), host=host, port=port, browser=not no_browser)


def _state(path: Path | None, model: str | None, display: str | None, asked: SceneOptions) -> StudioState:
    """The first state: that of the file, or a new one, with what the options say."""
    from lippmann.studio_app.state import StudioState
    from lippmann.studio_app.state_toml import read_state

    names = {"scene": model, "display": display, **changed_options(asked)}
    given = {name: str(value) for name, value in names.items() if value is not None}
    return replace(StudioState() if path is None else read_state(path), **given)  # type: ignore[arg-type]
