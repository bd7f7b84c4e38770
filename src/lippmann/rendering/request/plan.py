"""The plan of a render: every option that is "auto", decided in one place, each value with its reason in words.

:func:`make_plan` reads as a table of rules, one function for each value. A value that was asked for wins; then the
scene decides, then the display and the size of the picture. An automatic exposure, photons, specular chains and light
vertices need a pilot of the scene: they are "auto" in the plan until its results are added
(:meth:`~lippmann.rendering.request.render_request.RenderPlan.with_pilot`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.options.choices import (
    ASKED,
    POOLED_LIGHT,
    PROPERTIES,
    REUSING,
    Caustics,
    Denoiser,
    Integrator,
    Method,
    PixelFilter,
    ToneMap,
)
from lippmann.options.forms import Form
from lippmann.options.option import changed_options
from lippmann.rendering.request.preconditions import check, check_scene
from lippmann.rendering.request.render_request import Choice, RenderPlan, RenderRequest, default_depth
from lippmann.rendering.request.tuning import TUNING
from lippmann.runtime import machine
from lippmann.scene.scene import Scene

T = TypeVar("T")


def make_plan(
    scene: Scene, display: Display | None, request: RenderRequest, form: Form, size: tuple[int, int] | None
) -> RenderPlan:
    """Decide all values that ``request`` leaves open; see :func:`~lippmann.rendering.request.plan.resolve`.

    Raises
    ------
    UsageError, PictureError
        An option of the request does not fit the scene.
    """
    check_scene(request, scene)
    integrator = _choose_integrator(request, scene)
    lens_display = None if form == "quilt" else display
    is_area_sampled = lens_display is not None and lens_display.lens is not None and request.pixel_filter != "point"
    facts = _Facts(request, scene, integrator.value, form, is_area_sampled)
    method = _choose_method(facts)
    denoise = _choose_denoiser(facts, method)
    subpixels = _choose_subpixels(facts, method.value, lens_display)
    if size is None and display is not None:
        size = display.panel.width, display.panel.height
    values = None if size is None else size[0] * size[1] * (3 if subpixels.value else 1)
    samples = _choose_samples(facts, method.value, subpixels.value, values)
    return RenderPlan(
        integrator=integrator,
        depth=_choose_depth(request, scene, integrator.value),
        method=method,
        denoise=denoise,
        samples=samples,
        quality=_choose_quality(facts, method.value),
        reserve=_choose_reserve(facts, method.value, samples.value, values),
        subpixels=subpixels,
        pixel_filter=_choose_pixel_filter(facts, samples.value),
        exposure=_choose_exposure(facts),
        tone_map=_choose_tone_map(facts),
        caustics=_choose_caustics(facts),
    )


def resolve(
    request: RenderRequest,
    scene: Scene,
    display: Display | None = None,
    form: Form = "picture",
    *,
    size: tuple[int, int] | None = None,
) -> RenderRequest:
    """Decide the values that ``request`` leaves open, and check that it can be rendered.

    Parameters
    ----------
    request:
        The request, with values that are "auto" or None.
    scene:
        The scene.
    display:
        The display; None for the plain picture of a camera.
    form:
        The form of the result: a picture in one piece, one in tiles, a quilt, a forecast, or a camera's plain picture.
    size:
        Width and height of the picture in pixels, where it is not the display's.

    Returns
    -------
    RenderRequest
        The decided request, with its plan. ``spp`` stays None where rendering stops by a quality or a time;
        ``exposure`` and ``caustics`` stay "auto" where a pilot decides.

    Raises
    ------
    UsageError, PictureError
        The request does not fit this form of result, or this scene or display.
    """
    planned = apply_plan(make_plan(scene, display, request, form, size), request)
    check(planned, form, display)
    return planned


def apply_plan(plan: RenderPlan, request: RenderRequest) -> RenderRequest:
    """``request`` with all values of ``plan``, and with the plan itself."""
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
    """Facts of the request and the scene that several rules read."""

    request: RenderRequest
    scene: Scene
    integrator: Integrator
    form: Form
    is_area_sampled: bool  # the lens is known, and a pixel's rays are spread over the pixel

    @property
    def is_draft(self) -> bool:
        return self.request.effort == "draft"

    @property
    def is_pooled_light(self) -> bool:
        return self.integrator in POOLED_LIGHT

    def is_final(self, method: Method) -> bool:
        """Whether the effort ``final`` gives the picture a quality goal."""
        has_goal = self.form in ("picture", "quilt") and method not in REUSING and self.is_pooled_light
        return self.request.effort == "final" and has_goal and not self.is_one_ray

    @property
    def is_denoised_draft(self) -> bool:
        """Whether a draft's single sample is denoised by the fast network."""
        is_open = self.request.denoise == "auto" and machine.has_denoiser()
        return self.is_draft and is_open and self.is_pooled_light and not self.is_photograph

    @property
    def is_noisy_view(self) -> bool:
        """Whether a plain picture of sampled light is asked for."""
        return self.form == "preview" and self.is_pooled_light and not self.shows_own_colors

    @property
    def shows_own_colors(self) -> bool:
        """Whether all surfaces are unlit, so that their colours are display colours, not radiance."""
        return self.scene.is_unlit and self.is_pooled_light and not self.scene.lies_off_surfaces

    @property
    def is_photograph(self) -> bool:
        """Whether the scene is a photograph that is shown unchanged: it has no noise."""
        request = self.request
        is_plain = request.method in ("auto", "full") and request.denoise in ("auto", "none")
        return self.shows_own_colors and self.scene.fills_panel and is_plain

    @property
    def is_exact(self) -> bool:
        """Whether nothing in the scene has noise."""
        return self.is_photograph or self.scene.is_off_surfaces_alone

    @property
    def is_one_ray(self) -> bool:
        """Whether a single ray through each pixel's centre is enough: not for a whole lens, nor for a fine volume."""
        request = self.request
        is_usual = request.spp is None and not self.is_area_sampled and (self.is_photograph or self.scene.has_splats)
        return self.is_exact and (is_usual or request.spp == 1 or self.is_draft) and not request.is_open_ended


def _choose_first(*rules: tuple[bool, T, str]) -> Choice[T]:
    """The choice of the first rule that holds, of rules ``(whether it holds, value, reason)``."""
    return next(Choice(value, reason) for holds, value, reason in rules if holds)


def _choose_integrator(request: RenderRequest, scene: Scene) -> Choice[Integrator]:
    if request.integrator == "classic" and scene.classic is None:
        raise UsageError(
            f"'{scene.name}' has no form for the classic light models",
            parameter="integrator",
            rule="classic is for Tachyon (.dat) and NFF files and the bundled scenes",
            fix='use integrator="path"',
        )
    return _choose_first(
        (request.integrator != "auto", request.integrator, ASKED),
        (scene.is_classic, "classic", "the scene was made for the classic light models"),
        (True, "path", "all light"),
    )


def _choose_depth(request: RenderRequest, scene: Scene, integrator: Integrator) -> Choice[int]:
    asked = {line.partition(" ")[0] for line in scene.settings} & {"environment", "single_scattering"}
    if integrator == "classic" and (asked := {*asked, *changed_options(scene.light)}):
        raise UsageError(
            f"{' and '.join(sorted(asked))} beside classic",
            parameter="integrator",
            rule="classic light models know the light and the materials of the file alone",
            fix='use integrator="path"',
        )
    if request.depth is not None:
        return Choice(request.depth)
    if integrator == "classic" and scene.classic is not None:
        return Choice(scene.classic.camera.ray_depth, "as the scene's file says")
    return Choice(default_depth(integrator), f"that of {integrator}")


def _choose_method(facts: _Facts) -> Choice[Method]:
    request, scene, name = facts.request, facts.scene, facts.integrator
    kind, kinds = ("splats", "splats") if scene.has_splats else ("a volume", "volumes")
    denoising = "without denoising" if request.denoise == "none" else f"with denoise {request.denoise}"
    return _choose_first(
        (request.method != "auto", request.method, ASKED),
        (scene.is_off_surfaces_alone, "full", f"{kinds} have no noise"),
        (scene.lies_off_surfaces, "full", f"{kind}, whose light lies on no surface"),
        (facts.is_photograph, "full", "a photograph is shown as it is"),
        (facts.is_denoised_draft, "full", "a draft, denoised"),  # sharing takes a while for 0.4 dB
        (facts.shows_own_colors, "full", "unlit surfaces have no noise inside their edges"),
        (request.denoise != "auto", "full", f"{denoising}, as asked for"),
        (name in PROPERTIES, "full", f"{name} has no noise"),
        (not facts.is_pooled_light, "full", f"the light of {name} is not pooled"),
        (facts.form == "preview", "full", "a plain picture has no micro-images to share light"),
        (not machine.has_denoiser(), "full", machine.NO_DENOISER),
        (True, "pooled", "light shared between micro-images"),
    )


def _choose_denoiser(facts: _Facts, method: Choice[Method]) -> Choice[Denoiser]:
    request = facts.request
    is_draft = facts.is_denoised_draft and request.method in ("auto", "pooled")
    return _choose_first(
        (facts.scene.lies_off_surfaces, "none", "light that lies on no surface is not denoised"),
        (request.denoise != "auto", request.denoise, ASKED),
        (is_draft, "oidn-fast", "a draft"),
        (method.value == "pooled", "oidn", "pooled light is denoised, with the effort that its samples are worth"),
        (request.method == "full", "none", "full rendering for references"),
        (facts.is_noisy_view and machine.has_denoiser(), "oidn", "a plain picture of sampled light"),
        (True, "none", method.reason),
    )


def _choose_subpixels(facts: _Facts, method: Method, display: Display | None) -> Choice[bool]:
    asked = facts.request.subpixels
    is_slanted = display is not None and display.has_slanted_stripes
    is_whole = facts.integrator in PROPERTIES or method in REUSING
    return _choose_first(
        (asked is not None, bool(asked), ASKED),
        (not is_slanted, False, "sub-pixels of a pixel see the same direction"),
        (is_whole, False, "whole pixels are traced"),
        (True, True, "behind a slanted sheet each sub-pixel has a direction of its own"),
    )


def _choose_samples(facts: _Facts, method: Method, subpixels: bool, values: int | None) -> Choice[int | None]:
    request = facts.request
    classic = facts.scene.classic if facts.integrator == "classic" else None
    of_file = 1 + (classic.camera.antialiasing if classic is not None and facts.form == "preview" else 0)
    is_large = (values or 0) > TUNING.values * TUNING.usual
    is_budgeted = method == "pooled" or facts.is_exact or classic is not None
    fewest = TUNING.fewest - subpixels * (1 + is_large) if method == "pooled" or facts.is_area_sampled else 1
    of_budget = 1 << max(round(math.log2(TUNING.values / (values or TUNING.values))), 0)
    budgeted = f"about a million for the picture, but {fewest} to {TUNING.usual} of each pixel"
    usual = _choose_first(
        (request.spp is not None, request.spp, ASKED),
        (request.is_open_ended, None, "as many as the goal takes"),
        (facts.is_one_ray, 1, "one ray through each pixel's middle shows it"),
        (facts.is_final(method), TUNING.final_most, "a final picture, at most"),
        (request.effort == "final", TUNING.final_samples, "a final picture, where no quality can be worked for"),
        (classic is not None and not facts.is_area_sampled, of_file, "as the scene's file says"),
        (values is None or not is_budgeted, TUNING.usual, "the usual number where light is not pooled"),
        (True, min(max(of_budget, fewest), TUNING.usual), budgeted),
    )
    is_same = usual.value == 1 and not facts.is_denoised_draft
    of_draft = "a draft" + is_same * f" takes as many samples as the default: {usual.reason}"
    return _choose_first((facts.is_draft, 1, of_draft), (True, usual.value, usual.reason))


def _choose_quality(facts: _Facts, method: Method) -> Choice[float | None]:
    return _choose_first(
        (facts.is_final(method), TUNING.final_quality, "a final picture"),
        (facts.request.quality is not None, facts.request.quality, ASKED),
        (True, None, "none was asked for"),
    )


def _choose_reserve(facts: _Facts, method: Method, samples: int | None, values: int | None) -> Choice[int | None]:
    is_given = facts.request.spp is not None or facts.request.effort != "normal" or samples is None
    is_judged = method == "pooled" or (facts.shows_own_colors and not facts.is_one_ray)
    is_other = facts.form not in ("picture", "forecast") or not is_judged or values is None
    spent = (values or 1) * (samples or 1)
    factor = min(TUNING.reserve, TUNING.most_in_reserve // spent)
    return _choose_first(
        (is_given, None, "the number of samples, or the goal, was asked for"),
        (is_other, None, "pictures in one piece have one, pooled or unlit"),
        (factor < 2, None, "the picture is too large"),
        (True, factor * (samples or 1), "up to so many if it is not clean by its own estimate"),
    )


def _choose_pixel_filter(facts: _Facts, samples: int | None) -> Choice[PixelFilter]:
    asked = facts.request.pixel_filter
    is_one_ray = facts.is_one_ray or (facts.integrator == "classic" and samples == 1)
    return _choose_first(
        (asked != "auto", asked, ASKED),
        (is_one_ray, "point", "one ray through each pixel's middle"),
        (True, "box", "samples are spread over the pixel"),
    )


def _choose_exposure(facts: _Facts) -> Choice[float | Literal["auto"]]:
    asked = facts.request.exposure
    if asked not in ("auto", 0.0) and not facts.is_pooled_light:
        raise _make_light_error(facts.integrator, "exposure")
    is_physical = facts.is_pooled_light and facts.scene.has_physical_lights
    return _choose_first(
        (asked != "auto", asked, ASKED),
        (facts.shows_own_colors, 0.0, "colours made for displays"),
        (is_physical, "auto", "physical light sources: a pilot measures it"),
        (True, 0.0, "no physical light sources"),
    )


def _choose_tone_map(facts: _Facts) -> Choice[ToneMap]:
    asked, scene, name = facts.request.tone_map, facts.scene, facts.integrator
    if asked not in ("auto", "none") and not facts.is_pooled_light:
        raise _make_light_error(name, "tone_map")
    return _choose_first(
        (asked != "auto", asked, ASKED),
        (scene.lies_off_surfaces or facts.shows_own_colors, "none", "colours made for displays"),
        (not facts.is_pooled_light, "none", f"the values of {name} are no amounts of light"),
        (scene.has_chosen_background, "none", "the background's colour, which was asked for, is to stay"),
        (True, "pbr-neutral", "physically based light: highlights are compressed instead of clipped"),
    )


def _choose_caustics(facts: _Facts) -> Choice[Caustics]:
    asked = facts.request.caustics
    return _choose_first(
        (asked != "auto", asked, ASKED),
        (facts.scene.lies_off_surfaces, "paths", "photons land on surfaces"),
        (True, "auto", "a pilot finds whether photons are worth their cost"),
    )


def _make_light_error(integrator: Integrator, parameter: str) -> UsageError:
    what, rule = f"the values of {integrator} are no amounts of light", f"it is for {' and '.join(POOLED_LIGHT)}"
    return UsageError(what, parameter=parameter, rule=rule, fix="leave it out")
