"""What an integrator is given before a picture, by looks at the scene: photons, exposure, chains, and the beam."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi

from lippmann.rendering.film.caustics import give_photons, take_photons
from lippmann.rendering.film.exposure import gain_of, measure_exposure
from lippmann.rendering.film.lit_surfaces import give_light_vertices
from lippmann.rendering.film.seen_chains import count_chains
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.beam import beam_of
from lippmann.rendering.transport.casters import has_sharp_surfaces
from lippmann.rendering.transport.light_vertices import POINTS
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.scene.values.description import Color

#: What :func:`prepare_light` may tell.
_TOLD = ("camera_exposure", "caustics", "exposure", "light_vertices", "seen_chains")


def tell_anew(choices: dict[str, object], told: dict[str, object]) -> None:
    """Put what was told of a picture in place of what was of an earlier one."""
    for name in _TOLD:
        choices.pop(name, None)
    choices.update(told)


def prepare_light(
    integrator: PathIntegrator,
    request: RenderRequest,
    source: RaySource,
    memory: int,
    background: Color | None = None,
    own_exposure: float = 0.0,
    stands_alone: bool = True,
) -> dict[str, object]:
    """Make the integrator ready for the picture of ``source``; what there is to say of it in the picture's file.

    Parameters
    ----------
    integrator:
        What an earlier picture was given is forgotten.
    request:
        How the picture is to be made.
    source:
        Rays of the whole picture: parts of one picture must be told the same.
    memory:
        Bytes that the photons may take, and light vertices.
    background:
        What rays see that meet nothing, see :func:`~lippmann.rendering.film.exposure.measure_exposure`.
    own_exposure:
        Stops of the camera itself, which a fixed exposure comes on top of.
    stands_alone:
        Nothing lies in front of what the integrator shows, such as splats: whole pixels are its own.

    Raises
    ------
    MemoryLimitError
        ``memory`` bytes do not hold the photons that were asked for.
    """
    integrator.photons = integrator.photon_passes = integrator.seen_chains = None
    integrator.light_vertices = integrator.vertex_passes = None
    integrator.beam = integrator.gain = integrator.most_indirect = None
    told: dict[str, object] = {}
    if own_exposure:
        told["camera_exposure"] = own_exposure
    if request.exposure != "auto":
        request = replace(request, exposure=request.exposure + own_exposure)
    has_sharp = has_sharp_surfaces(integrator.scene)
    # A goal may be reached by samples alone, which are to have no blur.
    is_widened = request.shares_light and not request.is_open_ended and has_sharp
    if is_widened:
        integrator.beam = beam_of(source, request.samples)
    caustics = give_photons(integrator, request, source, memory)
    exposure = request.exposure
    if exposure == "auto":
        exposure = measure_exposure(integrator, source, background, request.seed)
    gain = gain_of(exposure) if exposure else 1.0
    if caustics is not None and not caustics.are_worth_photons(gain):
        take_photons(integrator)
        caustics = None
    if caustics is not None:
        told["caustics"] = caustics.way
    if exposure:
        integrator.gain = mi.Float(gain)
        told["exposure"] = exposure
    if give_light_vertices(integrator, request, source, memory, gain):
        told["light_vertices"] = POINTS
    if request.clamp_indirect is not None:
        integrator.most_indirect = mi.Float(request.clamp_indirect / gain)
    chains = count_chains(integrator.scene, request) if stands_alone else 0
    if chains:
        integrator.seen_chains = dr.opaque(mi.UInt32, chains)
        told["seen_chains"] = chains
        if is_widened:
            integrator.beam = beam_of(source, request.samples * chains)
    return told
