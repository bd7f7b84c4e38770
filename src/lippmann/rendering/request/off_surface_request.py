"""Requests for scenes whose light lies on no surface, Gaussian splats and volumes: what is left open, and what cannot
be asked for.
"""

from __future__ import annotations

from dataclasses import replace

from lippmann.errors import UsageError
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import SceneDescription


def with_light_off_surfaces(request: RenderRequest, scene: Scene) -> RenderRequest:
    """The request, as far as splats or a volume decide what it leaves open.

    They have no noise: without surfaces beside them one ray through the middle of each pixel shows them. Their colours
    are made for displays, so that tones are mapped only where that is asked for by name.

    Raises
    ------
    UsageError
        It asks for something that they do not have: a surface, light to be shared or denoised, an exposure.
    """
    description = scene.description
    assert isinstance(description, SceneDescription)
    alone = not description.placements
    what = "Gaussian splats" if scene.has_splats else "a volume"
    _check(request, scene.name, what, alone)
    one_ray = alone and request.spp in (None, 1) and not request.is_open_ended
    return replace(
        request,
        method="full",
        denoise="none",
        caustics="paths" if request.caustics == "auto" else request.caustics,
        spp=1 if one_ray else request.spp,
        pixel_filter="point" if one_ray and request.pixel_filter == "auto" else request.pixel_filter,
        tone_map="none" if request.tone_map == "auto" else request.tone_map,
        reason=_reason(scene, alone) if request.method == "auto" else request.reason,
    )


def _reason(scene: Scene, alone: bool) -> str:
    if scene.has_splats:
        return "full: splats have no noise" if alone else "full: splats, whose light lies on no surface"
    return "full: volumes have no noise" if alone else "full: a volume, whose light lies on no surface"


def _check(request: RenderRequest, name: str, what: str, alone: bool) -> None:
    if request.method not in ("auto", "full"):
        raise UsageError(
            f"{request.method} shares the light of surfaces",
            where=name,
            parameter="method",
            rule=f"this scene has {what}, whose light lies on none",
            fix='use method="full"',
        )
    rule = f"this scene has {what}, and light that lies on none"
    for parameter, is_asked, why in (
        (
            "integrator",
            request.integrator not in ("auto", "path", "direct"),
            f"{request.integrator} is told of surfaces",
        ),
        ("layers", request.layers, "are told of surfaces"),
        ("denoise", request.denoise not in ("auto", "none"), f"{request.denoise} goes by the edges of surfaces"),
        ("caustics", request.caustics == "photons", "photons land on surfaces"),
    ):
        if is_asked:
            raise UsageError(why, where=name, parameter=parameter, rule=rule, fix="leave it out")
    if alone and request.exposure not in ("auto", 0.0):
        raise UsageError(
            f"{request.exposure:g}",
            where=name,
            parameter="exposure",
            rule=f"must be 0: the colours of {what} are made for displays, and are no amounts of light",
            fix="leave it out",
        )
