"""Light vertices for a picture whose indirect light is noisy without them."""

from __future__ import annotations

from lippmann.rendering.film.memory_model import LIGHT_VERTEX
from lippmann.rendering.preparation.pilot import Pilot
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.light_vertices import LightVertexPasses
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.tuning import TUNING as TRANSPORT


def trace_light_vertices(
    integrator: PathIntegrator, request: RenderRequest, pilot: Pilot, memory: int, gain: float
) -> LightVertexPasses | None:
    """Light vertices for a picture if its indirect light is noisy without them; else None.

    Parameters
    ----------
    pilot:
        Of the picture.
    memory:
        Bytes that those of two passes may take, in both halves of the samples; where these do not hold them, paths find
        all light themselves.
    gain:
        Exposure of the picture.
    """
    if request.integrator != "path" or request.surfaces < 2 or memory < 4 * TRANSPORT.light_vertices * LIGHT_VERTEX:
        return None
    if not request.is_open_ended and request.samples < TUNING.fewest_joined_samples:
        return None
    if pilot.bright_indirect(gain) < TUNING.bright_indirect or pilot.placed > TRANSPORT.most_vertex_emitters:
        return None
    passes = LightVertexPasses(
        integrator.scene,
        integrator.light_sampler,
        TUNING.vertex_pass_samples,
        request.seed,
        pilot.region,
    )
    return None if passes.are_none else passes
