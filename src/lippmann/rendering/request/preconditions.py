"""What can be honoured: options that belong together, and what each form of a picture allows."""

from __future__ import annotations

from lippmann.display import Display
from lippmann.errors import PictureError, UsageError
from lippmann.options.choices import LIGHT, POOLED_LIGHT, REUSING
from lippmann.options.forms import LEFT_OUT, Form
from lippmann.rendering.request.render_request import RenderRequest

#: Pictures number their sub-pixels in 32 bits.
MOST_SUBPIXELS = 1 << 32


def check(request: RenderRequest, form: Form, display: Display | None) -> None:
    """Refuse what cannot be honoured.

    Raises
    ------
    UsageError
        Options contradict each other, or mean nothing in this form.
    PictureError
        The display's lenses have no quilt.
    """
    plain = type(request)()
    for name in LEFT_OUT[form]:
        if getattr(request, name) not in (getattr(plain, name), False, "full"):
            raise _refuse(name, request, form)
    if form in ("quilt", "forecast") and request.method in REUSING:
        raise _refuse("method", request, form)
    if form == "tiles":
        _check_tiles(request, display)
    if form == "quilt":
        _check_quilt(request, display)
    _check_denoiser(request)
    _check_caustics(request)
    _check_reuse(request)
    _check_goal(request)


def why_no_estimate(request: RenderRequest) -> str | None:
    """Why a picture says nothing of its own error, as a sentence; None if it does."""
    if request.pixel_filter == "point" and request.integrator not in POOLED_LIGHT:
        return "no estimate of the error: one ray through each pixel's middle leaves nothing to chance"
    if request.spp == 1:
        return "no estimate of the error: one sample per pixel does not tell it, two or more do"
    return None


def _check_denoiser(request: RenderRequest) -> None:
    if request.method == "pooled" and request.integrator not in POOLED_LIGHT:
        raise UsageError(
            f"the light of {request.integrator} cannot be pooled",
            parameter="integrator",
            rule=f'method="pooled" works with {" and ".join(POOLED_LIGHT)}',
            fix='use method="full"',
        )
    if request.denoises and request.integrator not in LIGHT:
        raise UsageError(
            f"{request.integrator} has no noise",
            parameter="denoise",
            rule=f"it is for {', '.join(LIGHT)}",
            fix="leave it out",
        )
    if request.method == "pooled" and request.denoise == "none":
        raise UsageError(
            "pooled needs the denoiser",
            parameter="denoise",
            rule="pooled shares denoised light",
            fix='use method="full", or leave denoise out',
        )


def _check_caustics(request: RenderRequest) -> None:
    if request.clamp_indirect is not None and request.integrator != "path":
        raise UsageError(
            f"{request.integrator} has no indirect light that is sampled",
            parameter="clamp_indirect",
            rule='it is for integrator="path"',
            fix="leave it out",
        )
    if request.caustics not in ("auto", "paths") and request.integrator != "path":
        raise UsageError(
            f"{request.integrator} has no caustics",
            parameter="caustics",
            rule="'photons' and 'none' are for integrator=\"path\"",
            fix="leave it out",
        )


def _check_reuse(request: RenderRequest) -> None:
    if request.method not in REUSING:
        for name in ("order", "respect_gloss"):
            if getattr(request, name) is not None:
                raise UsageError(
                    f"{request.method} reuses no points",
                    parameter=name,
                    rule=f"it is for {' and '.join(REUSING)}",
                    fix="leave it out",
                )
        return
    if request.order == "paper" and request.respect_gloss:
        raise UsageError(
            "the paper's order takes every colour as it is",
            parameter="respect_gloss",
            rule='it is for order="default"',
            fix="leave one of the two out",
        )
    if request.subpixels:
        raise UsageError(
            f"{request.method} reuses whole pixels",
            parameter="subpixels",
            rule="a sub-pixel has rays of its own",
            fix='use method="full"',
        )
    if request.integrator not in LIGHT:
        raise UsageError(
            f"{request.method} reuses light, and {request.integrator} gathers none",
            parameter="integrator",
            rule=f"it works with {', '.join(LIGHT)}",
            fix='use method="full"',
        )


def _check_goal(request: RenderRequest) -> None:
    """A quality or a time needs samples that tell their error."""
    if not request.is_open_ended:
        return
    name = "max_time" if request.max_time is not None else "quality" if request.quality is not None else "quality_worst"
    if request.spp == 1:
        raise UsageError("1", parameter="spp", rule="must be 2 or more, which tell their error")
    if request.method in REUSING:
        raise UsageError(
            f"{request.method} does not know its own error",
            parameter=name,
            rule="full and pooled do",
            fix='use method="full"',
        )
    why = why_no_estimate(request)
    if why is not None:
        raise UsageError(why, parameter=name, fix="leave it out")


def _check_tiles(request: RenderRequest, display: Display | None) -> None:
    if request.method in REUSING:
        raise _refuse("method", request, "tiles", fix='use method="full" or method="pooled"')
    if display is None:
        return
    panel = display.panel
    if panel.width * panel.height * request.channels >= MOST_SUBPIXELS:
        raise UsageError(
            f"the display {display.name} has {panel.width} x {panel.height} pixels",
            parameter="display",
            rule=f"pictures of fewer than {MOST_SUBPIXELS} (sub-)pixels are rendered",
            fix="render it in parts",
        )


def _check_quilt(request: RenderRequest, display: Display | None) -> None:
    if display is not None and display.lens_array.layout != "lenticular":
        raise PictureError(
            f"the display {display.name} has {display.lens_array.layout} lenses",
            rule="a quilt's views lie side by side, for cylindrical lenses",
        )


#: Why a form has not all options.
_WHY: dict[Form, str] = {
    "tiles": "with resume=True, to Zarr and beyond the memory pictures are rendered in tiles",
    "quilt": "every pixel of a quilt is traced, for all colours",
    "forecast": "a forecast is of a number of samples, each of a traced ray",
    "preview": "it is for pictures on a display",
}


def _refuse(name: str, request: RenderRequest, form: Form, fix: str = "leave it out") -> UsageError:
    value = getattr(request, name)
    needs = "needs the whole picture" if form == "tiles" else f"is not possible in a {form}"
    return UsageError(f"{'it' if value is True else value} {needs}", parameter=name, rule=_WHY[form], fix=fix)
