"""Everything called "auto", decided once: from a request and a scene to a request that says all.

The scene decides the light: scenes made for the classic light models are rendered by ``classic``, with the ray depth of
their file and one sample in the middle of each pixel; all others by ``path``, with samples spread over the pixel. The
display decides about sub-pixels: behind a slanted sheet each has a direction of its own, and rays of its own.

Light is pooled, so that few samples make a clean picture, with as many samples as the size of the picture allows in a
short time, or as a quality or a time takes. With ever more samples the pooled picture converges to that of full
rendering, see :mod:`lippmann.rendering.denoise.noisy_blend`. Methods that reuse points have errors that no estimate
covers, and are taken only by name, as is full rendering, for references.
"""

from __future__ import annotations

import math
from dataclasses import replace

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.rendering.request.choices import LIGHT, POOLED_LIGHT, REUSING, Denoiser, Integrator
from lippmann.rendering.request.off_surface_request import with_light_off_surfaces
from lippmann.rendering.request.preconditions import Form, check
from lippmann.rendering.request.render_request import DEFAULT_SPP, RenderRequest
from lippmann.scene.light_options import LightOptions
from lippmann.scene.scene import Scene

#: Samples that a pooled picture is made of where no number is given: half a second of two cores.
SAMPLE_BUDGET = 1 << 20
#: Fewest and most samples that a pixel gets of them; sub-pixels of very large pictures have two each.
_FEWEST, _FEWEST_OF_MANY, _MANY, _MOST = 4, 2, 1 << 24, 16
#: By how much the samples of a picture may be multiplied that is not clean with them, by the values that it has at
#: most. Beyond that a pass takes minutes: who asks for so large a picture may say how clean it shall be.
_RESERVE = {SAMPLE_BUDGET: 8, 1 << 24: 4, 1 << 25: 2}


def resolve(
    request: RenderRequest,
    scene: Scene,
    display: Display | None = None,
    form: Form = "picture",
    *,
    size: tuple[int, int] | None = None,
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
    size:
        Width and height of the picture in pixels, where it is not the display's.

    Returns
    -------
    RenderRequest
        With an integrator, a pixel filter, a depth, a method and a choice about sub-pixels; ``reason`` says why it is
        that method, if the user left it open. ``spp`` stays None where a quality or a time says when to stop;
        ``exposure`` stays "auto" where it is to be measured.

    Raises
    ------
    UsageError, PictureError
        What is asked for cannot be done in this form, or for this scene or display.
    """
    is_draft = request.effort == "draft"
    if is_draft:
        request = replace(request, effort="normal", spp=1)
    if scene.lies_off_surfaces:
        request = with_light_off_surfaces(request, scene)
    elif scene.is_unlit:
        request = _with_unlit_surfaces(request, scene)
    lit = _with_light(request, scene, of_own_camera=form == "preview")
    if is_draft and form != "preview":
        lit = _with_fast_denoiser(lit)
    complete = _with_subpixels(_with_method(lit, form), None if form == "quilt" else display)
    if complete.spp is None and not complete.is_open_ended:
        if size is None and display is not None:
            size = display.panel.width, display.panel.height
        samples = _choose_samples(complete, size)
        complete = replace(complete, spp=samples, spp_reserve=_choose_reserve(complete, form, size, samples))
    check(complete, form, display)
    return complete


def _with_unlit_surfaces(request: RenderRequest, scene: Scene) -> RenderRequest:
    """The request, as far as surfaces that nothing lights decide what it leaves open.

    Their colours are made for displays: there are no tones to be mapped. One ray through the middle of each pixel shows
    a photograph, which has no noise that a network could take out; other scenes are seen by their outlines, too, which
    samples and a network make smooth.
    """
    if request.integrator not in ("auto", *POOLED_LIGHT):
        return request
    plain = scene.fills_panel and request.method in ("auto", "full") and request.denoise in ("auto", "none")
    one_ray = plain and request.spp in (None, 1) and not request.is_open_ended
    return replace(
        request,
        method="full" if plain else request.method,
        denoise="none" if plain else request.denoise,
        spp=1 if one_ray else request.spp,
        pixel_filter="point" if one_ray and request.pixel_filter == "auto" else request.pixel_filter,
        exposure=0.0 if request.exposure == "auto" else request.exposure,
        tone_map="none" if request.tone_map == "auto" else request.tone_map,
        reason="full: a photograph has no noise" if plain and request.method == "auto" else request.reason,
    )


def _with_subpixels(request: RenderRequest, display: Display | None) -> RenderRequest:
    """With rays of their own for sub-pixels, or without; ``display`` is None where nothing has sub-pixels."""
    if request.subpixels is not None:
        return request
    apart = display is not None and display.has_slanted_stripes
    return replace(request, subpixels=apart and request.integrator in LIGHT and request.method not in REUSING)


def _choose_samples(request: RenderRequest, size: tuple[int, int] | None) -> int:
    """Samples per pixel, or sub-pixel, where no number is given: a power of two for pooled light."""
    if request.method != "pooled" or size is None:
        return DEFAULT_SPP
    values = size[0] * size[1] * request.channels
    fewest = _FEWEST_OF_MANY if request.subpixels and values > _MANY else _FEWEST
    allowed = SAMPLE_BUDGET / values
    return min(max(1 << max(round(math.log2(allowed)), 0), fewest), _MOST)


def _choose_reserve(request: RenderRequest, form: Form, size: tuple[int, int] | None, samples: int) -> int | None:
    """Samples that a picture may have in all if it is not clean with ``samples``; None for no more than those."""
    if form != "picture" or request.method != "pooled" or size is None:
        return None
    values = size[0] * size[1] * request.channels
    return next((factor * samples for most, factor in _RESERVE.items() if values <= most), None)


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
    if classic is not None and scene.light != LightOptions():
        raise UsageError(
            "the light is to be another than the file's",
            parameter="integrator",
            rule="classic light models know no other direction and strength",
            fix='use integrator="path"',
        )
    depth, spp, pixel_filter = request.depth, request.spp, request.pixel_filter
    if classic is not None:
        depth = classic.camera.ray_depth if depth is None else depth
    if spp is None and classic is not None and not request.is_open_ended:
        spp = 1 + (classic.camera.antialiasing if of_own_camera else 0)
    if pixel_filter == "auto":
        pixel_filter = "point" if classic is not None and spp == 1 else "box"
    exposure = request.exposure
    if exposure == "auto" and not (integrator in POOLED_LIGHT and scene.has_physical_lights):
        exposure = 0.0
    if exposure and integrator not in POOLED_LIGHT:
        raise _no_light(integrator, "exposure")
    tone_map = request.tone_map
    if tone_map == "auto":
        tone_map = "pbr-neutral" if integrator in POOLED_LIGHT and not scene.has_chosen_background else "none"
    if tone_map != "none" and integrator not in POOLED_LIGHT:
        raise _no_light(integrator, "tone_map")
    return replace(
        request,
        integrator=integrator,
        depth=depth,
        spp=spp,
        pixel_filter=pixel_filter,
        exposure=exposure,
        tone_map=tone_map,
    )


def _no_light(integrator: Integrator, parameter: str) -> UsageError:
    return UsageError(
        f"the values of {integrator} are no amounts of light",
        parameter=parameter,
        rule=f"it is for {' and '.join(POOLED_LIGHT)}",
        fix="leave it out",
    )


def _with_fast_denoiser(request: RenderRequest) -> RenderRequest:
    """The request of a draft: light is not shared unless that is asked for, as it takes a while for 0.4 dB."""
    if request.denoise != "auto" or request.integrator not in POOLED_LIGHT:
        return request
    if request.method == "pooled":
        return replace(request, denoise="oidn-fast")
    return _full(request, "oidn-fast", "full: a draft, denoised") if request.method == "auto" else request


def _with_method(request: RenderRequest, form: Form) -> RenderRequest:
    """Method and denoiser."""
    if request.method == "pooled" and request.denoise == "auto":
        return replace(request, denoise="oidn")
    if request.method != "auto":
        return replace(request, denoise="none") if request.denoise == "auto" else request
    if request.denoise != "auto":
        asked = "without denoising" if request.denoise == "none" else f"with denoise {request.denoise}"
        return _full(request, request.denoise, f"full {asked}, as asked for")
    if request.integrator not in LIGHT:
        return _full(request, "none", f"full: {request.integrator} has no noise")
    if request.integrator not in POOLED_LIGHT:
        return _full(request, "none", f"full: the light of {request.integrator} is not pooled")
    if form == "preview":
        return _full(request, "none", "full: a plain picture has no micro-images to share light")
    return replace(request, method="pooled", denoise="oidn", reason="pooled: light shared between micro-images")


def _full(request: RenderRequest, denoise: Denoiser, reason: str) -> RenderRequest:
    return replace(request, method="full", denoise=denoise, reason=reason)
