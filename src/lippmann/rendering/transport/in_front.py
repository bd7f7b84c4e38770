"""Gaussian splats and volumes, composited between the ray's origin and the first surface.

They are composited on the CPU (:mod:`lippmann.device.splats`, :mod:`lippmann.device.volumes`) over the radiance of
surfaces and background, which any other integrator estimates. Splats and volumes do not light surfaces, are not lit by
them, and do not appear in mirrors.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import linear_to_srgb, srgb_to_linear, to_numpy, upload
from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, Color3f, Float, Ray3f, Spectrum
from lippmann.rendering.transport.first_surface import PhysicalSurfaces
from lippmann.rendering.transport.integrator import Integrator, RayCounts

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.splats.table import SplatTable
    from lippmann.device.volumes.table import VolumeTable

Floats = NDArray[np.float32]
Numbers = NDArray[np.float64]

#: Direction toward the light that shades a volume's surfaces: left, up and toward the viewer.
LIGHT = (-0.45, 0.6, 1.0)


class _InFront:
    """Integrator that composites something over the radiance of another one.

    Parameters
    ----------
    behind:
        Integrator of surfaces and background.
    built:
        The scene on the device.
    """

    def __init__(self, behind: Integrator, built: BuiltScene) -> None:
        self.depth, self.name = behind.depth, behind.name
        self.choices: Mapping[str, object] = getattr(behind, "choices", {})
        self._behind = behind
        self._surfaces = PhysicalSurfaces(built) if len(built.mitsuba.shapes()) else None

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts]:
        """Radiance along ``ray``, and the rays traced by the integrator behind.

        Evaluates its result. Inactive lanes are composited, too.
        """
        radiance, counts = self._behind.sample(ray, stream, active)
        end = mi.Float(dr.inf)
        if self._surfaces is not None:
            hit = self._surfaces.first_hit(ray)
            end = dr.select(hit.hit, dr.dot(hit.p - ray.o, ray.d), dr.inf)
        # All at once: each evaluated alone would trace the paths anew.
        dr.eval(radiance, counts.secondary, counts.shadow, end, ray)
        lanes = max(dr.width(ray), dr.width(radiance), dr.width(end))
        colors, transmittances = self._composite(to_numpy(ray.o, lanes), to_numpy(ray.d, lanes), to_numpy(end, lanes))
        color, transmittance = mi.Color3f(np.ascontiguousarray(colors.T)), upload(transmittances)
        composited = self._over(color, transmittance, radiance)
        # Where nothing is in front, the radiance stays exact.
        return mi.Spectrum(dr.select(transmittance < 1, composited, radiance)), counts

    def _composite(self, origins: Floats, directions: Floats, ends: Floats) -> tuple[Floats, Floats]:
        """Colours ``(n, 3)`` and transmittances ``(n,)`` of rays ``(n, 3)`` up to the distances of their surfaces."""
        raise NotImplementedError

    def _over(self, color: Color3f, transmittance: Float, radiance: Spectrum) -> Spectrum:
        return color + transmittance * radiance


class SplatIntegrator(_InFront):
    """Radiance of splats, composited in the colour space of their file, mostly sRGB codes: they were trained in it."""

    def __init__(self, behind: Integrator, built: BuiltScene, splats: SplatTable, threads: int) -> None:
        super().__init__(behind, built)
        self._splats, self._threads = splats, threads

    def _composite(self, origins: Floats, directions: Floats, ends: Floats) -> tuple[Floats, Floats]:
        from lippmann.device.splats.compositing import composite

        return composite(self._splats, origins, directions, ends, self._threads)

    def _over(self, color: Color3f, transmittance: Float, radiance: Spectrum) -> Spectrum:
        if self._splats.linear:
            return super()._over(color, transmittance, radiance)
        return srgb_to_linear(color + transmittance * linear_to_srgb(radiance))


class GridVolumeIntegrator(_InFront):
    """Light of a volume shown by a transfer function: emission and absorption, without scattering, in linear RGB.

    ``frame_from_world`` ``(4, 4)`` is the display's or camera's frame, in which the light stands.
    """

    def __init__(
        self, behind: Integrator, built: BuiltScene, table: VolumeTable, frame_from_world: Numbers, threads: int
    ) -> None:
        super().__init__(behind, built)
        self._table, self._threads = table, threads
        self._toward_light = toward_light(frame_from_world)

    def _composite(self, origins: Floats, directions: Floats, ends: Floats) -> tuple[Floats, Floats]:
        from lippmann.device.volumes.ray_march import composite

        return composite(self._table, origins, directions, ends, self._toward_light, self._threads)


def toward_light(frame_from_world: Numbers) -> Numbers:
    """Unit direction ``(3,)`` toward the light source in the world."""
    axes = np.linalg.inv(np.asarray(frame_from_world, np.float64)[:3, :3])
    axes /= np.linalg.norm(axes, axis=0)
    direction = axes @ np.array(LIGHT)
    unit: Numbers = direction / np.linalg.norm(direction)
    return unit
