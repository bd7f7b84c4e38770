"""The library by its few calls: load a scene, render it, whole or into a file, as a quilt, a turntable or a preview, or
plan that.

Everything else hangs on what they return.

::

    import lippmann

    image = lippmann.render(lippmann.load_scene("x.glb"), display="seed-lenticular", spp=64)
    image.save("x.png")
    image.replay((0.0, 0.0, 500.0))
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.display import Display, load_display
from lippmann.display.sheet_layout import with_bleed
from lippmann.errors import UsageError
from lippmann.options.choices import Correction
from lippmann.options.forms import LEFT_OUT
from lippmann.options.light import LightOptions
from lippmann.options.option import Options, options_of, takes
from lippmann.options.placement import PlacementOptions
from lippmann.options.quality import MachineOptions, QualityOptions, RenderKeywords
from lippmann.options.scene import SceneOptions
from lippmann.progress import ProgressCallback, silent
from lippmann.progress_bar import show_progress
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.placement import Placement, options_of_sequence
from lippmann.scene.readers.load import load_scene
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from lippmann.image import IntegralImage
    from lippmann.image.preview import Preview
    from lippmann.quilts.quilt import Quilt
    from lippmann.rendering.forecast import Forecast
    from lippmann.studio_app.notebook import NotebookStudio
    from lippmann.tiles.tiled_render import Rendered, Runner


@takes(QualityOptions, MachineOptions)
def render(
    scene: Scene | object,
    display: Display | str | Path = "seed-lenticular",
    *,
    placement: PlacementOptions | Placement | Mapping[str, object] | None = None,
    bleed: float = 0.0,
    correct: Correction = "none",
    headroom: float = 0.0,
    progress: ProgressCallback | None = None,
    **options: Unpack[RenderKeywords],
) -> IntegralImage:
    """Render a scene into the native pixels of a display.

    One picture at a time is rendered in a process; calls of other threads wait, see
    :mod:`lippmann.runtime.engine_lock`.

    Parameters
    ----------
    scene:
        What :func:`load_scene` returned, or anything that it takes.
    display:
        A :class:`~lippmann.display.Display`, a preset's name, or a TOML file. Default ``seed-lenticular``.
    placement:
        Where the display stands in the scene: a :class:`~lippmann.options.placement.PlacementOptions` (by a camera,
        fitted to the panel, or in the display's own millimetres; then turned, moved, scaled), a dict of its options
        such as ``{"turn": 30}``, or a placement found before. By default a bundled scene's own camera, else fitted.
    bleed:
        Of a print, millimetres to go on beyond every edge, which are cut off; 0 to 100. The scene stands where it
        stands without. Default 0.
    correct:
        ``lens``: the pixels whose light through the display's real lenses comes nearest to what rays meet, of which
        there are more than pixels. Default ``none``.
    headroom:
        How far above black and below white a corrected picture's light is to keep, as a share of white: 0 to 0.25.
        The correction needs room to take light away; the picture has less contrast. Default 0.
    progress:
        Called with :class:`~lippmann.progress.Progress` as the work goes on. By default a bar in terminals and
        notebooks, and nothing elsewhere.
    **options:
        Fields of :class:`~lippmann.options.quality.QualityOptions` and
        :class:`~lippmann.options.quality.MachineOptions`.

    Returns
    -------
    IntegralImage
        With ``.pixels`` ``(H, W, 3)`` float32 linear RGB.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong; see ``lippmann.errors``.

    Examples
    --------
    >>> small = lippmann.load_display("seed-lenticular").resized(16, 8)
    >>> image = lippmann.render("teapot", small, integrator="normal", spp=1)
    >>> image.pixels.shape
    (8, 16, 3)
    """
    from lippmann.rendering.picture import render_picture

    rendered: Callable[..., IntegralImage] = render_picture
    if correct != "none" or headroom:
        from lippmann.corrected import corrected_renderer

        rendered = corrected_renderer(correct, headroom)

    request = _request(placement, options)
    with show_progress(progress) as report:
        return rendered(_scene(scene), with_bleed(_display(display), bleed), request, report)


@takes(QualityOptions, MachineOptions, without=LEFT_OUT["tiles"])
def render_to_file(
    scene: Scene | object,
    output: str | Path,
    display: Display | str | Path = "seed-lenticular",
    *,
    placement: PlacementOptions | Placement | Mapping[str, object] | None = None,
    bleed: float = 0.0,
    bits: int | None = None,
    resume: bool = False,
    runner: Runner | None = None,
    progress: ProgressCallback | None = None,
    **options: Unpack[RenderKeywords],
) -> Rendered:
    """Render a scene into a file tile by tile: for pictures larger than memory, and runs that may be interrupted.

    One tile at a time is rendered in a process; calls of other threads wait, see :mod:`lippmann.runtime.engine_lock`.

    Parameters
    ----------
    scene, display, placement, bleed, progress:
        As for :func:`render`.
    output:
        The file; ``.tif`` and ``.zarr`` are written in memory that does not grow with the picture.
    bits:
        Bits per value: PNG 8, 16; EXR 16, 32; TIFF and Zarr 8, 16, 32. Default: 8; 16 for EXR.
    resume:
        Go on with what an interrupted run left beside ``output``, if there is anything. Default False.
    runner:
        Who renders the tiles, see :mod:`lippmann.tiles.tiled_render`; by default this process.
    **options:
        As of :func:`render`.

    Returns
    -------
    Rendered
        With ``.provenance`` and the numbers of tiles made and found.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.

    Examples
    --------
    >>> small = lippmann.load_display("seed-lenticular").resized(16, 8)
    >>> lippmann.render_to_file("teapot", "teapot.png", small, integrator="normal", spp=1).provenance.spp
    1
    """
    from lippmann.tiles.tiled_render import render_to_file as rendered

    request = _request(placement, options)
    with show_progress(progress) as report:
        return rendered(
            _scene(scene),
            with_bleed(_display(display), bleed),
            request,
            Path(output),
            bits=bits,
            resume=resume,
            runner=runner,
            progress=report,
        )


@takes(QualityOptions, MachineOptions, without=LEFT_OUT["preview"])
def preview(
    scene: Scene | object,
    display: Display | str | Path | None = None,
    *,
    size: tuple[int, int] = (512, 512),
    eye: tuple[float, float, float] | None = None,
    placement: PlacementOptions | Placement | Mapping[str, object] | None = None,
    camera: str | None = None,
    progress: ProgressCallback | None = None,
    **options: Unpack[RenderKeywords],
) -> Preview:
    """Render what a display will show to an eye, or without one the plain picture that a camera of the scene sees.

    Calls of other threads wait, as of :func:`render`.

    Parameters
    ----------
    scene, progress:
        As for :func:`render`.
    display, placement:
        The display and where it stands in the scene, as for :func:`render`. Default None: no display.
    size:
        Width and height in pixels, 1 to 65535; a display's picture is the largest of its shape within. Default 512 x
        512.
    eye:
        The eye's place ``(x, y, z)`` before a display in mm, as for :meth:`IntegralImage.replay`. By default in front
        of the middle.
    camera:
        Without a display: a camera of the scene by name; None takes the first, or one that frames a scene without any.
    **options:
        As of :func:`render`.

    Returns
    -------
    Preview
        With ``.pixels`` ``(height, width, 3)`` float32 linear RGB and ``.provenance``.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.

    Examples
    --------
    >>> lippmann.preview("teapot", size=(16, 8), integrator="normal").pixels.shape
    (8, 16, 3)
    >>> lippmann.preview("teapot", "seed-lenticular", size=(16, 16), integrator="normal").pixels.shape
    (16, 16, 3)
    """
    from lippmann.viewing.replay import check_size, eye_before

    request, within = _request(placement, options), check_size(size)
    if display is None:
        from lippmann.rendering.preview import render_preview

        if eye is not None or placement is not None:
            what = "eye" if eye is not None else "placement"
            raise UsageError("there is no display", parameter=what, fix=f"add display=, or leave {what} out")
        with show_progress(progress) as report:
            return render_preview(_scene(scene), camera, within, request, report)

    from lippmann.rendering.live.eye_preview import render_eye_preview

    if camera is not None:
        fix = f'use placement={{"camera": {camera!r}}}'
        raise UsageError("a display stands before it", parameter="camera", fix=fix)
    target = _display(display)
    at = eye_before(target, eye)
    with show_progress(progress) as report:
        return render_eye_preview(_scene(scene), target, at, request, within, report)


@takes(QualityOptions, MachineOptions, without=LEFT_OUT["quilt"])
def render_quilt(
    scene: Scene | object,
    display: Display | str | Path = "portrait",
    *,
    placement: PlacementOptions | Placement | Mapping[str, object] | None = None,
    views: tuple[int, int] | None = None,
    size: tuple[int, int] | None = None,
    progress: ProgressCallback | None = None,
    **options: Unpack[RenderKeywords],
) -> Quilt:
    """Render the views that cameras in front of a display see, side by side in one picture.

    Calls of other threads wait, as of :func:`render`.

    Parameters
    ----------
    scene, placement, progress:
        As for :func:`render`; the same placement gives the same place.
    display:
        A device's name (default ``portrait``), or any lenticular display as :func:`render` takes it.
    views, size:
        Columns and rows of views, width and height in pixels; by default those that the device is given, see
        :data:`lippmann.quilts.quilt.DEVICE_QUILTS`.
    **options:
        As of :func:`render`.

    Returns
    -------
    Quilt
        With ``.pixels`` ``(height, width, 3)`` float32 linear RGB, ``.layout``, ``.view(k)`` and ``.provenance``.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.

    Examples
    --------
    >>> lippmann.render_quilt("teapot", views=(2, 1), size=(256, 256), integrator="normal", spp=1).layout.columns
    2
    """
    from lippmann.quilts.quilt import Quilt, quilt_of_display
    from lippmann.rendering.quilt import render_quilt as rendered

    device = display if isinstance(display, Display) else load_display(str(display))
    layout = quilt_of_display(device, views, size)
    with show_progress(progress) as report:
        frame = rendered(
            _scene(scene),
            device,
            (layout.layout.columns, layout.layout.rows),
            (layout.width, layout.height),
            _request(placement, options),
            report,
        )
    return Quilt(frame.pixels, layout.layout, provenance=frame.provenance, display=device)


@takes(QualityOptions, MachineOptions)
def render_turntable(
    scene: Scene | object,
    display: Display | str | Path = "seed-lenticular",
    frames: int | None = None,
    *,
    swing: float | None = None,
    fixed_noise: bool = False,
    placement: PlacementOptions | Mapping[str, object] | None = None,
    progress: ProgressCallback | None = None,
    **options: Unpack[RenderKeywords],
) -> Iterator[IntegralImage]:
    """Render a scene on a turntable, frame by frame; display and light stand still.

    The scene turns about its upright axis, through the middle of its box, with one placement that is fitted to all
    angles: it never leaves the panel nor changes its size. Frame k of N is turned by 360 k / N degrees. For quilts see
    :func:`lippmann.sequences.frames.render_quilt_sequence`.

    Parameters
    ----------
    scene, display, progress:
        As for :func:`render`.
    frames:
        Frames of a whole turn, or of a swing to and fro; 48 by default.
    swing:
        Degrees from one end of a swing to the other, above 0 and at most 360; None for a whole turn. Frame k of N is
        turned by ``swing / 2 sin(2 pi k / N)``.
    fixed_noise:
        Give all frames the same noise; by default each has its own, so that none stands still on the glass.
    placement:
        Where the display stands during the whole turn. Without a mode or a camera the scene is fitted.
    **options:
        As of :func:`render`.

    Yields
    ------
    IntegralImage
        The frames in their order; each is rendered when it is asked for.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong; before the first frame for what can be told then.

    Examples
    --------
    >>> small = lippmann.load_display("seed-lenticular").resized(16, 8)
    >>> frames = lippmann.render_turntable("teapot", small, 2, integrator="normal", spp=1)
    >>> [frame.pixels.shape for frame in frames]
    [(8, 16, 3), (8, 16, 3)]
    """
    from lippmann.sequences.frames import render_sequence
    from lippmann.sequences.turntable import open_turntable

    _refuse_misplaced(options)
    where = options_of_sequence(placement)
    motion = open_turntable(_scene(scene), frames, swing=swing, placement=where)
    report = progress or silent
    pictures = render_sequence(
        motion,
        display,
        range(motion.count),
        placement=where,
        progress=report,
        fixed_noise=fixed_noise,
        **options,
    )
    return (image for _, image in pictures)


@takes(QualityOptions, MachineOptions, without=LEFT_OUT["forecast"])
def plan(
    scene: Scene | object,
    display: Display | str | Path = "seed-lenticular",
    *,
    placement: PlacementOptions | Placement | Mapping[str, object] | None = None,
    progress: ProgressCallback | None = None,
    **options: Unpack[RenderKeywords],
) -> Forecast:
    """Say what rendering a scene for a display will show and take, without rendering more than a few pixels.

    Calls of other threads wait, as of :func:`render`.

    Parameters
    ----------
    scene, display, placement, progress:
        As for :func:`render`.
    **options:
        As of :func:`render`.

    Returns
    -------
    Forecast
        Depth range and what of it will be blurred, rays, memory and seconds.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong, as :func:`render` would find it before its first ray.

    Examples
    --------
    >>> small = lippmann.load_display("seed-lenticular").resized(16, 8)
    >>> lippmann.plan("teapot", small, spp=2).rays["primary"]
    256
    """
    from lippmann.rendering.forecast import forecast

    with show_progress(progress) as report:
        return forecast(_scene(scene), _display(display), _request(placement, options), report)


@takes(SceneOptions, PlacementOptions, LightOptions, QualityOptions, MachineOptions, integrator="path")
def studio(
    scene: Scene | object = "teapot",
    display: str | Path = "seed-lenticular",
    *,
    folder: str | Path = ".",
    height: int = 760,
    port: int = 0,
    framed_by: Iterable[str] = (),
    allow_outside: bool = False,
    **options: object,
) -> NotebookStudio:
    """Open the studio for a scene; as the value of a notebook's cell it is shown there.

    The studio is served from this process to browsers on this machine; elsewhere forward its port. It renders in a
    thread of its own: other renders of the process take turns with it, and its pictures stand still meanwhile.

    Parameters
    ----------
    scene:
        A file, a bundled scene's name, or a scene (or another library's object, as for :func:`load_scene`). An object
        has no file: the page shows it and sets everything, but has no command line, no full render and no saved state
        for it; :func:`render` has.
    display:
        Name, TOML file or short form of a display.
    folder:
        Where renders of the page are written.
    height:
        Height of the cell in CSS pixels, 200 to 4000. Default 760.
    port:
        Port to listen on; 0 takes a free one.
    framed_by:
        Origins of pages that may show the studio beside those of ``localhost``, such as ``https://hub.example:8000``.
    allow_outside:
        As for :func:`load_scene`.
    **options:
        What it runs on, as for :func:`render`, and first values of settings: fields of
        :class:`~lippmann.studio_app.state.StudioState`, such as ``turn`` or ``exposure``.

    Returns
    -------
    NotebookStudio
        With ``.address``, ``.state`` (what the page set last) and ``.close()``; also a context manager. It is closed
        when the process ends.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.

    Examples
    --------
    >>> with lippmann.studio("teapot") as page:  # doctest: +SKIP
    ...     print(page.address)
    """
    from lippmann.studio_app.notebook import NotebookStudio, state_of_settings

    held = None if isinstance(scene, (str, Path)) else _scene(scene)
    label = f"{held.name} (object)" if held is not None else str(scene)
    machine: dict[str, object] = {
        name: options.pop(name) for name in ("device", "threads", "memory") if name in options
    }
    return NotebookStudio(
        state_of_settings(label, display, options, held),
        held=held,
        machine=RenderRequest.of(machine),
        folder=Path(folder),
        height=height,
        port=port,
        framed_by=framed_by,
        allow_outside=allow_outside,
    )


def _scene(source: Scene | object) -> Scene:
    return source if isinstance(source, Scene) else load_scene(source)


def _display(source: Display | str | Path) -> Display:
    return source if isinstance(source, Display) else load_display(source)


#: How a call is given the options that renders do not take themselves.
_GIVEN_OTHERWISE: Mapping[type[Options], str] = {
    PlacementOptions: 'placement={{"{0}": ...}}',
    LightOptions: 'load_scene(..., light={{"{0}": ...}})',
    SceneOptions: "load_scene(..., {0}=...)",
}


def _request(placement: object, options: Mapping[str, object]) -> RenderRequest:
    _refuse_misplaced(options)
    return RenderRequest.of({**options, "placement": placement})


def _refuse_misplaced(options: Iterable[str]) -> None:
    for kind, way in _GIVEN_OTHERWISE.items():
        for each, _ in options_of(kind):
            if each.name in options:
                what = f"is an option of a {kind.noun}, not of a render"
                raise UsageError(what, parameter=each.name, fix=f"use {way.format(each.name)}")


__all__ = ["load_scene", "plan", "preview", "render", "render_quilt", "render_to_file", "studio"]
