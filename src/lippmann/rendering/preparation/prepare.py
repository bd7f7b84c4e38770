"""Prepares the light of a picture: emitter weights, photons, exposure, light vertices, and specular chains."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import drjit as dr
import mitsuba as mi

from lippmann.options.choices import REUSING
from lippmann.rendering.film import memory_model
from lippmann.rendering.preparation.exposure import gain_of, measure_exposure
from lippmann.rendering.preparation.pilot import Pilot, brightest_specular_light, make_light_sampler, trace_pilot
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.casters import find_casters, has_sharp_surfaces, hides_caustics
from lippmann.rendering.transport.caustic_photons import CausticPhotons, emissions, no_photons
from lippmann.rendering.transport.light_vertices import LightVertexPasses
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.prepared_light import PreparedLight
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.rendering.transport.tuning import TUNING as TRANSPORT
from lippmann.scene.values.description import Color


def prepare_light(
    paths: PathIntegrator,
    request: RenderRequest,
    source: RaySource,
    memory: int,
    background: Color | None = None,
    own_exposure: float = 0.0,
    stands_alone: bool = True,
    weighs_emitters: bool = True,
) -> PreparedLight:
    """The prepared light of a picture, for :meth:`PathIntegrator.lit_by`.

    Parameters
    ----------
    paths:
        A path integrator of the scene; its own light is ignored.
    request:
        The resolved request.
    source:
        Rays of the whole picture, also where a part of it is rendered.
    memory:
        Bytes for photons.
    background:
        Colour of rays without a hit; see :func:`~lippmann.rendering.preparation.exposure.measure_exposure`.
    own_exposure:
        The camera's own exposure in stops, to which a fixed exposure is added.
    stands_alone:
        Whether the integrator's radiance is all that is seen: nothing, such as splats, is composited over it.
    weighs_emitters:
        Whether emitters are sampled by their contribution to the picture, not by the scene's weights.

    Raises
    ------
    MemoryLimitError
        ``memory`` bytes do not hold the photons that were asked for.
    """
    light, choices = PreparedLight(), dict[str, object]()
    pilot = trace_pilot(paths.lit_by(light), source)
    if weighs_emitters:
        light = replace(light, sampler=make_light_sampler(paths.scene, pilot))
    if own_exposure:
        choices["camera_exposure"] = own_exposure
    if request.exposure != "auto":
        request = replace(request, exposure=request.exposure + own_exposure)

    caustics = shoot_photons(paths.lit_by(light), request, source, pilot, memory)
    light = replace(light, photons=caustics.photons, photon_passes=caustics.passes)
    exposure = request.exposure
    if exposure == "auto":
        exposure = measure_exposure(paths.lit_by(light), source, background, memory, request.seed)
    gain = gain_of(exposure) if exposure else 1.0
    if caustics.way is not None:
        choices["caustics"] = caustics.way
    if exposure:
        light = replace(light, gain=mi.Float(gain))
        choices["exposure"] = exposure

    passes = trace_light_vertices(paths.lit_by(light), request, pilot, gain)
    if passes is not None:
        light = replace(light, light_vertices=passes.of_pass(0), vertex_passes=passes)
        choices["light_vertices"] = TRANSPORT.light_vertices
    if request.clamp_indirect is not None:
        light = replace(light, most_indirect=mi.Float(request.clamp_indirect / gain))
    chains = count_chains(paths.lit_by(light), request, source) if stands_alone else 0
    if chains:
        light = replace(light, chains=dr.opaque(mi.UInt32, chains))
        choices["seen_chains"] = chains
    return replace(light, choices=choices)


def trace_light_vertices(
    integrator: PathIntegrator, request: RenderRequest, pilot: Pilot, gain: float
) -> LightVertexPasses | None:
    """Light vertices for a picture whose indirect light is noisy without them; None for others.

    Parameters
    ----------
    pilot:
        The picture's pilot.
    gain:
        Factor on radiance of the picture's exposure.
    """
    if request.integrator != "path" or request.surfaces < 2:
        return None
    if gain * pilot.brightest_indirect <= 1:
        return None
    sampler, scene = integrator.light_sampler, integrator.scene
    passes = LightVertexPasses(scene, sampler, TUNING.pass_samples, request.seed, pilot.region)
    return None if passes.are_none else passes


def count_chains(integrator: PathIntegrator, request: RenderRequest, source: RaySource) -> int:
    """Specular chains per path (:mod:`~lippmann.rendering.transport.specular_chains`): a fixed number, or 0.

    A denoiser takes highlights for noise. So a denoised picture has specular chains if one of the pilot's meets light
    brighter than white. Pictures of one ray through each pixel's centre and reprojected ones have none.
    """
    is_denoised = request.denoise != "none" and request.box_filter and request.method not in REUSING
    if not is_denoised or not has_sharp_surfaces(integrator.scene):
        return 0
    return TUNING.chains if brightest_specular_light(integrator, source) > 1 else 0


@dataclass(frozen=True, eq=False)
class Caustics:
    """The technique that renders a picture's caustics, with its photons.

    Attributes
    ----------
    way:
        ``photons``, ``paths`` or ``none`` (left out); None where the scene has no caustics.
    photons, passes:
        See :class:`~lippmann.rendering.transport.prepared_light.PreparedLight`.
    """

    way: Literal["photons", "paths", "none"] | None
    photons: PhotonMap | None = None
    passes: CausticPhotons | None = None


def shoot_photons(
    integrator: PathIntegrator, request: RenderRequest, source: RaySource, pilot: Pilot, memory: int
) -> Caustics:
    """Choose the technique of caustics for the picture of ``source``, and shoot their photons.

    Photons are used wherever an emitter and a caster form a pair, and some photons land within the visible region.

    Raises
    ------
    MemoryLimitError
        Photons were asked for, and ``memory`` bytes do not hold them. Where they were not, caustics are left to paths.
    """
    if request.integrator != "path" or request.surfaces < 2:
        return Caustics(None)
    if request.caustics == "paths":
        return _left_to_paths(integrator)
    if request.caustics == "none":
        return Caustics("none", no_photons())
    casters = find_casters(integrator.scene)
    if casters.pairs == 0:
        return Caustics(None)
    pixels = source.width * source.height * source.channels
    # A pass serves no more samples than the picture has.
    samples = pixels * (TUNING.pass_samples if request.is_open_ended else min(TUNING.pass_samples, request.samples))
    passes = 2 if request.is_open_ended else -(-request.samples // TUNING.pass_samples)
    # Memory that is short does not reduce the photons: a picture does not depend on it.
    required = memory_model.photons(emissions(samples), passes)
    if required > memory:
        if request.caustics == "auto":
            return _left_to_paths(integrator)
        raise memory_model.too_small(memory, "photons of caustics", required)
    photons = CausticPhotons(
        integrator.scene,
        integrator.features,
        casters,
        samples=samples,
        pass_samples=TUNING.pass_samples,
        seed=request.seed,
        region=pilot.region,
        kept=max(1, min(passes, int(TUNING.kept_share * memory) // memory_model.photons(emissions(samples), 1))),
    )
    return Caustics(None) if photons.are_none else Caustics("photons", photons.of_pass(0), photons)


def _left_to_paths(integrator: PathIntegrator) -> Caustics:
    return Caustics("paths" if hides_caustics(integrator.scene) else None)
