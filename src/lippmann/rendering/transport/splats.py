"""Gaussian splats in front of surfaces: what stands between a ray's beginning and the first surface that stops it.

Splats are composited by :mod:`lippmann.device.splats`; behind them lies the radiance of surfaces and background, by any
other integrator. Splats give no light to surfaces, take none from them, and are seen in no mirror.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import SRGB_EXPONENT, SRGB_OFFSET, SRGB_SLOPE, SRGB_THRESHOLD
from lippmann.device.sobol import SampleStream
from lippmann.device.splats.compositing import composite
from lippmann.device.splats.table import SplatTable
from lippmann.device.types import Bool, Color3f, Point3f, Ray3f, Spectrum
from lippmann.rendering.transport.first_surface import PhysicalSurfaces
from lippmann.rendering.transport.integrator import Integrator, RayCounts

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene


class SplatIntegrator:
    """Light of splats, and of what ``behind`` brings from behind them.

    Splats are composited with what lies behind in their own colours, mostly sRGB codes, as their trainers do.

    Parameters
    ----------
    behind:
        Radiance of surfaces and background.
    built:
        The scene on the device.
    splats:
        Its splats.
    threads:
        CPU threads.
    """

    def __init__(self, behind: Integrator, built: BuiltScene, splats: SplatTable, threads: int) -> None:
        self.behind = behind
        self.depth = behind.depth
        self._splats = splats
        self._threads = threads
        self._surfaces = PhysicalSurfaces(built) if len(built.mitsuba.shapes()) else None

    @property
    def name(self) -> str:
        """Name of the integrator in a request."""
        return self.behind.name

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts]:
        """Radiance along ``ray``, and the rays traced for what lies behind the splats.

        Splats are composited at once, on the CPU; lanes that are not active are composited, too.
        """
        radiance, counts = self.behind.sample(ray, stream, active)
        end = mi.Float(dr.inf)
        if self._surfaces is not None:
            hit = self._surfaces.first_hit(ray)
            end = dr.select(hit.hit, dr.dot(hit.p - ray.o, ray.d), dr.inf)
        # All at once: each evaluated alone would trace the paths anew.
        dr.eval(radiance, counts.secondary, counts.shadow, end, ray)
        lanes = max(dr.width(ray), dr.width(radiance), dr.width(end))
        colors, transmittances = composite(
            self._splats, _rows(ray.o, lanes), _rows(ray.d, lanes), _rows(end, lanes), self._threads
        )
        color, transmittance = mi.Color3f(np.ascontiguousarray(colors.T)), mi.Float(transmittances)
        if self._splats.linear:
            return mi.Spectrum(color + transmittance * radiance), counts
        shown = srgb_to_linear(color + transmittance * linear_to_srgb(radiance))
        # Where there are no splats the radiance stays what it was, to the last bit.
        return mi.Spectrum(dr.select(transmittance < 1, shown, radiance)), counts


def _rows(value: Point3f, lanes: int) -> NDArray[np.float32]:
    """``(lanes,)`` or ``(lanes, 3)`` float32 of an evaluated array; one of a single entry counts for every lane."""
    array = np.asarray(value, dtype=np.float32).T
    return np.ascontiguousarray(np.broadcast_to(array, (lanes, *array.shape[1:])))


def linear_to_srgb(linear: Color3f) -> Color3f:
    """sRGB codes of linear values, 0 or more: the curve goes on above 1."""
    curve = (1 + SRGB_OFFSET) * dr.power(dr.maximum(linear, SRGB_THRESHOLD), 1 / SRGB_EXPONENT) - SRGB_OFFSET
    return dr.select(linear <= SRGB_THRESHOLD, SRGB_SLOPE * dr.maximum(linear, 0), curve)


def srgb_to_linear(code: Color3f) -> Color3f:
    """The inverse of :func:`linear_to_srgb`."""
    threshold = SRGB_SLOPE * SRGB_THRESHOLD
    curve = dr.power((dr.maximum(code, threshold) + SRGB_OFFSET) / (1 + SRGB_OFFSET), SRGB_EXPONENT)
    return dr.select(code <= threshold, dr.maximum(code, 0) / SRGB_SLOPE, curve)
