"""Everything called "auto", decided once: from a request and a scene to a request that says all.

The scene decides the light: scenes made for the classic light models are rendered by ``classic``, with the ray depth of
their file and one sample in the middle of each pixel; all others by ``path`` with 16 samples over the pixel.

What is asked for decides the method. A number of samples is an order: so many are traced for every pixel, and nothing
is taken away from what they show. A quality or a time is a goal: full rendering and pooled light, made of the same
samples, compete for it, see :mod:`lippmann.rendering.adaptive.method_race`; for a quality they do so where pooled light
is asked for, too. Methods that reuse points have errors that no estimate covers, and are taken only by name.
"""

from __future__ import annotations

from dataclasses import replace

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.rendering.request.choices import LIGHT, POOLED_LIGHT, Denoiser
from lippmann.rendering.request.preconditions import Form, check
from lippmann.rendering.request.render_request import DEFAULT_SPP, RenderRequest
from lippmann.scene.scene import Scene


def resolve(
    request: RenderRequest, scene: Scene, display: Display | None = None, form: Form = "picture"
) -> RenderRequest:
    """Fill in what ``request`` leaves open, and check that it can be honoured.

    Parameters
    ----------
    request:
        What was asked for.
    scene:
        What is rendered.
    display:
        What it is rendered for; None for the plain picture of a camera.
    form:
        What is made of it: a picture in one piece, one in tiles, a quilt, a forecast, or a camera's plain picture.

    Returns
    -------
    RenderRequest
        With an integrator, a pixel filter, a depth and a method; ``reason`` says why it is that method, if the user
        left it open. ``spp`` stays None where a quality or a time says when to stop, and ``denoise`` stays "auto" where
        plain and pooled pictures compete; ``exposure`` stays "auto" where it is to be measured.

    Raises
    ------
    UsageError, PictureError
        What is asked for cannot be done in this form, or for this scene or display.
    """
    complete = _with_method(_with_light(request, scene, of_own_camera=form == "preview"))
    check(complete, form, display)
    return complete


def _with_light(request: RenderRequest, scene: Scene, of_own_camera: bool) -> RenderRequest:
    """With integrator, depth, samples and pixel filter; the scene's own camera takes the samples that its file says."""
    integrator = request.integrator
    if integrator == "auto":
        integrator = "classic" if scene.is_classic else "path"
    classic = scene.classic if integrator == "classic" else None
    if integrator == "classic" and classic is None:
        raise UsageError(
            f"'{scene.name}' has no form for the classic light models",
            parameter="integrator",
            rule="classic is for Tachyon (.dat) and NFF files and the bundled scenes",
            fix='use integrator="path"',
        )
    depth, spp, pixel_filter = request.depth, request.spp, request.pixel_filter
    if classic is not None:
        depth = classic.camera.ray_depth if depth is None else depth
    if spp is None and not request.is_open_ended:
        spp = DEFAULT_SPP if classic is None else 1 + (classic.camera.antialiasing if of_own_camera else 0)
    if pixel_filter == "auto":
        pixel_filter = "point" if classic is not None and spp == 1 else "box"
    exposure = request.exposure
    if exposure == "auto" and not (integrator in POOLED_LIGHT and scene.has_physical_lights):
        exposure = 0.0
    if exposure and integrator not in POOLED_LIGHT:
        raise UsageError(
            f"the values of {integrator} are no amounts of light",
            parameter="exposure",
            rule=f"it is for {' and '.join(POOLED_LIGHT)}",
            fix="leave it out",
        )
    return replace(request, integrator=integrator, depth=depth, spp=spp, pixel_filter=pixel_filter, exposure=exposure)


def _with_method(request: RenderRequest) -> RenderRequest:
    """Method and denoiser, as far as they can be told before the first sample."""
    if request.method == "pooled" and request.denoise == "auto":
        # Where the samples themselves come to the quality first, no light needs to be pooled.
        return request if request.has_quality else replace(request, denoise="oidn")
    if request.method != "auto":
        return replace(request, denoise="none") if request.denoise == "auto" else request
    if request.denoise != "auto":
        asked = "without denoising" if request.denoise == "none" else f"with denoise {request.denoise}"
        return _full(request, request.denoise, f"full {asked}, as asked for")
    if request.integrator not in LIGHT:
        return _full(request, "none", f"full: {request.integrator} has no noise")
    if not request.is_open_ended:
        return _full(request, "none", "full: no quality is asked for, so samples stay as they are")
    if request.integrator not in POOLED_LIGHT:
        return _full(request, "none", f"full: the light of {request.integrator} is not pooled")
    return _full(request, "auto", "full")


def _full(request: RenderRequest, denoise: Denoiser, reason: str) -> RenderRequest:
    return replace(request, method="full", denoise=denoise, reason=reason)
