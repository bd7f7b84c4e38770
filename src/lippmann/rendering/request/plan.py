"""The plan of a render: everything called "auto", decided in one place, each value with its reason in words.

:func:`make_plan` reads as a table of rules, one function a value: what was asked for wins, then the scene decides, then
the display and the size of the picture. An automatic exposure, photons, chains of seen light and light vertices need a
pilot of the scene: they are "auto" in the plan until its results are added
(:meth:`~lippmann.rendering.request.render_plan.RenderPlan.with_pilot`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.options.choices import (
    LIGHT,
    POOLED_LIGHT,
    REUSING,
    Caustics,
    Denoiser,
    Integrator,
    Method,
    PixelFilter,
    ToneMap,
)
from lippmann.options.forms import Form
from lippmann.options.light import LightOptions
from lippmann.rendering.request.off_surface_request import check_off_surfaces
from lippmann.rendering.request.preconditions import check
from lippmann.rendering.request.render_plan import Choice, RenderPlan
from lippmann.rendering.request.render_request import DEFAULT_DEPTH, DEFAULT_SPP, RenderRequest
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import SceneDescription


@dataclass(frozen=True)
class SampleBudget:
    """Tuned numbers of samples where none is asked for.

    Attributes
    ----------
    values:
        Samples that a pooled picture is made of: half a second of two cores (``defaults.py``).
    fewest, most:
        Samples per pixel (or sub-pixel) of a pooled picture. With fewer than 4 the worst micro-images suffer; more than
        16 are for who asks for them (``docs/research/equal-time.md``).
    fewest_of_many, many:
        Samples per sub-pixel of pictures of more than ``many`` values.
    reserve:
        Pairs of values that a picture has at most, and how many times its samples it may have if it is not clean with
        them. Beyond the last a pass takes minutes: who asks for so large a picture may say how clean it shall be.
    """

    values: int = 1 << 20
    fewest: int = 4
    most: int = 16
    fewest_of_many: int = 2
    many: int = 1 << 24
    reserve: tuple[tuple[int, int], ...] = ((1 << 20, 8), (1 << 24, 4), (1 << 25, 2))


BUDGET = SampleBudget()


@dataclass(frozen=True)
class FinalPicture:
    """What a picture of the effort ``final`` is to have.

    Attributes
    ----------
    quality:
        PSNR in dB, by its own estimate: noise of 2.5 codes of 8 bits, which a print hides (``goals.py``).
    most:
        Samples per pixel with which it is given up.
    samples:
        Samples per pixel where no goal can be followed: in tiles, forecasts, plain pictures and reused points.
    """

    quality: float = 40.0
    most: int = 256
    samples: int = 64


FINAL = FinalPicture()


def make_plan(
    scene: Scene, display: Display | None, request: RenderRequest, form: Form, size: tuple[int, int] | None
) -> RenderPlan:
    """Decide all that ``request`` leaves open; see :func:`~lippmann.rendering.request.plan.resolve`.

    Raises
    ------
    UsageError, PictureError
        What is asked for cannot be done.
    """
    if scene.lies_off_surfaces:
        check_off_surfaces(request, scene)
    integrator = _integrator(request, scene)
    facts = _Facts(request, scene, integrator.value, form)
    method = _method(facts)
    denoise = _denoise(facts, method)
    subpixels = _subpixels(facts, method.value, None if form == "quilt" else display)
    if size is None and display is not None:
        size = display.panel.width, display.panel.height
    values = None if size is None else size[0] * size[1] * (3 if subpixels.value else 1)
    samples = _samples(facts, method.value, subpixels.value, values)
    return RenderPlan(
        integrator=integrator,
        depth=_depth(request, scene, integrator.value),
        method=method,
        denoise=denoise,
        samples=samples,
        quality=_quality(facts, method.value),
        reserve=_reserve(facts, method.value, samples.value, values),
        subpixels=subpixels,
        pixel_filter=_pixel_filter(facts, samples.value),
        exposure=_exposure(facts),
        tone_map=_tone_map(facts),
        caustics=_caustics(facts),
    )


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
        With its plan. ``spp`` stays None where a quality or a time says when to stop; ``exposure`` and ``caustics``
        stay "auto" where a pilot decides.

    Raises
    ------
    UsageError, PictureError
        What is asked for cannot be done in this form, or for this scene or display.
    """
    planned = follow(make_plan(scene, display, request, form, size), request)
    check(planned, form, display)
    return planned


def follow(plan: RenderPlan, request: RenderRequest) -> RenderRequest:
    """``request`` with every value of the plan, which it carries."""
    return replace(
        request,
        integrator=plan.integrator.value,
        depth=plan.depth.value,
        method=plan.method.value,
        denoise=plan.denoise.value,
        spp=plan.samples.value,
        quality=plan.quality.value,
        subpixels=plan.subpixels.value,
        pixel_filter=plan.pixel_filter.value,
        exposure=plan.exposure.value,
        tone_map=plan.tone_map.value,
        caustics=plan.caustics.value,
        effort="normal",
        plan=plan,
    )


# ---- Rules ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Facts:
    """What rules ask of the request and the scene.

    ``is_exact``: light has no noise, and is shown by one ray through each pixel's middle, unless samples are asked for.
    """

    request: RenderRequest
    scene: Scene
    integrator: Integrator
    form: Form

    @property
    def is_draft(self) -> bool:
        return self.request.effort == "draft"

    @property
    def is_pooled_light(self) -> bool:
        return self.integrator in POOLED_LIGHT

    def is_final(self, method: Method) -> bool:
        """Whether a quality is worked for because the picture is to be final."""
        has_goal = self.form in ("picture", "quilt") and method not in REUSING and self.is_pooled_light
        return self.request.effort == "final" and has_goal and not self.is_one_ray

    @property
    def is_denoised_draft(self) -> bool:
        """Whether the fast network takes the noise out of a single sample."""
        is_open = self.form != "preview" and self.request.denoise == "auto"
        return self.is_draft and is_open and self.is_pooled_light and not self.is_photograph

    @property
    def shows_own_colors(self) -> bool:
        """Whether surfaces that nothing lights show colours which are made for displays."""
        return self.scene.is_unlit and self.is_pooled_light and not self.scene.lies_off_surfaces

    @property
    def is_photograph(self) -> bool:
        """Whether a photograph is shown as it is: its light has no noise."""
        request = self.request
        is_plain = request.method in ("auto", "full") and request.denoise in ("auto", "none")
        return self.shows_own_colors and self.scene.fills_panel and is_plain

    @property
    def off_surfaces_alone(self) -> bool:
        """Whether splats or a volume are all there is: their light has no noise."""
        description = self.scene.description
        is_alone = isinstance(description, SceneDescription) and not description.placements
        return self.scene.lies_off_surfaces and is_alone

    @property
    def is_one_ray(self) -> bool:
        """Whether one ray through each pixel's middle shows the scene."""
        request = self.request
        is_exact = self.is_photograph or self.off_surfaces_alone
        return is_exact and (request.spp in (None, 1) or self.is_draft) and not request.is_open_ended


def _integrator(request: RenderRequest, scene: Scene) -> Choice[Integrator]:
    if request.integrator == "auto":
        if scene.is_classic:
            return Choice("classic", "the scene was made for the classic light models")
        return Choice("path", "all light")
    if request.integrator == "classic" and scene.classic is None:
        raise UsageError(
            f"'{scene.name}' has no form for the classic light models",
            parameter="integrator",
            rule="classic is for Tachyon (.dat) and NFF files and the bundled scenes",
            fix='use integrator="path"',
        )
    return Choice(request.integrator)


def _depth(request: RenderRequest, scene: Scene, integrator: Integrator) -> Choice[int]:
    if integrator == "classic" and scene.light != LightOptions():
        raise UsageError(
            "the light is to be another than the file's",
            parameter="integrator",
            rule="classic light models know no other direction and strength",
            fix='use integrator="path"',
        )
    if request.depth is not None:
        return Choice(request.depth)
    if integrator == "classic" and scene.classic is not None:
        return Choice(scene.classic.camera.ray_depth, "as the scene's file says")
    return Choice(DEFAULT_DEPTH.get(integrator, 1), f"that of {integrator}")


def _method(facts: _Facts) -> Choice[Method]:
    request, scene = facts.request, facts.scene
    if scene.lies_off_surfaces and request.method == "auto":
        if facts.off_surfaces_alone:
            return Choice("full", f"{'splats' if scene.has_splats else 'volumes'} have no noise")
        return Choice("full", f"{'splats' if scene.has_splats else 'a volume'}, whose light lies on no surface")
    if request.method != "auto":
        return Choice(request.method)
    if facts.is_photograph:
        return Choice("full", "a photograph has no noise")
    if facts.is_denoised_draft:
        return Choice("full", "a draft, denoised")  # sharing takes a while for 0.4 dB
    if request.denoise != "auto":
        kind = "without denoising" if request.denoise == "none" else f"with denoise {request.denoise}"
        return Choice("full", f"{kind}, as asked for")
    if facts.integrator not in LIGHT:
        return Choice("full", f"{facts.integrator} has no noise")
    if not facts.is_pooled_light:
        return Choice("full", f"the light of {facts.integrator} is not pooled")
    if facts.form == "preview":
        return Choice("full", "a plain picture has no micro-images to share light")
    return Choice("pooled", "light shared between micro-images")


def _denoise(facts: _Facts, method: Choice[Method]) -> Choice[Denoiser]:
    request = facts.request
    if facts.scene.lies_off_surfaces:
        return Choice("none", "light that lies on no surface is not denoised")
    if request.denoise != "auto":
        return Choice(request.denoise)
    if facts.is_denoised_draft and request.method in ("auto", "pooled"):
        return Choice("oidn-fast", "a draft")
    if method.value == "pooled":
        return Choice("oidn", "pooled light is denoised, with the effort that its rays are worth")
    return Choice("none", "full rendering for references" if request.method == "full" else method.reason)


def _subpixels(facts: _Facts, method: Method, display: Display | None) -> Choice[bool]:
    if facts.request.subpixels is not None:
        return Choice(facts.request.subpixels)
    if display is None or not display.has_slanted_stripes:
        return Choice(False, "sub-pixels of a pixel see the same direction")
    if facts.integrator not in LIGHT or method in REUSING:
        return Choice(False, "whole pixels are traced")
    return Choice(True, "behind a slanted sheet each sub-pixel has a direction of its own")


def _samples(facts: _Facts, method: Method, subpixels: bool, values: int | None) -> Choice[int | None]:
    request, classic = facts.request, facts.scene.classic
    if facts.is_draft:
        return Choice(1, "a draft")
    if request.spp is not None:
        return Choice(request.spp)
    if request.is_open_ended:
        return Choice(None, "as many as the goal takes")
    if facts.is_one_ray:
        return Choice(1, "one ray through each pixel's middle shows it")
    if facts.is_final(method):
        return Choice(FINAL.most, "a final picture, at most")
    if request.effort == "final":
        return Choice(FINAL.samples, "a final picture, where no quality can be worked for")
    if facts.integrator == "classic" and classic is not None:
        more = classic.camera.antialiasing if facts.form == "preview" else 0
        return Choice(1 + more, "as the scene's file says")
    if method != "pooled" or values is None:
        return Choice(DEFAULT_SPP, "the usual number where light is not pooled")
    fewest = BUDGET.fewest_of_many if subpixels and values > BUDGET.many else BUDGET.fewest
    allowed = BUDGET.values / values
    samples = min(max(1 << max(round(math.log2(allowed)), 0), fewest), BUDGET.most)
    return Choice(samples, f"about a million for the picture, but {fewest} to {BUDGET.most} of each pixel")


def _quality(facts: _Facts, method: Method) -> Choice[float | None]:
    if facts.is_final(method):
        return Choice(FINAL.quality, "a final picture")
    if facts.request.quality is not None:
        return Choice(facts.request.quality)
    return Choice(None, "none was asked for")


def _reserve(facts: _Facts, method: Method, samples: int | None, values: int | None) -> Choice[int | None]:
    if facts.request.spp is not None or facts.request.effort != "normal" or samples is None:
        return Choice(None, "the number of samples, or the goal, was asked for")
    if facts.form not in ("picture", "forecast") or method != "pooled" or values is None:
        return Choice(None, "a pooled picture in one piece has one")
    factor = next((factor for most, factor in BUDGET.reserve if values <= most), None)
    if factor is None:
        return Choice(None, "the picture is too large")
    return Choice(factor * samples, "up to so many if it is not clean by its own estimate")


def _pixel_filter(facts: _Facts, samples: int | None) -> Choice[PixelFilter]:
    if facts.request.pixel_filter != "auto":
        return Choice(facts.request.pixel_filter)
    if facts.is_one_ray or (facts.integrator == "classic" and samples == 1):
        return Choice("point", "one ray through each pixel's middle")
    return Choice("box", "samples are spread over the pixel")


def _exposure(facts: _Facts) -> Choice[float | Literal["auto"]]:
    exposure = facts.request.exposure
    if exposure == "auto":
        if facts.shows_own_colors:
            return Choice(0.0, "colours made for displays")
        if facts.is_pooled_light and facts.scene.has_physical_lights:
            return Choice("auto", "physical light sources: a pilot measures it")
        return Choice(0.0, "no physical light sources")
    if exposure and not facts.is_pooled_light:
        raise _no_light(facts.integrator, "exposure")
    return Choice(exposure)


def _tone_map(facts: _Facts) -> Choice[ToneMap]:
    tone_map, scene = facts.request.tone_map, facts.scene
    if tone_map == "auto":
        if scene.lies_off_surfaces or facts.shows_own_colors:
            return Choice("none", "colours made for displays")
        if not facts.is_pooled_light:
            return Choice("none", f"the values of {facts.integrator} are no amounts of light")
        if scene.has_chosen_background:
            return Choice("none", "the background's colour, which was asked for, is to stay")
        return Choice("pbr-neutral", "physically based light: highlights are compressed instead of clipped")
    if tone_map != "none" and not facts.is_pooled_light:
        raise _no_light(facts.integrator, "tone_map")
    return Choice(tone_map)


def _caustics(facts: _Facts) -> Choice[Caustics]:
    caustics = facts.request.caustics
    if caustics != "auto":
        return Choice(caustics)
    if facts.scene.lies_off_surfaces:
        return Choice("paths", "photons land on surfaces")
    return Choice("auto", "a pilot finds whether photons are worth their cost")


def _no_light(integrator: Integrator, parameter: str) -> UsageError:
    return UsageError(
        f"the values of {integrator} are no amounts of light",
        parameter=parameter,
        rule=f"it is for {' and '.join(POOLED_LIGHT)}",
        fix="leave it out",
    )
