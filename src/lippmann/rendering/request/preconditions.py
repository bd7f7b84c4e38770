"""Checks of a request: options that exclude each other, and those that a form of picture or a scene has no use for."""

from __future__ import annotations

from lippmann.display import Display
from lippmann.errors import PictureError, UsageError
from lippmann.options.choices import LIGHT, POOLED_LIGHT, PROPERTIES, REUSING
from lippmann.options.forms import LEFT_OUT, REUSES_NOTHING, Form
from lippmann.options.option import changed_options
from lippmann.rendering.request.render_request import RenderRequest, format_value
from lippmann.scene.scene import Scene

#: Pictures number their sub-pixels in 32 bits.
MOST_SUBPIXELS = 1 << 32

#: Why a form of picture does not take all options.
_WHY: dict[Form, str] = {
    "tiles": "with resume=True, to Zarr and beyond the memory pictures are rendered in tiles",
    "quilt": "every pixel of a quilt is traced, for all colours",
    "forecast": "a forecast is of a number of samples, each of a traced ray",
    "preview": "it is for pictures on a display",
}

#: Whether a request is refused; and of the error: what is wrong, in which parameter, by which rule, and its fix.
_Check = tuple[bool, str, str, str, str]

_LEAVE = "leave it out"
_FULL = 'use method="full"'


def check(request: RenderRequest, form: Form, display: Display | None) -> None:
    """Check that the options of a request fit each other, the form of picture and the display.

    Raises
    ------
    UsageError
        Options contradict each other, or have no meaning for this form of picture.
    PictureError
        A quilt is asked for, and the display's lenses are not cylindrical.
    """
    if form == "quilt" and display is not None and display.lens_array.layout != "lenticular":
        what = f"the display {display.name} has {display.lens_array.layout} lenses"
        raise PictureError(what, rule="a quilt's views lie side by side, for cylindrical lenses")
    _refuse(
        [
            *_check_form(request, form),
            *_check_size(request, display, form),
            *_check_denoiser(request),
            *_check_caustics(request),
            *_check_reuse(request),
            *_check_goal(request),
        ]
    )


def check_scene(request: RenderRequest, scene: Scene) -> None:
    """Refuse options without effect in the scene: of light where nothing is lit, of surfaces where there are none.

    Raises
    ------
    UsageError
        The request asks for direct light, caustics, depth or less indirect light where nothing is lit; for a surface
        property beside light, a background or depth; or, of Gaussian splats or a volume, for a surface property, for
        pooling or denoising, or for an exposure.
    """
    is_own, own = scene.keeps_its_colors, "all in this scene has a colour of its own, whatever light is given"
    refusals = _check_surfaces(request, scene) if scene.lies_off_surfaces else []
    goes_on = request.depth is not None and request.plan is None  # frames of a sequence are planned again
    caustics = request.caustics != "auto" and request.plan is None
    name, is_property, rule = request.integrator, request.integrator in PROPERTIES, "it tells of surfaces alone"
    names = {line.partition(" ")[0] for line in scene.settings} & {"environment", "single_scattering", "background"}
    light = " and ".join(f"{each}=..." for each in sorted(names | {*changed_options(scene.light)}))
    _refuse(
        [
            *refusals,
            (is_property and bool(light), f"{name} beside {light}", "integrator", rule, f"leave out {light}"),
            (is_property and goes_on, f"{request.depth}: {name} follows no path", "depth", rule, _LEAVE),
            (is_own and request.integrator == "direct", "no light falls on it", "integrator", own, _LEAVE),
            (is_own and caustics, "no light makes any on it", "caustics", own, _LEAVE),
            (is_own and goes_on, f"{request.depth}: no path goes on from it", "depth", own, _LEAVE),
            (is_own and request.clamp_indirect is not None, "it has no indirect light", "clamp_indirect", own, _LEAVE),
        ],
        where=scene.name,
    )


def _check_surfaces(request: RenderRequest, scene: Scene) -> list[_Check]:
    what = "Gaussian splats" if scene.has_splats else "a volume"
    rule = f"this scene has {what}, and light that lies on none"
    exposed = scene.is_off_surfaces_alone and request.exposure not in ("auto", 0.0)
    no_light = f"must be 0: the colours of {what} are made for displays, and are no amounts of light"
    shares = f"{request.method} shares the light of surfaces"
    is_property, denoises = request.integrator not in ("auto", *POOLED_LIGHT), request.denoise not in ("auto", "none")
    return [
        (request.method not in ("auto", "full"), shares, "method", rule, _FULL),
        (is_property, f"{request.integrator} is told of surfaces", "integrator", rule, _LEAVE),
        (request.layers, "are told of surfaces", "layers", rule, _LEAVE),
        (denoises, f"{request.denoise} goes by the edges of surfaces", "denoise", rule, _LEAVE),
        (request.caustics == "photons", "photons land on surfaces", "caustics", rule, _LEAVE),
        (exposed, format_value(request.exposure), "exposure", no_light, _LEAVE),
    ]


def explain_missing_estimate(request: RenderRequest) -> str | None:
    """Why a picture has no estimate of its error, as a sentence for its notes; None where it has one."""
    if request.pixel_filter == "point" and request.integrator not in POOLED_LIGHT:
        return "no estimate of the error: one ray through each pixel's middle leaves nothing to chance"
    if request.spp == 1:
        return "no estimate of the error: it needs two samples per pixel or more (spp=2)"
    return request.judged_by or None


def _refuse(refusals: list[_Check], where: str = "") -> None:
    for is_refused, what, parameter, rule, fix in refusals:
        if is_refused:
            raise UsageError(what, where=where, parameter=parameter, rule=rule, fix=fix)


def _check_denoiser(request: RenderRequest) -> list[_Check]:
    name, is_pooled = request.integrator, request.method == "pooled"
    pooled, light = f'method="pooled" works with {" and ".join(POOLED_LIGHT)}', f"it is for {', '.join(LIGHT)}"
    shared, no_network = "pooled shares denoised light", f"{_FULL}, or leave denoise out"
    return [
        (is_pooled and name not in POOLED_LIGHT, f"the light of {name} cannot be pooled", "integrator", pooled, _FULL),
        (request.denoises and name in PROPERTIES, f"{name} has no noise", "denoise", light, _LEAVE),
        (is_pooled and request.denoise == "none", "pooled needs the denoiser", "denoise", shared, no_network),
    ]


def _check_caustics(request: RenderRequest) -> list[_Check]:
    name, clamps = request.integrator, request.clamp_indirect is not None
    no_indirect, no_caustics = f"{name} has no indirect light that is sampled", f"{name} has no caustics"
    of_path, of_some = 'it is for integrator="path"', "'photons' and 'none' are for integrator=\"path\""
    is_asked = request.caustics not in ("auto", "paths")
    return [
        (name != "path" and clamps, no_indirect, "clamp_indirect", of_path, _LEAVE),
        (name != "path" and is_asked, no_caustics, "caustics", of_some, _LEAVE),
    ]


def _check_reuse(request: RenderRequest) -> list[_Check]:
    method, name = request.method, request.integrator
    if method not in REUSING:
        what, rule = f"{method} reuses no points", f"it is for {' and '.join(REUSING)}"
        return [(getattr(request, each) is not None, what, each, rule, _LEAVE) for each in ("order", "respect_gloss")]
    is_both, one = request.order == "paper" and bool(request.respect_gloss), "leave one of the two out"
    as_it_is, by_default = "the paper's order takes every colour as it is", 'it is for order="default"'
    whole, own_rays = f"{method} reuses whole pixels", "a sub-pixel has rays of its own"
    gathers, works_with = f"{method} reuses light, and {name} gathers none", f"it works with {', '.join(LIGHT)}"
    return [
        (is_both, as_it_is, "respect_gloss", by_default, one),
        (bool(request.subpixels), whole, "subpixels", own_rays, _FULL),
        (name not in LIGHT, gathers, "integrator", works_with, _FULL),
    ]


def _check_goal(request: RenderRequest) -> list[_Check]:
    """Refusals of goals: a quality or a time needs a picture whose error is estimated."""
    goals = [name for name in ("max_time", "quality", "quality_worst") if getattr(request, name) is not None]
    if not goals:
        return []
    unknown, why = f"{request.method} does not know its own error", explain_missing_estimate(request)
    return [
        (request.spp == 1, "1", "spp", "must be 2 or more, which tell their error", ""),
        (request.method in REUSING, unknown, goals[0], "full and pooled do", _FULL),
        (why is not None, str(why), goals[0], "", _LEAVE),
    ]


def _check_form(request: RenderRequest, form: Form) -> list[_Check]:
    plain = type(request)()
    needs = "needs the whole picture" if form == "tiles" else f"is not possible in a {form}"
    given = [name for name in LEFT_OUT[form] if getattr(request, name) not in (getattr(plain, name), False, "full")]
    values = {name: "it" if getattr(request, name) is True else getattr(request, name) for name in given}
    reuses = request.method in REUSING and form in REUSES_NOTHING
    instead = 'use method="full" or method="pooled"' if form == "tiles" else _LEAVE
    one, moves = "this is one picture", "only noise of several frames can stand still"
    return [
        (request.fixed_noise, one, "fixed_noise", moves, _LEAVE),
        *((True, f"{value} {needs}", name, _WHY[form], _LEAVE) for name, value in values.items()),
        (reuses, f"{request.method} {needs}", "method", _WHY.get(form, ""), instead),
    ]


def _check_size(request: RenderRequest, display: Display | None, form: Form) -> list[_Check]:
    if form != "tiles" or display is None:
        return []
    panel = display.panel
    is_large = panel.width * panel.height * request.channels >= MOST_SUBPIXELS
    what = f"the display {display.name} has {panel.width} x {panel.height} pixels"
    rule = f"pictures of fewer than {MOST_SUBPIXELS} (sub-)pixels are rendered"
    return [(is_large, what, "display", rule, "render it in parts")]
