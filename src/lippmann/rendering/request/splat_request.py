"""Requests for scenes with Gaussian splats: what is left open, and what cannot be asked for."""

from __future__ import annotations

from dataclasses import replace

from lippmann.errors import UsageError
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import SceneDescription


def with_splats(request: RenderRequest, scene: Scene) -> RenderRequest:
    """The request, as far as splats decide what it leaves open.

    Splats have no noise: without surfaces beside them one ray through the middle of each pixel shows them. Their
    colours are made for displays, so that tones are mapped only where that is asked for by name.

    Raises
    ------
    UsageError
        It asks for something that splats do not have: a surface, light to be shared or denoised, an exposure.
    """
    description = scene.description
    assert isinstance(description, SceneDescription)
    alone = not description.placements
    _check(request, scene.name, alone)
    one_ray = alone and request.spp in (None, 1) and not request.is_open_ended
    return replace(
        request,
        method="full",
        denoise="none",
        caustics="paths" if request.caustics == "auto" else request.caustics,
        spp=1 if one_ray else request.spp,
        pixel_filter="point" if one_ray and request.pixel_filter == "auto" else request.pixel_filter,
        tone_map="none" if request.tone_map == "auto" else request.tone_map,
        reason=_reason(alone) if request.method == "auto" else request.reason,
    )


def _reason(alone: bool) -> str:
    return "full: splats have no noise" if alone else "full: splats, whose light lies on no surface"


def _check(request: RenderRequest, name: str, alone: bool) -> None:
    if request.method not in ("auto", "full"):
        raise UsageError(
            f"{request.method} shares the light of surfaces",
            where=name,
            parameter="method",
            rule="this scene has Gaussian splats, whose light lies on none",
            fix='use method="full"',
        )
    if request.integrator not in ("auto", "path", "direct"):
        raise _no_surface(name, "integrator", f"{request.integrator} is told of surfaces")
    if request.layers:
        raise _no_surface(name, "layers", "are told of surfaces")
    if request.denoise not in ("auto", "none"):
        raise _no_surface(name, "denoise", f"{request.denoise} goes by the edges of surfaces")
    if request.caustics == "photons":
        raise _no_surface(name, "caustics", "photons land on surfaces")
    if alone and request.exposure not in ("auto", 0.0):
        raise UsageError(
            f"{request.exposure:g} will not do",
            where=name,
            parameter="exposure",
            rule="the colours of Gaussian splats are made for displays, and are no amounts of light",
            fix="leave it out",
        )


def _no_surface(name: str, parameter: str, what: str) -> UsageError:
    rule = "this scene has Gaussian splats, which have none"
    return UsageError(what, where=name, parameter=parameter, rule=rule, fix="leave it out")
