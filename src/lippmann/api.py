"""The library by its few calls: ``load_scene``, ``render``, ``preview``; everything else hangs on what they return.

::

    import lippmann

    image = lippmann.render(lippmann.load_scene("x.glb"), display="seed-lenticular", spp=64)
    image.save("x.png")
    image.replay((0.0, 0.0, 500.0))
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from lippmann.display import Display, load_display
from lippmann.progress import ProgressCallback, silent
from lippmann.render.defaults import AUTO, choose
from lippmann.render.settings import Denoiser, Device, Method, Order, RenderSettings
from lippmann.scene.load import load_scene as _load_scene
from lippmann.scene.placement import Mode, PlacementOptions
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.image import IntegralImage
    from lippmann.render.pipeline import Preview


def load_scene(
    source: object,
    *,
    environment: str | Path | Any | None = None,
    background: tuple[float, float, float] | None = None,
    allow_outside: bool = False,
) -> Scene:
    """A scene from a file, a bundled scene's name, or an object of another library.

    Parameters
    ----------
    source:
        Path of a ``.glb``, ``.gltf``, ``.obj``, ``.ply``, ``.stl``, Mitsuba ``.xml``, Tachyon ``.dat`` or ``.nff``
        file; name of a bundled scene; a
        ``mi.Scene`` or Mitsuba dict; a trimesh scene or mesh; a PyVista mesh; a
        :class:`~lippmann.scene.description.SceneDescription`.
    environment:
        An equirectangular EXR or HDR file (or an ``Environment``) that lights the scene in place of its own.
    background:
        Linear RGB seen where nothing is hit; None leaves the environment visible.
    allow_outside:
        Let the file refer to files outside its own folder.

    Raises
    ------
    SceneError
        If the file is missing, damaged, foreign, or beyond what can be rendered.
    """
    return _load_scene(source, environment=environment, background=background, allow_outside=allow_outside)


def render(
    scene: Scene | object,
    display: Display | str | Path = "seed-lenticular",
    *,
    method: str = "full",
    order: str | None = None,
    respect_gloss: bool | None = None,
    integrator: str = AUTO,
    depth: int | None = None,
    spp: int | None = None,
    quality: float | None = None,
    quality_mean: float | None = None,
    max_time: float | None = None,
    seed: int = 0,
    subpixels: bool = False,
    pixel_filter: str = AUTO,
    denoise: str = "none",
    layers: bool = False,
    camera: str | None = None,
    place: str | None = None,
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0),
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
    scale: float = 1.0,
    pop_out: float | None = None,
    device: str = "auto",
    threads: int | None = None,
    memory: int | None = None,
    progress: ProgressCallback = silent,
) -> IntegralImage:
    """Render a scene into the native pixels of a display.

    Parameters
    ----------
    scene:
        What :func:`load_scene` returned, or anything that it takes.
    display:
        A :class:`~lippmann.display.Display`, a preset's name, or a TOML file.
    method, order, respect_gloss, integrator, depth, spp, seed, subpixels, pixel_filter:
        See :class:`~lippmann.render.settings.RenderSettings`; what is "auto" or None follows from the scene, see
        :func:`~lippmann.render.defaults.choose`.
    quality, quality_mean, max_time, denoise, layers, device, threads, memory:
        See there, too.
    camera, place, turn, shift, scale, pop_out:
        Where the display stands in the scene, see :class:`~lippmann.scene.placement.PlacementOptions`: by a camera,
        fitted to the display's depth (``place="fit"``), or with scene units taken for millimetres of the display
        (``place="display"``); then turned (yaw, pitch, roll in degrees), moved (mm) and scaled.
    progress:
        Called with :class:`~lippmann.progress.Progress` as the work goes on.

    Returns
    -------
    IntegralImage
        With ``.pixels`` ``(H, W, 3)`` float32 linear RGB.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong; see ``lippmann.errors``.
    """
    from lippmann.render.pipeline import render_integral_image

    loaded = _scene(scene)
    open_ended = not (quality is quality_mean is max_time is None)
    choice = choose(
        loaded, integrator=integrator, depth=depth, spp=spp, pixel_filter=pixel_filter, open_ended=open_ended
    )
    settings = RenderSettings(
        method=cast(Method, method),
        order=cast("Order | None", order),
        respect_gloss=respect_gloss,
        **vars(choice),
        quality=quality,
        quality_mean=quality_mean,
        max_time=max_time,
        seed=seed,
        subpixels=subpixels,
        denoise=cast("Denoiser", denoise),
        layers=layers,
        device=cast(Device, device),
        threads=threads,
        memory=memory,
    )
    options = PlacementOptions(
        mode=cast("Mode | None", place),
        camera=camera,
        turn=turn,
        shift=shift,
        scale=scale,
        pop_out=pop_out,
    )
    shown = display if isinstance(display, Display) else load_display(display)
    return render_integral_image(loaded, shown, settings, options, progress)


def preview(
    scene: Scene | object,
    size: tuple[int, int] = (512, 512),
    *,
    camera: str | None = None,
    integrator: str = AUTO,
    depth: int | None = None,
    spp: int | None = None,
    seed: int = 0,
    pixel_filter: str = AUTO,
    device: str = "auto",
    threads: int | None = None,
    memory: int | None = None,
    progress: ProgressCallback = silent,
) -> Preview:
    """The plain picture that a camera of the scene sees.

    Parameters
    ----------
    size:
        Width and height in pixels.
    camera:
        A camera of the scene by name; None takes the first, or one that frames a scene without any.

    Returns
    -------
    Preview
        With ``.pixels`` ``(height, width, 3)`` float32 linear RGB and ``.provenance``.
    """
    from lippmann.render.pipeline import render_preview

    loaded = _scene(scene)
    choice = choose(loaded, integrator=integrator, depth=depth, spp=spp, pixel_filter=pixel_filter, own_camera=True)
    settings = RenderSettings(
        **vars(choice),
        seed=seed,
        device=cast(Device, device),
        threads=threads,
        memory=memory,
    )
    return render_preview(loaded, camera, size, settings, progress)


def _scene(source: Scene | object) -> Scene:
    return source if isinstance(source, Scene) else load_scene(source)


__all__ = ["load_scene", "preview", "render"]
