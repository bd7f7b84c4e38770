"""Integrators by name: Lippmann's own, and those of other packages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from lippmann.runtime.plugins import Door, Extension, Target


@dataclass(frozen=True)
class IntegratorFactory(Extension):
    """An integrator: the name of its entry point is asked for by the option ``integrator``.

    Its light is sampled like that of ``path`` and may be denoised. It is not pooled, and its tone is not mapped.

    Parameters
    ----------
    make:
        ``make(built, request, frame_from_world)``, or ``"module:function"``, is called once Mitsuba's variant is set.
        ``built.mitsuba`` is the ``mi.Scene``; ``request.surfaces`` the depth asked for; ``frame_from_world`` the 4x4
        matrix into the display's frame, in millimetres. It returns an object whose ``sample(ray, stream, active)``
        gives the radiance along rays, a ``mi.Spectrum``, and :class:`lippmann.plugins.RayCounts`; dimensions of samples
        from 1 on are ``stream.next_1d(dimension)`` and ``stream.next_2d(dimension)``.
    depth:
        Surfaces of a path where none are asked for.

    Examples
    --------
    >>> from lippmann.plugins import IntegratorFactory
    >>> IntegratorFactory("ambient_occlusion:make").depth
    1
    """

    make: Target
    depth: int = 1

    group: ClassVar[str] = "lippmann.integrators"


_SESSION = "lippmann.rendering.session"

INTEGRATORS = Door(
    IntegratorFactory,
    {
        "classic": IntegratorFactory(f"{_SESSION}:make_whitted", depth=2),
        "path": IntegratorFactory(f"{_SESSION}:make_path", depth=8),
        "direct": IntegratorFactory(f"{_SESSION}:make_path"),
        **dict.fromkeys(("normal", "depth", "position", "albedo"), IntegratorFactory(f"{_SESSION}:make_surface")),
    },
)
