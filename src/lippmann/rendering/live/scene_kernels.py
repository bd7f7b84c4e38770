"""A scene on the device with its recorded kernels, one for each kind of picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.pbr.emitter_updates import EmitterUpdates
from lippmann.display import Display
from lippmann.options.light import LightOptions
from lippmann.rendering.film.memory_model import BYTES_PER_LANE, PREFERRED_LANES
from lippmann.rendering.live.live_tracer import FeatureTracer, LiveIntegrator, LiveTracer
from lippmann.rendering.preparation.exposure import compute_gain, measure_exposure
from lippmann.rendering.preparation.prepare import make_light_sampler, trace_pilot
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import Session, find_uniform_background, make_integrator
from lippmann.rendering.transport.first_surface import make_surfaces
from lippmann.rendering.transport.path import PathIntegrator, PreparedLight
from lippmann.rendering.transport.ray_source import DisplayRays
from lippmann.scene.hull_bounds import bounds_by_hull
from lippmann.scene.placement import Placement

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene

#: Kernels that are cached: pages of a studio may show a scene on several displays.
_MOST_KERNELS = 8

#: Key of a cached tracer: its display, and all else that its kernel depends on.
_Key: TypeAlias = tuple[object, ...]
Kernel = TypeVar("Kernel", LiveTracer, FeatureTracer)


class SceneKernels:
    """The kernels of one scene on the device.

    Parameters
    ----------
    session:
        The scene, built with the light of its file.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.built: BuiltScene = session.built  # type: ignore[assignment]  # live pictures are physically based
        self._updates = EmitterUpdates(session.scene, self.built)
        self._integrators: dict[tuple[str, int], LiveIntegrator] = {}
        self._tracers: dict[_Key, LiveTracer] = {}
        self._features: dict[_Key, FeatureTracer] = {}
        self._exposure: float | None = None
        self._bounds_in = bounds_by_hull(session.scene)
        #: The display as placed for the view whose light and exposure the scene has now.
        self.lit_for: object = None

    @property
    def most_lanes(self) -> int:
        """Lanes of the largest wavefront that fits the memory."""
        return min(PREFERRED_LANES, self.session.memory // BYTES_PER_LANE)

    def place(self, display: Display, request: RenderRequest) -> Placement:
        """The display's placement for a resolved request."""
        return replace(self.session, request=request).find_placement(display, self._bounds_in)

    def can_light(self, light: LightOptions) -> bool:
        """Whether ``light`` can be set without building the scene again."""
        return self._updates.can_apply(light)

    def light(self, light: LightOptions, world_from_viewer: np.ndarray) -> None:
        """Set the scene's light; see :meth:`EmitterUpdates.apply`."""
        self._updates.apply(light, world_from_viewer)

    def tracer(self, display: Display, request: RenderRequest) -> LiveTracer:
        """The tracer of a resolved request."""
        integrator, sampling = self._integrator(request), _sampling_of(request)
        key = display, *sampling, *_traced_by(request)
        tracer = _find_or_make(self._tracers, key, lambda: LiveTracer(display, integrator, *sampling))
        tracer.trace_by(integrator)
        return tracer

    def feature_tracer(self, display: Display, request: RenderRequest) -> FeatureTracer:
        """The tracer of feature buffers of a resolved request."""
        sampling = _sampling_of(request)
        return _find_or_make(
            self._features, (display, *sampling), lambda: FeatureTracer(display, make_surfaces(self.built), *sampling)
        )

    def expose(self, display: Display, request: RenderRequest, placement: Placement, *, measure: bool) -> float:
        """Set the exposure of a resolved request, and return it in stops.

        An "auto" exposure is measured for this placement if ``measure`` is set or none was measured before. The same
        holds for the emitter weights.
        """
        integrator = self._integrator(request)
        if not isinstance(integrator, PathIntegrator):
            return 0.0
        exposure, sampler = request.exposure, integrator.light.sampler
        source = DisplayRays(display, placement.world_from_display, bool(request.subpixels))
        if (measure or integrator.light.gain is None) and not self.built.borrowed:
            sampler = make_light_sampler(integrator.scene, trace_pilot(integrator.lit_by(PreparedLight()), source))
        if exposure == "auto":
            if measure or self._exposure is None:
                plain = integrator.lit_by(PreparedLight(sampler, gain=dr.opaque(mi.Float, 1.0)))
                background = find_uniform_background(self.built, request)
                self._exposure = measure_exposure(plain, source, background, self.session.memory, request.seed)
            exposure = self._exposure
        else:
            exposure += self.session.choose_own_exposure(placement.exposure)
        gain, clamp = compute_gain(exposure), request.clamp_indirect
        most_indirect = None if clamp is None else dr.opaque(mi.Float, clamp / gain)
        light = PreparedLight(sampler, dr.opaque(mi.Float, gain), most_indirect)
        self._integrators[_traced_by(request)] = integrator.lit_by(light)
        return exposure

    def _integrator(self, request: RenderRequest) -> LiveIntegrator:
        kind = _traced_by(request)
        if kind not in self._integrators:
            made = make_integrator(self.built, request, np.eye(4))
            assert isinstance(made, LiveIntegrator)
            self._integrators[kind] = made
        return self._integrators[kind]


def _traced_by(request: RenderRequest) -> tuple[str, int]:
    return request.integrator, request.surfaces


def _sampling_of(request: RenderRequest) -> tuple[bool, bool]:
    """Whether sub-pixels have rays of their own, and whether samples are spread over the pixel."""
    return bool(request.subpixels), request.box_filter


def _find_or_make(kernels: dict[_Key, Kernel], key: _Key, make: Callable[[], Kernel]) -> Kernel:
    if key not in kernels:
        while len(kernels) >= _MOST_KERNELS:
            del kernels[next(iter(kernels))]
        kernels[key] = make()
    return kernels[key]
