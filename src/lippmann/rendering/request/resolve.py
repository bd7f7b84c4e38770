"""``--method auto``: which method makes a picture where the user leaves that open.

A number of samples is an order: so many are traced for every pixel, and nothing is taken away from what they show. A
quality or a time is a goal: full rendering and pooled light, made of the same samples, compete for it, see
:mod:`lippmann.rendering.adaptive.method_race`; for a quality they do so where pooled light is asked for, too. Methods
that reuse points have errors that no estimate knows of, and are taken only by name.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from lippmann.rendering.request.settings import LIGHT, POOLED_LIGHT, Denoiser, RenderSettings


@dataclass(frozen=True)
class Choice:
    """Settings with a method, and why it is this one; ``why`` is empty where the user named it.

    Where ``settings.denoise`` still is ``auto``, plain pictures and pooled light compete for the goal.
    """

    settings: RenderSettings
    why: str = ""


def decide(settings: RenderSettings) -> Choice:
    """Fill in the method and what takes the noise out, as far as that can be known before the first sample."""
    if settings.method == "pooled" and settings.denoise == "auto":
        return Choice(_pooled(settings))
    if settings.method != "auto":
        return Choice(_with(settings, "none") if settings.denoise == "auto" else settings)
    chosen = replace(settings, method="full")
    if settings.denoise != "auto":
        said = "without denoising" if settings.denoise == "none" else f"with --denoise {settings.denoise}"
        return Choice(chosen, f"full {said}, as asked for")
    if settings.integrator not in LIGHT:
        return Choice(_with(chosen, "none"), f"full: {settings.integrator} has no noise")
    if settings.quality is settings.quality_mean is settings.max_time is None:
        return Choice(_with(chosen, "none"), "full: no quality is asked for, so samples stay as they are")
    if settings.integrator not in POOLED_LIGHT:
        return Choice(_with(chosen, "none"), f"full: the light of {settings.integrator} is not pooled")
    return Choice(chosen, "full")


def _pooled(settings: RenderSettings) -> RenderSettings:
    has_quality = settings.quality is not None or settings.quality_mean is not None
    # Where the samples themselves come to the quality first, no light needs to be pooled.
    return settings if has_quality else _with(settings, "oidn")


def _with(settings: RenderSettings, denoise: Denoiser) -> RenderSettings:
    return replace(settings, denoise=denoise)
