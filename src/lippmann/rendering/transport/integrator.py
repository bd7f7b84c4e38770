"""What every integrator offers: radiance along given rays, and how many rays that took."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from lippmann.device.sobol import SampleStream


@dataclass
class RayCounts:
    """Rays per lane (UInt32) beyond the primary: ``secondary`` follow scattered light, ``shadow`` test visibility."""

    secondary: Any
    shadow: Any


@dataclass
class FirstHit:
    """What a primary ray met: ``distance`` in world units (infinite: nothing), and whether the colour found there
    depends on where it is seen from (``view_dependent``: mirrors, glass, highlights)."""

    distance: Any
    view_dependent: Any


class Integrator(Protocol):
    """Light along rays. An integrator holds its scene; it may be asked for any wavefront."""

    depth: int

    @property
    def name(self) -> str:
        """What the light is called in a request."""
        ...

    def sample(self, ray: Any, stream: SampleStream, active: Any) -> tuple[Any, RayCounts]:
        """Radiance (``mi.Color3f``) arriving along ``ray`` (world space), with the rays counted per lane."""
        ...


class ReusableIntegrator(Integrator, Protocol):
    """An integrator that also says what the primary rays met, so that its light can be used again elsewhere."""

    def sample_with_hit(self, ray: Any, stream: SampleStream, active: Any) -> tuple[Any, RayCounts, FirstHit]:
        """As ``sample``, with the first hit; what is not evaluated costs nothing."""
        ...
