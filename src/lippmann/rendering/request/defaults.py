"""What is done where the user leaves the choice: it follows from what the scene was made for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast, get_args

from lippmann.errors import UsageError
from lippmann.rendering.request.settings import DEFAULT_SPP, IntegratorName, PixelFilter
from lippmann.scene.scene import Scene

#: Leaves the choice to the scene.
AUTO = "auto"


@dataclass(frozen=True)
class Choice:
    """The settings that depend on the scene; fields as those of ``RenderSettings``."""

    integrator: IntegratorName
    depth: int | None
    spp: int | None
    pixel_filter: PixelFilter


def choose(
    scene: Scene,
    *,
    integrator: str = AUTO,
    depth: int | None = None,
    spp: int | None = None,
    pixel_filter: str = AUTO,
    own_camera: bool = False,
    open_ended: bool = False,
) -> Choice:
    """Fill in what is left open.

    Scenes made for the classic light models are rendered by ``classic``, with the ray depth of their file and one
    sample in the middle of each pixel, or as many as the file asks for where its own camera takes the picture
    (``own_camera``); all others by ``path`` with 16 samples over the pixel. Where something else than a number of
    samples says when to stop (``open_ended``), that number stays open.

    Raises
    ------
    UsageError
        The classic light model is asked for a scene that has no form for it.
    """
    if integrator == AUTO:
        integrator = "classic" if scene.is_classic else "path"
    classic = scene.classic if integrator == "classic" else None
    if integrator == "classic" and classic is None:
        raise UsageError(
            f"'{scene.name}' has no form for the classic light models",
            where="--integrator",
            rule="classic is for Tachyon (.dat) and NFF files and the bundled scenes",
            fix="use path",
        )
    if classic is not None:
        depth = classic.camera.ray_depth if depth is None else depth
    if spp is None and not open_ended:
        spp = DEFAULT_SPP if classic is None else 1 + (classic.camera.antialiasing if own_camera else 0)
    if pixel_filter == AUTO:
        pixel_filter = "point" if classic is not None and spp == 1 else "box"
    if integrator not in get_args(IntegratorName):
        known = f"known are {', '.join((AUTO, *get_args(IntegratorName)))}"
        raise UsageError(f"'{integrator}' is not known", where="--integrator", rule=known)
    return Choice(cast(IntegratorName, integrator), depth, spp, cast(PixelFilter, pixel_filter))
