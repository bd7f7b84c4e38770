# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line that makes a picture of an exported scene."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

#: Endings of native pictures.
ENDINGS = (".png", ".tif", ".tiff", ".exr")

Kind = Literal["preview", "render"]


@dataclass(frozen=True)
class Settings:
    """What the panel says.

    Attributes
    ----------
    display:
        The name of a display, or a file of one.
    by_camera:
        Whether the display stands as the scene's camera looks; else the scene fills it.
    quality:
        PSNR in decibels that a render works for; 0: as many samples as ``samples`` says.
    samples:
        Samples in each pixel; 0: as the command likes.
    """

    display: str
    by_camera: bool = True
    quality: float = 0.0
    samples: int = 0


def command_line(
    program: str,
    kind: Kind,
    settings: Settings,
    scene: Path,
    output: Path,
    *,
    world: Path | None = None,
    camera: str = "",
    exposure: float = 0.0,
) -> list[str]:
    """The words of ``lippmann preview`` or ``lippmann render``.

    Parameters
    ----------
    scene, world, camera:
        As :func:`.in_blender.export.export_scene` wrote them.
    exposure:
        Stops of Blender's view: lights keep the brightness that they have there.
    """
    words = [program, kind, str(scene), "--display", settings.display, "--exposure", f"{exposure:g}"]
    if settings.by_camera and camera:
        words += ["--camera", camera]
    if world is not None:
        words += ["--environment", str(world)]
    if kind == "render":
        if settings.quality > 0.0:
            words += ["--quality", f"{settings.quality:g}"]
        if settings.samples > 0:
            words += ["--spp", str(settings.samples)]
    return [*words, "-o", str(output)]


def output_problem(output: Path) -> str | None:
    """Why nothing can be rendered into a file; None if it can."""
    if output.suffix.lower() not in ENDINGS:
        return f"the output must end in {', '.join(ENDINGS)}"
    if not output.parent.is_dir():
        return f"there is no folder {output.parent}"
    return None
