"""The interface of integrators: radiance along rays, and counts of the rays traced for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:  # plugins take their names from here before the engine starts
    from lippmann.device.sobol import SampleStream
    from lippmann.device.types import Bool, Float, Ray3f, Spectrum, UInt32


@dataclass
class RayCounts:
    """Rays per lane beyond the primary: ``secondary`` follow scattered light, ``shadow`` test visibility.

    Examples
    --------
    >>> import mitsuba as mi
    >>> from lippmann.plugins import RayCounts
    >>> RayCounts(secondary=mi.UInt32(2), shadow=mi.UInt32(1)).shadow
    [1]
    """

    secondary: UInt32
    shadow: UInt32


@dataclass
class FirstHit:
    """First hit of a primary ray.

    ``distance`` is in world units, infinite where nothing is hit. ``view_dependent`` is True where the radiance depends
    on the direction from which the surface is seen (mirrors, glass, highlights).
    """

    distance: Float
    view_dependent: Bool


@dataclass
class PixelSample:
    """One sample of each lane's pixel.

    ``specular`` is the part of ``radiance`` that comes from emitters and sky by specular chains alone. ``excess`` is
    the part of ``specular`` that rests on single bright chains. ``covered`` is 1 where the primary ray hits a surface,
    else 0. Each is None where the integrator does not separate it.
    """

    radiance: Spectrum
    counts: RayCounts
    specular: Spectrum | None = None
    excess: Spectrum | None = None
    covered: Float | None = None


class Integrator(Protocol):
    """Estimates radiance along rays of its own scene, for wavefronts of any size."""

    depth: int

    @property
    def name(self) -> str:
        """Name of the integrator in a request."""
        ...

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts]:
        """One sample of the radiance along ``ray`` (world space) per lane, and the rays traced for it."""
        ...


class ReusableIntegrator(Integrator, Protocol):
    """An integrator that also returns the first hit, so that its radiance can be reprojected."""

    def sample_with_hit(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts, FirstHit]:
        """As :meth:`sample`, with the first hit. Results that are never evaluated cost nothing."""
        ...
