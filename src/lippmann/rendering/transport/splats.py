"""Gaussian splats in front of surfaces: what stands between a ray's beginning and the first surface that stops it.

Splats are composited by :mod:`lippmann.device.splats`; behind them lies the radiance of surfaces and background, by any
other integrator. Splats give no light to surfaces, take none from them, and are seen in no mirror.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.color.transfer import SRGB_EXPONENT, SRGB_OFFSET, SRGB_SLOPE, SRGB_THRESHOLD
from lippmann.device.kernel_ops import upload
from lippmann.device.sobol import SampleStream
from lippmann.device.splats.compositing import composite
from lippmann.device.splats.table import SplatTable
from lippmann.device.types import Bool, Color3f, Ray3f, Spectrum
from lippmann.rendering.transport.behind import Behind
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
        self.depth = behind.depth
        self._behind = Behind(behind, built)
        self._splats = splats
        self._threads = threads

    @property
    def name(self) -> str:
        """Name of the integrator in a request."""
        return self._behind.integrator.name

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts]:
        """Radiance along ``ray``, and the rays traced for what lies behind the splats.

        Splats are composited at once, on the CPU; lanes that are not active are composited, too.
        """
        rays = self._behind.trace(ray, stream, active)
        radiance, counts = rays.radiance, rays.counts
        colors, transmittances = composite(self._splats, rays.origins, rays.directions, rays.ends, self._threads)
        color, transmittance = mi.Color3f(np.ascontiguousarray(colors.T)), upload(transmittances)
        if self._splats.linear:
            return mi.Spectrum(color + transmittance * radiance), counts
        shown = srgb_to_linear(color + transmittance * linear_to_srgb(radiance))
        # Where there are no splats the radiance stays what it was, to the last bit.
        return mi.Spectrum(dr.select(transmittance < 1, shown, radiance)), counts


def linear_to_srgb(linear: Color3f) -> Color3f:
    """sRGB codes of linear values, 0 or more: the curve goes on above 1."""
    curve = (1 + SRGB_OFFSET) * dr.power(dr.maximum(linear, SRGB_THRESHOLD), 1 / SRGB_EXPONENT) - SRGB_OFFSET
    return dr.select(linear <= SRGB_THRESHOLD, SRGB_SLOPE * dr.maximum(linear, 0), curve)


def srgb_to_linear(code: Color3f) -> Color3f:
    """The inverse of :func:`linear_to_srgb`."""
    threshold = SRGB_SLOPE * SRGB_THRESHOLD
    curve = dr.power((dr.maximum(code, threshold) + SRGB_OFFSET) / (1 + SRGB_OFFSET), SRGB_EXPONENT)
    return dr.select(code <= threshold, dr.maximum(code, 0) / SRGB_SLOPE, curve)
