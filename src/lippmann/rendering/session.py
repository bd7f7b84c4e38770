"""Rendering sessions: the running engine, the scene on the device, and the display's placement.

Pictures, quilts, previews, forecasts and tiles open a session and get their integrator from it. :func:`open_session`
loads Mitsuba: modules that need it are imported after that.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np

from lippmann.display import Display
from lippmann.display.sheet_layout import trimmed
from lippmann.errors import EngineError, UsageError
from lippmann.options.choices import POOLED_LIGHT, REUSING
from lippmann.options.integrators import INTEGRATORS
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.denoise.oidn import load_denoiser
from lippmann.rendering.film.memory_model import cut_wavefronts
from lippmann.rendering.request.plan import apply_plan
from lippmann.rendering.request.render_request import Choice, RenderRequest
from lippmann.runtime import engine as engines
from lippmann.runtime import machine
from lippmann.runtime.plugins import function_of
from lippmann.scene.camera_placement import CameraView, VisibleDepth
from lippmann.scene.matrices import rotation_of
from lippmann.scene.placement import Placement, place
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Color, Matrix

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic
    from lippmann.options.placement import PlacementOptions
    from lippmann.rendering.transport.integrator import Integrator
    from lippmann.rendering.transport.ray_source import DisplayRays, RaySource

#: Share of the free memory that is used where no limit is given.
DEFAULT_MEMORY_SHARE = 0.6

T = TypeVar("T")

#: :func:`lippmann.device.pbr.build`, or a function in its place.
Build: TypeAlias = "Callable[..., BuiltScene]"


@dataclass
class Stopwatch:
    """Seconds by stage; progress is reported as each stage begins and ends."""

    progress: ProgressCallback = silent
    seconds: dict[str, float] = field(default_factory=dict)
    started: float = field(default_factory=time.perf_counter)

    def stage(self, name: str, work: Callable[[], T]) -> T:
        """Do ``work`` and return its result; its seconds are added to those of the stage ``name``."""
        self.progress(Progress(name, 0, 1))
        start = time.perf_counter()
        result = work()
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
        self.progress(Progress(name, 1, 1))
        return result

    @property
    def total(self) -> float:
        """Seconds since the stopwatch was made."""
        return time.perf_counter() - self.started


@dataclass(frozen=True, eq=False)
class Session:
    """A scene ready to be rendered. Make one with :func:`open_session`.

    Attributes
    ----------
    scene, request:
        What is rendered, and how; the request is a resolved one.
    engine:
        The engine, as it was started.
    built:
        The scene on the device.
    memory:
        Bytes that the picture may use.
    watch:
        Times the stages and reports them.
    """

    scene: Scene
    request: RenderRequest
    engine: engines.Engine
    built: BuiltScene | BuiltClassic
    memory: int
    watch: Stopwatch
    #: Cached visible depths by camera view: films ask for the same ones in every frame.
    depths: dict[bytes, VisibleDepth | None] = field(default_factory=dict)

    def place(self, display: Display) -> Placement:
        """Place ``display`` in the scene, warn of what its edge cuts, and turn light that follows the viewer.

        Raises
        ------
        UsageError, SceneError
            As :func:`lippmann.scene.placement.place`.
        """
        placement = self.find_placement(display)
        self.face_viewer(rotation_of(placement.world_from_display))
        if placement.may_cut is None:
            return placement
        warnings = *placement.warnings, *self._warn_of_cut(display, placement.may_cut, placement)
        return replace(placement, warnings=warnings, may_cut=None)

    def _warn_of_cut(self, display: Display, options: PlacementOptions, placement: Placement) -> tuple[str, ...]:
        from lippmann.rendering.transport.first_hits import find_cut_edges

        where = trimmed(display), placement.world_from_display, self.engine.threads
        cut = self.watch.stage("build", lambda: find_cut_edges(self.built, *where))
        if cut is None:
            return ()
        sides = ", ".join(f"{side} {100 * share:.0f} %" for side, share in cut.shares.items())
        x, y, z = options.shift
        fix = f"shift={x:g},{y:g},{z - cut.height:.3g}"
        if placement.mode == "camera" and options.pop_out != 0.0:
            fix = f"pop_out=0 or {fix}"
        what = f"the panel's edge cuts what stands up to {cut.height:.3g} mm in front of it"
        return (f"{what} ({sides}): {fix} sets it behind",)

    def rays(self, display: Display, placement: Placement) -> DisplayRays:
        """Rays through the native (sub-)pixels of a display that stands at a place."""
        from lippmann.rendering.transport.ray_source import DisplayRays

        return DisplayRays(placement.traced(display), placement.world_from_display, bool(self.request.subpixels))

    def find_placement(self, display: Display, bounds_in: Callable[[Matrix], Matrix] | None = None) -> Placement:
        """As :meth:`place`, without warnings and with the light as it is; ``bounds_in`` replaces the scene's."""
        scene, placement = self.scene, self.request.placement
        if isinstance(placement, Placement):
            return placement
        return place(
            scene.bounds,
            trimmed(display),
            cameras=scene.cameras,
            options=placement,
            home_camera=scene.display_camera,
            contains_home=scene.home_may_move,
            bounds_in=bounds_in or scene.bounds_in,
            extreme_points=lambda: scene.extreme_points,
            is_unbounded=scene.is_unbounded,
            fills_panel=scene.fills_panel,
            probe=self._probe_depth,
        )

    def face_viewer(self, world_from_viewer: Matrix) -> None:
        """Turn light that follows the viewer, such as the studio's, by a rotation ``(4, 4)``."""
        from lippmann.device.pbr import BuiltScene
        from lippmann.device.pbr.emitters import turn_environment

        if not isinstance(self.built, BuiltScene):
            return
        environment, emitter = self.scene.environment, self.built.mitsuba.environment()
        if environment is not None and environment.follows_viewer and emitter is not None:
            turn_environment(emitter, world_from_viewer @ environment.world_from_environment)

    def _probe_depth(self, view: CameraView) -> VisibleDepth | None:
        from lippmann.rendering.transport.first_hits import probe_depth

        key = np.array(
            [*np.ravel(view.world_from_camera), view.half_width, view.half_height, view.is_parallel]
        ).tobytes()
        if key not in self.depths:
            if len(self.depths) >= 64:
                self.depths.clear()
            self.depths[key] = self.watch.stage("build", lambda: probe_depth(self.built, view))
        return self.depths[key]

    def integrator(self, source: RaySource, frame_from_world: Matrix, own_exposure: float = 0.0) -> Integrator:
        """The integrator that the request names, for the built scene.

        Parameters
        ----------
        source:
            Rays of the whole picture, which the pilot traces to weigh emitters. All parts of one picture give the same.
        frame_from_world:
            ``(4, 4)``: to the frame of surface properties, such as normals.
        own_exposure:
            Stops of the camera from which the picture is taken.
        """

        def make() -> Integrator:
            unlit = make_integrator(self.built, self.request, frame_from_world)
            return self._put_in_front(self._prepare_light(unlit, source, own_exposure), frame_from_world)

        return self.watch.stage("build", make)

    def _put_in_front(self, integrator: Integrator, frame_from_world: Matrix) -> Integrator:
        """``integrator`` with the scene's splats or volume, if any, composited in front of its radiance."""
        from lippmann.device.pbr import BuiltScene
        from lippmann.rendering.transport.in_front import GridVolumeIntegrator, SplatIntegrator

        built = self.built
        if not isinstance(built, BuiltScene):
            return integrator
        if built.volume is not None:
            return GridVolumeIntegrator(integrator, built, built.volume, frame_from_world, self.engine.threads)
        if built.splats is not None:
            return SplatIntegrator(integrator, built, built.splats, self.engine.threads)
        return integrator

    def choose_own_exposure(self, own_exposure: float) -> float:
        """``own_exposure`` where the light is that of the scene's file; 0 for the built-in studio."""
        scene = self.scene
        is_lit = scene.has_physical_lights or (scene.environment is not None and not scene.in_studio)
        return own_exposure if is_lit else 0.0

    def _prepare_light(self, integrator: Integrator, source: RaySource, own_exposure: float) -> Integrator:
        from lippmann.device.pbr import BuiltScene
        from lippmann.rendering.preparation.prepare import prepare_light
        from lippmann.rendering.transport.path import PathIntegrator

        if not isinstance(integrator, PathIntegrator):
            return integrator
        prepare = partial(
            prepare_light,
            integrator,
            self.request,
            source,
            memory_limit(self.request),
            find_uniform_background(self.built, self.request),
            own_exposure=self.choose_own_exposure(own_exposure),
            stands_alone=not self.scene.lies_off_surfaces,
            weighs_emitters=isinstance(self.built, BuiltScene) and not self.built.borrowed,
        )
        keep = self.request.keep_light
        return integrator.lit_by(prepare() if keep is None else keep(prepare, self.scene, self.built, own_exposure))

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks of the scene's reader and builder, one line each."""
        from lippmann.device.pbr import BuiltScene

        built = self.built
        return (*self.scene.notes, *built.notes) if isinstance(built, BuiltScene) else built.scene.notes


def open_session(
    scene: Scene,
    request: RenderRequest,
    size: tuple[int, int] | None = None,
    *,
    memory: int | None = None,
    progress: ProgressCallback = silent,
    build: Build | None = None,
) -> Session:
    """Start the engine and build the scene; what cannot be done is refused before anything is loaded.

    Parameters
    ----------
    scene, request:
        What is rendered, and how: what :func:`~lippmann.rendering.request.plan.resolve` returned.
    size:
        Width and height of the picture in pixels, which must fit the memory; None where it is rendered in tiles.
    memory:
        Bytes that the picture may use, instead of the request's.
    progress:
        Told of all stages.
    build:
        Instead of :func:`lippmann.device.pbr.build`, such as for a scene that is kept on the device.

    Raises
    ------
    MemoryLimitError, SceneError, EngineError
        As the stages find them.
    """
    watch = Stopwatch(progress)
    memory = memory or memory_limit(request)
    if size is not None:
        cut_wavefronts(*size, 1, channels=request.channels, memory=memory)
    if request.denoises:
        load_denoiser()
    engine = watch.stage("load", lambda: engines.start(request.device, request.threads))
    built = watch.stage("build", lambda: _build(scene, request, engine, memory, build))
    request = _without_pooling(request, built)
    return Session(scene, request, engine, built, memory, watch)


def _without_pooling(request: RenderRequest, built: BuiltScene | BuiltClassic) -> RenderRequest:
    """The request for a scene that may have participating media, whose light lies on no surface to be shared."""
    from lippmann.device.pbr import BuiltScene

    if not (isinstance(built, BuiltScene) and built.has_media) or request.integrator not in POOLED_LIGHT:
        return request
    if request.method == "pooled" and request.plan is not None and request.reason:
        plan = replace(request.plan, method=Choice("full", "participating media, whose light lies on no surface"))
        return apply_plan(plan, request)
    if request.method == "pooled" or request.method in REUSING:
        raise UsageError(
            f"{request.method} shares the light of surfaces",
            parameter="method",
            rule="this scene has participating media, whose light lies on none",
            fix='use method="full"',
        )
    return request


def find_uniform_background(built: BuiltScene | BuiltClassic, request: RenderRequest) -> Color | None:
    """The colour of all rays that hit nothing; None if they differ, as before an environment."""
    if request.integrator not in POOLED_LIGHT or getattr(built, "has_media", False):
        return None  # a medium may surround the scene
    return getattr(built, "background", None)


def memory_limit(request: RenderRequest) -> int:
    """The memory in bytes that a picture may use: the request's, or a share of what is free."""
    return request.memory or int(machine.available_memory() * DEFAULT_MEMORY_SHARE)


def _build(
    scene: Scene, request: RenderRequest, engine: engines.Engine, memory: int, build: Build | None
) -> BuiltScene | BuiltClassic:
    """The scene on the device, in the form that the integrator needs."""
    if request.integrator == "classic":
        from lippmann.device.whitted.scene import build_classic

        assert scene.classic is not None  # the resolver refuses others
        return build_classic(scene.classic)
    from lippmann.device import pbr

    return (build or pbr.build)(scene, engine, memory=memory)


def make_integrator(built: BuiltScene | BuiltClassic, request: RenderRequest, frame_from_world: Matrix) -> Integrator:
    """The integrator that a resolved request names, with no light prepared; see :meth:`Session.integrator`."""
    plugin = INTEGRATORS.find(request.integrator)
    assert plugin is not None  # options know no others
    with plugin.guard(EngineError):
        integrator: Integrator = function_of(plugin.value.make)(built, request, frame_from_world)
    return integrator


def read_choices(integrator: Integrator) -> Mapping[str, object]:
    """Choices and measured values of the integrator's prepared light, by option name; empty where none is prepared."""
    choices: Mapping[str, object] = getattr(integrator, "choices", {})
    return choices


def make_whitted(built: BuiltClassic, request: RenderRequest, frame_from_world: Matrix) -> Integrator:
    from lippmann.rendering.transport.whitted import WhittedIntegrator

    return WhittedIntegrator(built, request.surfaces)


def make_path(built: BuiltScene, request: RenderRequest, frame_from_world: Matrix) -> Integrator:
    """Path tracing, through participating media where there are some."""
    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.volume_path import VolumePathIntegrator

    if built.has_media:
        clamps, photons = request.clamp_indirect is not None, request.caustics not in ("auto", "paths")
        if clamps or photons:
            name = ("caustics", "clamp_indirect")[clamps]
            rule = "this scene has participating media, whose light is not clamped, and through which no photons go"
            raise UsageError(
                f"'{getattr(request, name)}' does not apply", parameter=name, rule=rule, fix="leave it out"
            )
        return VolumePathIntegrator(built.mitsuba, request.surfaces, request.integrator, built.background)
    features = make_scene_features(
        built.mitsuba, background=built.background, has_null=built.has_null, absorption=built.absorption
    )
    return PathIntegrator(built.mitsuba, features, request.surfaces, name=request.integrator)


def make_surface(built: BuiltScene, request: RenderRequest, frame_from_world: Matrix) -> Integrator:
    from lippmann.rendering.transport.surface_property import SurfaceIntegrator

    return SurfaceIntegrator(built.mitsuba, request.integrator, frame_from_world)
