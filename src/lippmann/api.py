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

import warnings
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

from lippmann.display import Display, load_display
from lippmann.display.sheet_layout import with_bleed
from lippmann.progress import ProgressCallback, silent
from lippmann.progress_bar import shown
from lippmann.rendering.request.choices import (
    Caustics,
    Denoiser,
    Device,
    Effort,
    Integrator,
    Method,
    Order,
    PixelFilter,
    ToneMap,
)
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.placement import Placement, PlacementOptions, options_of_sequence, placement_of
from lippmann.scene.readers.load import load_scene as _load_scene
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.image import IntegralImage
    from lippmann.quilts.quilt import Quilt
    from lippmann.rendering.forecast import Forecast
    from lippmann.rendering.preview import Preview
    from lippmann.scene.light_options import LightOptions
    from lippmann.scene.values.description import Environment
    from lippmann.scene.values.volume import TransferFunction
    from lippmann.studio_app.notebook import NotebookStudio
    from lippmann.tiles.tiled_render import Rendered, Runner

#: Keywords that :func:`render` took before ``placement``, and what they are called there.
_FORMER_PLACEMENT = {"place": "mode", **{name: name for name in ("camera", "turn", "shift", "scale", "pop_out")}}


def load_scene(
    source: object,
    *,
    environment: str | Path | Environment | None = None,
    background: tuple[float, float, float] | None = None,
    allow_outside: bool = False,
    multiple_scattering: bool = True,
    up: Literal["y", "z", "-y"] | None = None,
    crop: tuple[float, float, float, float, float, float] | None = None,
    unit_scale: float | None = None,
    min_opacity: float | None = None,
    light: LightOptions | None = None,
    variants: Mapping[str, str] | None = None,
    depth_map: str | Path | None = None,
    transfer_function: str | Path | TransferFunction | None = None,
    window: tuple[float, float] | None = None,
    series: str | None = None,
) -> Scene:
    """Load a scene from a file, a bundled scene's name, or an object of another library.

    Parameters
    ----------
    source:
        Path of a ``.glb``, ``.gltf``, ``.obj``, ``.ply``, ``.spz``, ``.sog``, ``.stl``, ``.blend``, ``.usd``
        (``.usda``, ``.usdc``, ``.usdz``), Mitsuba ``.xml``, Tachyon ``.dat`` or ``.nff`` file; of a volume (``.nii``,
        ``.nii.gz``, ``.vdb``, ``.npy``, ``.npz``, Mitsuba ``.vol``, ``.dcm`` or a folder of such) or of VTK (``.vtp``,
        ``.vtu``, ``.vtk``, ``.vti``); name of a bundled scene; a ``mi.Scene`` or Mitsuba dict; a trimesh scene or
        mesh; a PyVista data set or plotter; a :class:`~lippmann.scene.values.description.SceneDescription`.
    environment:
        An equirectangular EXR or HDR file (or an ``Environment``) that lights the scene in place of its own.
    background:
        Linear RGB seen where nothing is hit; None leaves the environment visible.
    allow_outside:
        Let the file refer to files outside its own folder.
    multiple_scattering:
        Give back the light that rough surfaces reflect more than once between microfacets. False: as dark as glTF's
        formulas make them.
    up:
        ``y``, ``z`` or ``-y``: the axis that points up in a file that does not say so. By default ``y`` in OBJ, PLY and
        SPZ files, ``z`` in STL files, ``-y`` in PLY files of Gaussian splats and in SOG files.
    crop:
        Of Gaussian splats, points of a cloud and voxels those are kept whose centres lie in the box from
        ``(x0, y0, z0)`` to ``(x1, y1, z1)``, all in one tuple: coordinates with +y up, after ``unit_scale``.
    unit_scale:
        Factor on the coordinates of Gaussian splats, whose files have no unit: what one of their units is in the unit
        that ``crop`` and placements shall count in.
    min_opacity:
        Leave out Gaussian splats of less opacity, 0 to 1: most floaters are faint.
    light:
        A :class:`~lippmann.scene.light_options.LightOptions`: turns and scales the scene's light.
    variants:
        Of a USD stage: ``{"set": "choice"}`` for every prim that has them, ``{"/prim:set": "choice"}`` for one. Of
        a glTF file: ``{"materials": "name"}`` for a material variant.
    depth_map:
        The depth of a photograph (``.jpg``, ``.png``, ``.webp``, ``.heic``), as a file; None for one that a JPEG or
        HEIF file holds.
    transfer_function:
        Colour and opacity of a volume's values: ``ct-bone``, ``ct-soft``, ``mr``, ``grey``, ``fire``, a ``.toml`` or
        ``.json`` file, or a :class:`~lippmann.scene.values.volume.TransferFunction`. By default what suits the values.
    window:
        Lowest and highest value, between which the transfer function is laid. By default its own values.
    series:
        Of a folder of DICOM files the series to show (its number in the list that an error prints, description or UID),
        of a NIfTI file with several volumes its number, of an ``.npz`` file the name of the array.

    Raises
    ------
    SceneError
        If the file is missing, damaged, foreign, or beyond what can be rendered.
    """
    return _load_scene(
        source,
        environment=environment,
        background=background,
        allow_outside=allow_outside,
        multiple_scattering=multiple_scattering,
        up=up,
        crop=crop,
        unit_scale=unit_scale,
        min_opacity=min_opacity,
        light=light,
        variants=variants,
        depth_map=None if depth_map is None else Path(depth_map),
        transfer_function=transfer_function,
        window=window,
        series=series,
    )


def render(
    scene: Scene | object,
    display: Display | str | Path = "seed-lenticular",
    *,
    placement: PlacementOptions | Placement | Mapping[str, object] | None = None,
    bleed: float = 0.0,
    method: Method = "auto",
    order: Order | None = None,
    respect_gloss: bool | None = None,
    integrator: Integrator = "auto",
    depth: int | None = None,
    spp: int | None = None,
    effort: Effort = "normal",
    quality: float | None = None,
    quality_worst: float | None = None,
    max_time: float | None = None,
    seed: int = 0,
    subpixels: bool | None = None,
    pixel_filter: PixelFilter = "auto",
    denoise: Denoiser = "auto",
    caustics: Caustics = "auto",
    clamp_indirect: float | None = None,
    exposure: float | Literal["auto"] = "auto",
    tone_map: ToneMap = "auto",
    layers: bool = False,
    device: Device = "auto",
    threads: int | None = None,
    memory: int | None = None,
    progress: ProgressCallback | None = None,
    **former: object,
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
        Where the display stands in the scene: a :class:`~lippmann.scene.placement.PlacementOptions` (by a camera,
        fitted to the panel, or in the display's own millimetres; then turned, moved, scaled), a dict of its options
        such as ``{"turn": 30}``, or a placement found before. By default a bundled scene's own camera, else fitted.
    bleed:
        Of a print, millimetres to go on beyond every edge, which are cut off; 0 to 100. The scene stands where it
        stands without. Default 0.
    method:
        ``auto`` (default): ``pooled`` where light has noise, else ``full``. ``full`` traces every ray. ``pooled``
        denoises, and all micro-images that show a point share its light. ``lens-view`` reprojects points from
        micro-image to micro-image and traces the missed pixels; ``interpolated`` averages those of every other
        micro-image from its neighbours.
    order:
        For ``lens-view`` and ``interpolated``: ``paper`` goes lens by lens as the paper does; ``default`` in the order
        that traces fewer pixels.
    respect_gloss:
        For ``lens-view`` and ``interpolated``: trace what reprojection would falsify (mirrors, glass, highlights). By
        default True, but in the paper's order.
    integrator:
        ``path`` (all light), ``direct`` (light straight from emitters and environment), ``classic`` (Whitted ray
        tracing, for Tachyon and NFF scenes), or a property of the first surface: ``normal``, ``depth``, ``position``,
        ``albedo``. ``auto`` (default): what the scene was made for.
    depth:
        Surfaces along a path, the primary ray's counting 1; 1 to 4096. Default 8 for ``path``, 1 for ``direct``, the
        file's own for ``classic``.
    spp:
        Samples per pixel, or per sub-pixel; 1 to 2**24. By default 16, for pooled light 2 to 16 as the picture's size
        suggests, 1 for ``classic``, and with a quality or a time as many as that takes.
    effort:
        ``draft``: a first look, one sample a pixel and the fast network. ``normal`` (default): as the other values say.
        ``final``: until it is estimated at 40 dB, as for a print.
    quality, quality_worst:
        PSNR in dB that the whole picture, or every micro-image, is to reach by its own estimate; above 0, at most 80.
        Where the former is asked for, no micro-image has over 12 dB less.
    max_time:
        Seconds of tracing after which the best picture so far is taken. Default: none.
    seed:
        Of all random choices, 0 to 2**32 - 1. Default 0.
    subpixels:
        Trace a ray for each sub-pixel, at its own place. By default where a slanted sheet gives each its own direction.
    pixel_filter:
        ``box`` spreads the samples over the pixel, ``point`` takes its centre. ``auto`` (default): ``box``, but for
        ``classic`` with one sample.
    denoise:
        ``oidn`` denoises by Open Image Denoise with the effort that the traced rays deserve, ``oidn-fast`` and
        ``oidn-high`` with a given one, ``none`` not at all. ``auto`` (default): as the method needs it.
    caustics:
        Light that mirrors, glass and smooth gloss throw onto rough surfaces: ``photons`` traced from the emitters,
        ``paths`` as paths find it, ``none`` left out. ``auto`` (default): photons where there is such light.
    clamp_indirect:
        What indirect light may bring to a sample at most each time that it is met, 1 being white. Default: no limit.
    exposure:
        Stops (EV) by which light is raised or lowered, -40 to 40. ``auto`` (default): 0, and for scenes with physical
        light sources what brings the median of what is lit to mid-grey.
    tone_map:
        ``none``: values are light, as data are to be. ``pbr-neutral``: highlights are compressed instead of clipped
        (Khronos PBR Neutral). ``auto`` (default): the latter where light is physically based, unless ``load_scene`` was
        given the colour of the background. (``render_to_file`` to TIFF or Zarr keeps light then.)
    layers:
        Add depth, position, normal, albedo and shape of what each pixel sees to the picture's maps. Default False.
    device:
        ``cpu``, ``gpu``, or ``auto`` (default): the GPU if there is one.
    threads:
        CPU threads, 1 to 4096. Default: all cores.
    memory:
        Bytes to use. Default: 60 % of what is free.
    progress:
        Called with :class:`~lippmann.progress.Progress` as the work goes on. By default a bar in terminals and
        notebooks, and nothing elsewhere.
    **former:
        Deprecated: ``camera``, ``place``, ``turn``, ``shift``, ``scale``, ``pop_out`` and ``placed``, which are
        parts of ``placement`` now, and ``quality_mean``, which is called ``quality``.

    Returns
    -------
    IntegralImage
        With ``.pixels`` ``(H, W, 3)`` float32 linear RGB.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong; see ``lippmann.errors``.
    """
    from lippmann.rendering.picture import render_picture

    if "quality_mean" in former:
        warnings.warn("quality_mean is called quality now", DeprecationWarning, stacklevel=2)
        quality = cast("float | None", former.pop("quality_mean"))
    request = RenderRequest(
        placement=_placement(placement, former, "render"),
        method=method,
        order=order,
        respect_gloss=respect_gloss,
        integrator=integrator,
        depth=depth,
        spp=spp,
        effort=effort,
        quality=quality,
        quality_worst=quality_worst,
        max_time=max_time,
        seed=seed,
        subpixels=subpixels,
        pixel_filter=pixel_filter,
        denoise=denoise,
        caustics=caustics,
        clamp_indirect=clamp_indirect,
        exposure=exposure,
        tone_map=tone_map,
        layers=layers,
        device=device,
        threads=threads,
        memory=memory,
    )
    with shown(progress) as told:
        return render_picture(_scene(scene), with_bleed(_display(display), bleed), request, told)


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
    **options: object,
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
        ``method`` (``full``, ``pooled``), ``denoise``, ``integrator``, ``depth``, ``spp``, ``effort``, ``seed``,
        ``subpixels``, ``pixel_filter``, ``device``, ``threads`` and ``memory`` as for :func:`render`. Others are
        refused: they need the whole picture at once.

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

    request = _request(placement, options)
    with shown(progress) as told:
        return rendered(
            _scene(scene),
            with_bleed(_display(display), bleed),
            request,
            Path(output),
            bits=bits,
            resume=resume,
            runner=runner,
            progress=told,
        )


def preview(
    scene: Scene | object,
    size: tuple[int, int] = (512, 512),
    *,
    camera: str | None = None,
    progress: ProgressCallback | None = None,
    **options: object,
) -> Preview:
    """Render the plain picture that a camera of the scene sees. Calls of other threads wait, as of :func:`render`.

    Parameters
    ----------
    scene, progress:
        As for :func:`render`.
    size:
        Width and height in pixels. Default 512 x 512.
    camera:
        A camera of the scene by name; None takes the first, or one that frames a scene without any.
    **options:
        ``integrator``, ``depth``, ``spp``, ``effort``, ``seed``, ``pixel_filter``, ``device``, ``threads``, ``memory``
        as for :func:`render`.

    Returns
    -------
    Preview
        With ``.pixels`` ``(height, width, 3)`` float32 linear RGB and ``.provenance``.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.
    """
    from lippmann.rendering.preview import render_preview

    with shown(progress) as told:
        return render_preview(_scene(scene), camera, size, RenderRequest.of(options), told)


def render_quilt(
    scene: Scene | object,
    display: Display | str | Path = "portrait",
    *,
    placement: PlacementOptions | Placement | Mapping[str, object] | None = None,
    views: tuple[int, int] | None = None,
    size: tuple[int, int] | None = None,
    progress: ProgressCallback | None = None,
    **options: object,
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
        ``integrator``, ``depth``, ``spp``, ``effort``, ``quality``, ``quality_worst``, ``max_time``,
        ``seed``, ``pixel_filter``, ``denoise``, ``device``, ``threads`` and ``memory`` as for :func:`render`; every
        view counts as a micro-image does there. ``method``: ``auto``, ``full``, or ``pooled``, with which neighbouring
        views share their light before it is denoised.

    Returns
    -------
    Quilt
        With ``.pixels`` ``(height, width, 3)`` float32 linear RGB, ``.layout``, ``.view(k)`` and ``.provenance``.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.
    """
    from lippmann.quilts.quilt import Quilt, quilt_of_display
    from lippmann.rendering.quilt import render_quilt as rendered

    device = display if isinstance(display, Display) else load_display(str(display))
    layout = quilt_of_display(device, views, size)
    with shown(progress) as told:
        frame = rendered(
            _scene(scene),
            device,
            (layout.layout.columns, layout.layout.rows),
            (layout.width, layout.height),
            _request(placement, options),
            told,
        )
    return Quilt(frame.pixels, layout.layout, provenance=frame.provenance, display=device)


def render_turntable(
    scene: Scene | object,
    display: Display | str | Path = "seed-lenticular",
    frames: int | None = None,
    *,
    swing: float | None = None,
    placement: PlacementOptions | Mapping[str, object] | None = None,
    progress: ProgressCallback | None = None,
    **options: object,
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
    placement:
        Where the display stands during the whole turn. Without a mode or a camera the scene is fitted.
    **options:
        Further options of :func:`render`. All frames have the same seed.

    Yields
    ------
    IntegralImage
        The frames in their order; each is rendered when it is asked for.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong; before the first frame for what can be told then.
    """
    from lippmann.sequences.frames import render_sequence
    from lippmann.sequences.turntable import open_turntable

    classic = options.get("integrator") == "classic"
    where = options_of_sequence(placement)
    motion = open_turntable(_scene(scene), frames, swing=swing, placement=where, classic=classic)
    told = progress or silent
    pictures = render_sequence(motion, display, range(motion.count), placement=where, progress=told, **options)
    return (image for _, image in pictures)


def plan(
    scene: Scene | object,
    display: Display | str | Path = "seed-lenticular",
    *,
    placement: PlacementOptions | Placement | Mapping[str, object] | None = None,
    progress: ProgressCallback | None = None,
    **options: object,
) -> Forecast:
    """Say what rendering a scene for a display will show and take, without rendering more than a few pixels.

    Calls of other threads wait, as of :func:`render`.

    Parameters
    ----------
    scene, display, placement, progress:
        As for :func:`render`.
    **options:
        ``integrator``, ``depth``, ``spp``, ``effort``, ``seed``, ``subpixels``, ``pixel_filter``, ``denoise``,
        ``device``, ``threads`` and ``memory`` as for :func:`render`, of the method ``full``.

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

    with shown(progress) as told:
        return forecast(_scene(scene), _display(display), _request(placement, options), told)


def studio(
    scene: Scene | object = "teapot",
    display: str | Path = "seed-lenticular",
    *,
    folder: str | Path = ".",
    height: int = 760,
    port: int = 0,
    framed_by: Iterable[str] = (),
    allow_outside: bool = False,
    device: Device = "auto",
    threads: int | None = None,
    memory: int | None = None,
    **settings: object,
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
    device, threads, memory:
        As for :func:`render`.
    **settings:
        First values of settings: fields of :class:`~lippmann.studio_app.state.StudioState`, such as ``turn`` or
        ``exposure``.

    Returns
    -------
    NotebookStudio
        With ``.address``, ``.state`` (what the page set last) and ``.close()``; also a context manager. It is closed
        when the process ends.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong.
    """
    from lippmann.studio_app.notebook import NotebookStudio, state_of_settings

    held = None if isinstance(scene, (str, Path)) else _scene(scene)
    name = f"{held.name} (object)" if held is not None else str(scene)
    return NotebookStudio(
        state_of_settings(name, display, settings, held),
        held=held,
        machine=RenderRequest(device=device, threads=threads, memory=memory),
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


def _request(placement: object, options: Mapping[str, object]) -> RenderRequest:
    return RenderRequest.of({**options, "placement": placement})


def _placement(placement: object, former: Mapping[str, object], function: str) -> PlacementOptions | Placement:
    """``placement``, or what former keywords say instead of it, with a warning."""
    for name in former:
        if name not in (*_FORMER_PLACEMENT, "placed"):
            raise TypeError(f"{function}() got an unexpected keyword argument '{name}'")
    if former:
        instead = "placement=PlacementOptions(mode=..., camera=..., turn=..., shift=..., scale=..., pop_out=...)"
        warnings.warn(f"{', '.join(former)} of {function}(): use {instead}", DeprecationWarning, stacklevel=3)
        found = former.get("placed")
        if isinstance(found, Placement):
            return found
        return placement_of({_FORMER_PLACEMENT[name]: value for name, value in former.items() if name != "placed"})
    return placement_of(placement)


__all__ = ["load_scene", "plan", "preview", "render", "render_quilt", "render_to_file", "studio"]
