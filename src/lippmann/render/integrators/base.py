"""What every integrator offers: radiance along given rays, and how many rays that took."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from lippmann.render.sampling import SampleStream


@dataclass
class RayCounts:
    """Rays per lane (UInt32) beyond the primary: ``secondary`` follow scattered light, ``shadow`` test visibility."""

    secondary: Any
    shadow: Any


class Integrator(Protocol):
    """Light along rays. An integrator holds its scene; ``sample`` may be called for any wavefront."""

    name: str
    depth: int

    def sample(self, ray: Any, stream: SampleStream, active: Any) -> tuple[Any, RayCounts]:
        """Radiance (``mi.Color3f``) arriving along ``ray`` (world space), with the rays counted per lane."""
        ...
