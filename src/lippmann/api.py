"""The library by its few calls: ``load_scene``, ``render``, ``render_quilt``, ``preview``.

Everything else hangs on what they return.

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
from lippmann.rendering.request.defaults import AUTO, choose
from lippmann.rendering.request.settings import Device, RenderSettings
from lippmann.scene.placement import Mode, Placement, PlacementOptions
from lippmann.scene.readers.load import load_scene as _load_scene
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.image import IntegralImage
    from lippmann.quilts.quilt import Quilt
    from lippmann.rendering.forecast import Forecast
    from lippmann.rendering.picture import Preview
    from lippmann.tiles.tiled_render import Rendered, Runner


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
        :class:`~lippmann.scene.values.description.SceneDescription`.
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
    method: str = AUTO,
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
    denoise: str = AUTO,
    layers: bool = False,
    camera: str | None = None,
    place: str | None = None,
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0),
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
    scale: float = 1.0,
    pop_out: float | None = None,
    placed: Placement | None = None,
    device: str = "auto",
    threads: int | None = None,
    memory: int | None = None,
    progress: ProgressCallback = silent,
) -> IntegralImage:
    """Render a scene into the native pixels of a display.

    One picture at a time is rendered in a process; calls of other threads wait, see
    :mod:`lippmann.runtime.engine_lock`.

    Parameters
    ----------
    scene:
        What :func:`load_scene` returned, or anything that it takes.
    display:
        A :class:`~lippmann.display.Display`, a preset's name, or a TOML file.
    method, order, respect_gloss, integrator, depth, spp, seed, subpixels, pixel_filter:
        See :class:`~lippmann.rendering.request.settings.RenderSettings`; what is "auto" or None follows from the scene,
        see :func:`~lippmann.rendering.request.defaults.choose`, and the method from what is asked for, see
        :func:`~lippmann.rendering.request.resolve.decide`.
    quality, quality_mean, max_time, denoise, layers, device, threads, memory:
        See there, too.
    camera, place, turn, shift, scale, pop_out:
        Where the display stands in the scene, see :class:`~lippmann.scene.placement.PlacementOptions`: by a camera,
        fitted to the display's depth (``place="fit"``), or with scene units taken for millimetres of the display
        (``place="display"``); then turned (yaw, pitch, roll in degrees), moved (mm) and scaled.
    placed:
        Where it stands, found before; the six above do not count then.
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
    from lippmann.rendering.picture import render_integral_image

    loaded = _scene(scene)
    settings = _settings(
        loaded,
        integrator=integrator,
        depth=depth,
        spp=spp,
        pixel_filter=pixel_filter,
        method=method,
        order=order,
        respect_gloss=respect_gloss,
        quality=quality,
        quality_mean=quality_mean,
        max_time=max_time,
        seed=seed,
        subpixels=subpixels,
        denoise=denoise,
        layers=layers,
        device=device,
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
    return render_integral_image(loaded, shown, settings, options, progress, placed)


def render_to_file(
    scene: Scene | object,
    output: str | Path,
    display: Display | str | Path = "seed-lenticular",
    *,
    bits: int | None = None,
    resume: bool = False,
    placement: PlacementOptions | Placement | None = None,
    runner: Runner | None = None,
    progress: ProgressCallback = silent,
    **options: Any,
) -> Rendered:
    """Render a scene into a file tile by tile: for pictures larger than memory, and runs that may be interrupted.

    One tile at a time is rendered in a process; calls of other threads wait, see :mod:`lippmann.runtime.engine_lock`.

    Parameters
    ----------
    scene, display, progress:
        As for :func:`render`.
    output:
        The file; ``.tif`` and ``.zarr`` are written in memory that does not grow with the picture.
    bits:
        Bits per value: PNG 8, 16; EXR 16, 32; TIFF and Zarr 8, 16, 32.
    resume:
        Go on with what an interrupted run left beside ``output``, if there is anything.
    placement:
        Where the display stands in the scene.
    runner:
        Who renders the tiles, see :mod:`lippmann.tiles.tiled_render`; by default this process.
    options:
        ``method`` (``full``, ``pooled``), ``denoise``, ``integrator``, ``depth``, ``spp``, ``seed``, ``subpixels``,
        ``pixel_filter``, ``device``, ``threads`` and ``memory`` as for :func:`render`. Others are refused: they need
        the whole picture at once.

    Returns
    -------
    Rendered
        With ``.provenance`` and the numbers of tiles made and found.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.
    """
    from lippmann.tiles.tiled_render import render_to_file as rendered

    loaded = _scene(scene)
    shown = display if isinstance(display, Display) else load_display(display)
    return rendered(
        loaded,
        shown,
        _settings(loaded, **{"method": AUTO, "denoise": AUTO, **options}),
        placement or PlacementOptions(),
        Path(output),
        bits=bits,
        resume=resume,
        runner=runner,
        progress=progress,
    )


def _settings(
    scene: Scene,
    *,
    integrator: str = AUTO,
    depth: int | None = None,
    spp: int | None = None,
    pixel_filter: str = AUTO,
    quality: float | None = None,
    quality_mean: float | None = None,
    max_time: float | None = None,
    **others: Any,
) -> RenderSettings:
    """The settings of :func:`render`, what is left open filled in from the scene."""
    open_ended = not (quality is quality_mean is max_time is None)
    choice = choose(
        scene, integrator=integrator, depth=depth, spp=spp, pixel_filter=pixel_filter, open_ended=open_ended
    )
    return RenderSettings(**vars(choice), quality=quality, quality_mean=quality_mean, max_time=max_time, **others)


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
    """The plain picture that a camera of the scene sees. Calls of other threads wait, as of :func:`render`.

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
    from lippmann.rendering.picture import render_preview

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


def render_quilt(
    scene: Scene | object,
    display: Display | str | Path = "portrait",
    *,
    views: tuple[int, int] | None = None,
    size: tuple[int, int] | None = None,
    placement: PlacementOptions | None = None,
    progress: ProgressCallback = silent,
    **options: Any,
) -> Quilt:
    """Render the views that cameras before a display see, side by side in one picture.

    Calls of other threads wait, as of :func:`render`.

    Parameters
    ----------
    scene:
        What :func:`load_scene` returned, or anything that it takes.
    display:
        A device's name (``portrait``), or any lenticular display as :func:`render` takes it.
    views, size:
        Columns and rows of views, width and height in pixels; by default those that the device is given, see
        :data:`lippmann.quilts.quilt.DEVICE_QUILTS`.
    placement:
        Where the display stands in the scene; the same as for :func:`render` gives the same place.
    options:
        ``integrator``, ``depth``, ``spp``, ``quality``, ``quality_mean``, ``max_time``, ``seed``, ``pixel_filter``,
        ``denoise``, ``device``, ``threads`` and ``memory`` as for :func:`render`; every view counts as a micro-image
        does there. ``method``: ``auto``, ``full``, or ``pooled``, with which neighbouring views share their light
        before it is denoised.

    Returns
    -------
    Quilt
        With ``.pixels`` ``(height, width, 3)`` float32 linear RGB, ``.layout``, ``.view(k)`` and ``.provenance``.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.
    """
    from lippmann.quilts.quilt import Quilt, load_device, quilt_of_display
    from lippmann.rendering.quilt import render_quilt as rendered

    shown = display if isinstance(display, Display) else load_device(str(display))
    wanted = quilt_of_display(shown, views, size)
    loaded = _scene(scene)
    frame = rendered(
        loaded,
        shown,
        (wanted.layout.columns, wanted.layout.rows),
        (wanted.width, wanted.height),
        _settings(loaded, **{"method": AUTO, "denoise": AUTO, **options}),
        placement or PlacementOptions(),
        progress,
    )
    return Quilt(frame.pixels, wanted.layout, provenance=frame.provenance)


def plan(
    scene: Scene | object,
    display: Display | str | Path = "seed-lenticular",
    *,
    placement: PlacementOptions | None = None,
    progress: ProgressCallback = silent,
    **options: Any,
) -> Forecast:
    """Say what rendering a scene for a display will show and take, without rendering more than a few pixels.

    Calls of other threads wait, as of :func:`render`.

    Parameters
    ----------
    scene, display:
        As for :func:`render`.
    placement:
        Where the display stands in the scene.
    options:
        ``integrator``, ``depth``, ``spp``, ``seed``, ``subpixels``, ``pixel_filter``, ``denoise``, ``device``,
        ``threads`` and ``memory`` as for :func:`render`, of the method ``full``.

    Returns
    -------
    Forecast
        Depth range and what of it will be blurred, rays, memory and seconds.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong, as :func:`render` would find it before its first ray.
    """
    from lippmann.rendering.forecast import forecast

    loaded = _scene(scene)
    shown = display if isinstance(display, Display) else load_display(display)
    settings = _settings(loaded, **{"method": AUTO, "denoise": AUTO, **options})
    return forecast(loaded, shown, settings, placement or PlacementOptions(), progress)


def _scene(source: Scene | object) -> Scene:
    return source if isinstance(source, Scene) else load_scene(source)


__all__ = ["load_scene", "plan", "preview", "render", "render_quilt", "render_to_file"]
