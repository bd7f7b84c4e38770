"""What a render is asked for, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from lippmann.errors import UsageError

Method = Literal["full"]
IntegratorName = Literal["classic", "path", "direct", "normal", "depth", "position", "albedo"]
PixelFilter = Literal["box", "point"]
Device = Literal["auto", "cpu", "gpu"]

#: Surfaces per path where nothing is said.
DEFAULT_DEPTH = {"classic": 2, "path": 8, "direct": 1}


@dataclass(frozen=True)
class RenderSettings:
    """How a picture is made.

    Parameters
    ----------
    method:
        The renderer: ``full`` traces every ray.
    integrator:
        ``classic`` (Tachyon's and NFF's light models, for scenes made for them), ``path`` (all light), ``direct``
        (light that comes straight from lamps and sky), or a property of the first surface without any light:
        ``normal``, ``depth``, ``position``, ``albedo``.
    depth:
        Surfaces a path may meet, the primary ray's counting 1; None for the integrator's own default.
    spp:
        Samples per pixel (or sub-pixel), at least 1.
    seed:
        Of all random choices, 0 to 2**32 - 1.
    subpixels:
        A ray for each sub-pixel, at its own place.
    pixel_filter:
        ``box`` spreads the samples over the pixel, ``point`` takes its centre.
    device, threads, memory:
        Where it runs; ``memory`` in bytes, None for 60 % of what is free.
    """

    method: Method = "full"
    integrator: IntegratorName = "path"
    depth: int | None = None
    spp: int = 16
    seed: int = 0
    subpixels: bool = False
    pixel_filter: PixelFilter = "box"
    device: Device = "auto"
    threads: int | None = None
    memory: int | None = None

    def __post_init__(self) -> None:
        for field, allowed in (
            ("method", get_args(Method)),
            ("integrator", get_args(IntegratorName)),
            ("pixel_filter", get_args(PixelFilter)),
            ("device", get_args(Device)),
        ):
            value = getattr(self, field)
            if value not in allowed:
                raise UsageError(
                    f"'{value}' is not known",
                    where=f"--{field.replace('_', '-')}",
                    rule=f"known are {', '.join(allowed)}",
                )
        _check_whole("depth", self.depth, 1, 4096)
        _check_whole("spp", self.spp, 1, 2**24)
        _check_whole("seed", self.seed, 0, 2**32 - 1)
        _check_whole("threads", self.threads, 1, 4096)
        _check_whole("memory", self.memory, 1, 2**63)

    @property
    def surfaces(self) -> int:
        """The depth that will be used."""
        return DEFAULT_DEPTH.get(self.integrator, 1) if self.depth is None else self.depth


def _check_whole(name: str, value: int | None, low: int, high: int) -> None:
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise UsageError(f"{value!r} will not do", where=f"--{name}", rule=f"a whole number from {low} to {high}")
