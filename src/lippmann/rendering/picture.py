"""From a scene and a display to a picture, stage by stage."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from lippmann._version import VERSION
from lippmann.color.transfer import Transfer
from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import UsageError
from lippmann.image import IntegralImage, Provenance
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.adaptive.stopping import goal_of
from lippmann.rendering.denoise.oidn import load_denoiser
from lippmann.rendering.estimate.psnr import Estimate
from lippmann.rendering.film.wavefront_plan import make_plan
from lippmann.rendering.request.region_of_interest import even_background, panel_window, scene_corners
from lippmann.rendering.request.resolve import decide
from lippmann.rendering.request.settings import REUSING, RenderSettings
from lippmann.runtime import engine as engines
from lippmann.runtime import machine
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.placement import Placement, PlacementOptions, place
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Camera, Color

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic
    from lippmann.rendering.film.wavefront import Frame
    from lippmann.rendering.transport.ray_source import RaySource

#: Share of the free memory that is used where no limit is given.
DEFAULT_MEMORY_SHARE = 0.6

T = TypeVar("T")


@dataclass
class Stopwatch:
    """Seconds by stage, told to whoever listens as each stage begins and ends."""

    progress: ProgressCallback = silent
    seconds: dict[str, float] = field(default_factory=dict)
    started: float = field(default_factory=time.perf_counter)

    def stage(self, name: str, work: Callable[[], T]) -> T:
        self.progress(Progress(name, 0, 1))
        start = time.perf_counter()
        result = work()
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
        self.progress(Progress(name, 1, 1))
        return result

    @property
    def total(self) -> float:
        return time.perf_counter() - self.started


@exclusive()
def render_integral_image(
    scene: Scene,
    display: Display,
    settings: RenderSettings,
    placement_options: PlacementOptions,
    progress: ProgressCallback = silent,
    placed: Placement | None = None,
) -> IntegralImage:
    """Render ``scene`` for ``display``, where ``placed`` says or, without it, where ``placement_options`` lead to.

    Raises
    ------
    UsageError, SceneError, MemoryLimitError, EngineError
        As the stages find them; nothing has been written then.
    """
    watch = Stopwatch(progress)
    memory = settings.memory or default_memory()
    # What cannot be done is found before anything is loaded.
    make_plan(display.panel.width, display.panel.height, 1, channels=3 if settings.subpixels else 1, memory=memory)
    choice = decide(settings)
    settings = choice.settings
    goal_of(settings)
    if settings.denoises:
        load_denoiser()
    engine = watch.stage("load", lambda: engines.start(settings.device, settings.threads))
    built = watch.stage("build", lambda: build_for(scene, settings))
    placement = placed or place(
        scene.bounds,
        display,
        cameras=scene.cameras,
        options=placement_options,
        home_camera=scene.home_camera,
        bounds_in=scene.bounds_in,
    )

    from lippmann.rendering.film.aov import plan_layers, trace_layers
    from lippmann.rendering.methods import Job, trace
    from lippmann.rendering.transport.ray_source import DisplayRays, WindowRays

    source = DisplayRays(display, placement.world_from_display, settings.subpixels)
    integrator = watch.stage("build", lambda: make_integrator(built, settings, placement.display_from_world, source))
    window = traced_window(built, display, settings, placement)
    job = Job(
        built,
        integrator,
        source if window is None else WindowRays(source, window),
        settings,
        placement.display_from_world,
        transfer_of(settings),
        memory,
        engine.threads,
        progress,
    )
    traced = trace(job)
    frame = traced.frame
    if traced.method is not None:
        settings = replace(settings, method=traced.method)
    if window is not None:
        _widen(frame, window, display, even_background(built, settings))
    watch.seconds |= traced.seconds
    if settings.layers:
        frame.maps |= watch.stage(
            "layers",
            lambda: trace_layers(built, source, plan_layers(source, memory), placement.display_from_world, progress),
        )
    provenance = provenance_of(
        scene,
        built,
        settings,
        engine,
        frame,
        watch,
        samples=traced.samples,
        estimate=traced.estimate,
        options={
            **({"auto": choice.why} if choice.why else {}),
            **_reuse_options(settings),
            **traced.options,
            **placed_options(settings, placement),
        },
        notes=(*placement.warnings, *traced.notes),
    )
    return IntegralImage(frame.pixels, display, placement.world_from_display, provenance, _layers(frame))


def traced_window(
    built: BuiltScene | BuiltClassic, display: Display, settings: RenderSettings, placement: Placement
) -> PixelWindow | None:
    """The pixels that can see the scene, where the others are known without rays; None where all are traced.

    Pictures that may be denoised alone: of others every pixel has the samples that tiles rendered apart have. None,
    too, where the denoiser may want to see whole views.
    """
    from lippmann.device.pbr import BuiltScene
    from lippmann.rendering.denoise.pixel_order import has_exact_views

    if settings.method not in ("full", "pooled") or settings.denoise == "none" or not isinstance(built, BuiltScene):
        return None
    if even_background(built, settings) is None or (has_exact_views(display) and not settings.keeps_colors(display)):
        return None
    return panel_window(scene_corners(built, placement.display_from_world), display)


def _widen(frame: Frame, window: PixelWindow, display: Display, background: Color | None) -> None:
    """Put the background about what was traced; maps are 0 there."""
    size = display.panel.height, display.panel.width
    pixels = np.empty((*size, 3), dtype=np.float32)
    pixels[...] = background
    pixels[window.slices] = frame.pixels
    frame.pixels = pixels
    for name, values in frame.maps.items():
        frame.maps[name] = np.zeros((*size, *values.shape[2:]), dtype=values.dtype)
        frame.maps[name][window.slices] = values


def placed_options(settings: RenderSettings, placement: Placement) -> dict[str, Any]:
    """What a picture's file says of its samples' places and of the display's."""
    return {
        "pixel_filter": settings.pixel_filter,
        "placement": placement.mode,
        "depth_range": list(placement.depth_range),
        "resolvable_range": list(placement.resolvable_range),
    }


def _layers(frame: Frame) -> dict[str, NDArray[Any]]:
    """The maps of a frame in the types that pictures carry: whole numbers of 32 bits."""
    return {
        name: values.astype(np.uint32) if values.dtype.kind in "iu" else values for name, values in frame.maps.items()
    }


def _reuse_options(settings: RenderSettings) -> dict[str, Any]:
    if settings.method not in REUSING:
        return {}
    return {"order": settings.order or "default", "respect_gloss": settings.careful}


def provenance_of(
    scene: Scene,
    built: BuiltScene | BuiltClassic,
    settings: RenderSettings,
    engine: engines.Engine,
    frame: Frame,
    watch: Stopwatch,
    *,
    samples: int,
    options: dict[str, Any],
    estimate: Estimate | None = None,
    notes: tuple[str, ...] = (),
) -> Provenance:
    """How a picture of ``frame`` was made, for its file."""
    height, width = frame.pixels.shape[:2]
    all_rays = height * width * samples * (3 if settings.subpixels else 1)
    return Provenance(
        method=settings.method,
        integrator=settings.integrator,
        depth=settings.surfaces,
        spp=samples,
        seed=settings.seed,
        subpixels=settings.subpixels,
        scene=scene.name,
        transfer=transfer_of(settings),
        version=VERSION,
        device=engine.gpu_name or "cpu",
        traced_fraction=frame.rays.primary / all_rays,
        pixel_shares=frame.shares,
        rays=ray_counts(frame),
        seconds=stage_seconds(watch, frame),
        estimate=None if estimate is None else estimate.to_dict(),
        options=options,
        notes=(*scene_notes(scene, built), *notes, *_frame_notes(frame)),
    )


@dataclass(frozen=True, eq=False)
class Preview:
    """A plain picture: ``pixels`` ``(height, width, 3)`` float32 linear RGB, with how it was made."""

    pixels: NDArray[np.float32]
    provenance: Provenance


@exclusive()
def render_preview(
    scene: Scene,
    camera: str | None,
    size: tuple[int, int],
    settings: RenderSettings,
    progress: ProgressCallback = silent,
) -> Preview:
    """The plain picture that a camera of the scene sees; None takes the first one, or one that frames everything."""
    watch = Stopwatch(progress)
    plan = make_plan(*size, settings.samples, memory=settings.memory or default_memory())
    engine = watch.stage("load", lambda: engines.start(settings.device, settings.threads))
    built = watch.stage("build", lambda: build_for(scene, settings))
    pose = scene.camera(camera)

    from lippmann.rendering.film.wavefront import trace_frame

    source = _camera_rays(scene, settings, pose, size)
    camera_from_world = np.linalg.inv(np.asarray(pose.world_from_camera, dtype=np.float64))
    integrator = watch.stage("build", lambda: make_integrator(built, settings, camera_from_world, source))
    frame = trace_frame(
        integrator, source, plan, seed=settings.seed, box_filter=settings.pixel_filter == "box", progress=progress
    )
    options = {"pixel_filter": settings.pixel_filter, "camera": pose.name}
    provenance = provenance_of(scene, built, settings, engine, frame, watch, samples=settings.samples, options=options)
    return Preview(frame.pixels, provenance)


def _camera_rays(scene: Scene, settings: RenderSettings, pose: Camera, size: tuple[int, int]) -> RaySource:
    """Rays of the camera that takes the picture: of a classic scene its own, with all that only such a camera does."""
    if settings.integrator == "classic" and scene.classic is not None:
        from lippmann.rendering.transport.whitted_camera import ClassicCameraRays

        return ClassicCameraRays(scene.classic.camera, scene.classic.handedness, *size)
    from lippmann.rendering.transport.ray_source import CameraRays

    return CameraRays(pose, *size)


def make_integrator(
    built: BuiltScene | BuiltClassic,
    settings: RenderSettings,
    display_from_world: NDArray[np.float64],
    source: RaySource,
) -> Any:
    """The integrator that ``settings`` name, for a built scene.

    The scene's lamps are drawn by the light that they shed on the whole picture, whose rays are ``source``: those who
    render parts of one picture must give the same.
    """
    from lippmann.device.whitted.scene import BuiltClassic
    from lippmann.rendering.transport.light_sampling import weigh_lamps
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.scene_flags import make_traits
    from lippmann.rendering.transport.surface_property import SurfaceIntegrator, SurfaceProperty
    from lippmann.rendering.transport.whitted import ClassicIntegrator

    if isinstance(built, BuiltClassic):
        return ClassicIntegrator(built, settings.surfaces)
    if settings.integrator in ("path", "direct"):
        traits = make_traits(
            built.mitsuba, background=built.background, has_null=built.has_null, absorption=built.absorption
        )
        integrator = PathIntegrator(built.mitsuba, traits, settings.surfaces, name=settings.integrator)
        if not built.borrowed:
            weigh_lamps(integrator, source)
        return integrator
    return SurfaceIntegrator(built.mitsuba, cast(SurfaceProperty, settings.integrator), display_from_world)


def default_memory() -> int:
    """The memory limit in bytes where the user set none."""
    return int(machine.available_memory() * DEFAULT_MEMORY_SHARE)


def build_for(scene: Scene, settings: RenderSettings) -> BuiltScene | BuiltClassic:
    """The scene on the device, in the form that the integrator needs.

    Raises
    ------
    UsageError
        The classic integrator is asked for a scene that has no such form.
    """
    if settings.integrator == "classic":
        from lippmann.device.whitted.scene import build_classic

        if scene.classic is None:
            raise UsageError(f"'{scene.name}' has no form for the classic light models", where="--integrator")
        return build_classic(scene.classic)
    from lippmann.device.pbr import build

    return build(scene)


def scene_notes(scene: Scene, built: BuiltScene | BuiltClassic) -> tuple[str, ...]:
    """What reader and builder had to say, one line each."""
    from lippmann.device.pbr import BuiltScene

    return (*scene.notes, *built.notes) if isinstance(built, BuiltScene) else built.scene.notes


def transfer_of(settings: RenderSettings) -> Transfer:
    """How the values become codes: those of the classic models are codes already, as their own programs write them."""
    return "linear" if settings.integrator == "classic" else "srgb"


def ray_counts(frame: Frame) -> dict[str, int]:
    """The rays of a frame by kind."""
    return {"primary": frame.rays.primary, "shadow": frame.rays.shadow, "secondary": frame.rays.secondary}


def stage_seconds(watch: Stopwatch, frame: Frame) -> dict[str, float]:
    """Seconds by stage, in the order of the work; ``write`` is added by who writes."""
    return {
        "load": watch.seconds.get("load", 0.0),
        "build": watch.seconds.get("build", 0.0),
        "compile": frame.seconds_compile,
        "trace": frame.seconds_trace,
        "reuse": frame.seconds_reuse,
        **{name: watch.seconds[name] for name in ("denoise", "layers") if name in watch.seconds},
        "write": 0.0,
        "total": watch.total,
    }


def _frame_notes(frame: Frame) -> tuple[str, ...]:
    if not frame.rays.discarded:
        return ()
    return (f"{frame.rays.discarded} samples were not finite and count as black",)
