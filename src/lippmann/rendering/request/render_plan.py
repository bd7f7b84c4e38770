"""What a render will do: every decision as a value with its reason in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Generic, Literal, TypeVar, cast

from lippmann.options.choices import (
    ASKED,
    Caustics,
    Denoiser,
    Integrator,
    Method,
    PixelFilter,
    ToneMap,
)

T = TypeVar("T")


@dataclass(frozen=True)
class Choice(Generic[T]):
    """A value, and why it is this one."""

    value: T
    reason: str = ASKED


@dataclass(frozen=True)
class RenderPlan:
    """What a render will do.

    Attributes
    ----------
    integrator, depth, method, denoise, subpixels, pixel_filter, exposure, tone_map, caustics:
        As of a :class:`~lippmann.rendering.request.render_request.RenderRequest`; ``exposure`` and ``caustics`` are
        "auto" where a pilot decides. ``denoise`` is ``oidn`` where the network's effort follows the traced rays.
    samples:
        Samples per pixel, or sub-pixel; where a goal says when to stop the most of them, or None.
    quality:
        PSNR in dB that is to be reached; None for none.
    reserve:
        Samples that a picture may have that is not clean with those; None for no more.
    pilot:
        What a pilot of the scene came to, by name.
    """

    integrator: Choice[Integrator]
    depth: Choice[int]
    method: Choice[Method]
    denoise: Choice[Denoiser]
    samples: Choice[int | None]
    quality: Choice[float | None]
    reserve: Choice[int | None]
    subpixels: Choice[bool]
    pixel_filter: Choice[PixelFilter]
    exposure: Choice[float | Literal["auto"]]
    tone_map: Choice[ToneMap]
    caustics: Choice[Caustics]
    pilot: Mapping[str, Choice[object]] = field(default_factory=dict)

    def with_pilot(self, told: Mapping[str, object]) -> RenderPlan:
        """The plan with what a pilot came to, by the names of :data:`PILOT_REASONS`."""
        open_ended: dict[str, object] = {}
        if self.exposure.value == "auto":
            open_ended["exposure"] = told.get("exposure", 0.0)
        if self.caustics.value == "auto":
            open_ended["caustics"] = told.get("caustics", "none")
        others = {name: told[name] for name in PILOT_REASONS if name in told and name not in ("exposure", "caustics")}
        found = {**open_ended, **others}
        return replace(self, pilot={name: Choice(value, PILOT_REASONS[name]) for name, value in found.items()})

    @property
    def entries(self) -> dict[str, Choice[object]]:
        """All choices by name; where a pilot decided, what it came to."""
        own = {each.name: cast("Choice[object]", getattr(self, each.name)) for each in fields(self)[:-1]}
        return {**own, **self.pilot}

    def in_words(self) -> dict[str, str]:
        """Value and reason by name, for people."""
        return {name: f"{shown_value(each.value)} ({each.reason})" for name, each in self.entries.items()}

    def lines(self) -> list[str]:
        """``name: value (reason)``, as files hold it."""
        return [f"{name}: {words}" for name, words in self.in_words().items()]

    def to_dict(self) -> dict[str, dict[str, object]]:
        """Values and reasons by name, for JSON."""
        return {name: {"value": each.value, "reason": each.reason} for name, each in self.entries.items()}


#: What a pilot may come to, and why.
PILOT_REASONS = {
    "exposure": "the pilot's median of what is lit comes to mid-grey",
    "camera_exposure": "the camera's own, from the scene",
    "caustics": "an emitter shines on mirrors, glass or smooth gloss, and photons of it land in the picture",
    "light_vertices": "the pilot met indirect light brighter than white, as of a small emitter beside a surface",
    "seen_chains": "chains of seen light with each path: a denoised scene with mirrors, glass or smooth gloss",
}


def shown_value(value: object) -> str:
    """A value of a plan, for people."""
    if value is None:
        return "open"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)
