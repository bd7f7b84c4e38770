"""A volume shown by a transfer function, in front of surfaces: emission and absorption, without scattering.

The volume is composited by :mod:`lippmann.device.volumes`; behind it lies the radiance of surfaces and background, by
any other integrator. Volumes give no light to surfaces, take none from them, and are seen in no mirror.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.kernel_ops import upload
from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, Ray3f, Spectrum
from lippmann.device.volumes.ray_march import composite
from lippmann.device.volumes.table import Numbers, VolumeTable
from lippmann.rendering.transport.behind import Behind
from lippmann.rendering.transport.integrator import Integrator, RayCounts

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene

#: Where the light that shades a volume's surfaces comes from: right, up and toward the viewer.
LIGHT = (-0.45, 0.6, 1.0)


class GridVolumeIntegrator:
    """Light of a volume, and of what ``behind`` brings from behind it, in linear RGB.

    Parameters
    ----------
    behind:
        Radiance of surfaces and background.
    built:
        The scene on the device.
    table:
        Its volume.
    frame_from_world:
        ``(4, 4)``: the display's or camera's frame, in which the light stands.
    threads:
        CPU threads.
    """

    def __init__(
        self, behind: Integrator, built: BuiltScene, table: VolumeTable, frame_from_world: Numbers, threads: int
    ) -> None:
        self.depth = behind.depth
        self._behind = Behind(behind, built)
        self._table = table
        self._toward_light = toward_light(frame_from_world)
        self._threads = threads

    @property
    def name(self) -> str:
        """Name of the integrator in a request."""
        return self._behind.integrator.name

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Spectrum, RayCounts]:
        """Radiance along ``ray``, and the rays traced for what lies behind the volume.

        The volume is composited at once, on the CPU; lanes that are not active are composited, too.
        """
        rays = self._behind.trace(ray, stream, active)
        colors, transmittances = composite(
            self._table, rays.origins, rays.directions, rays.ends, self._toward_light, self._threads
        )
        color, transmittance = mi.Color3f(np.ascontiguousarray(colors.T)), upload(transmittances)
        # Where there is no volume the radiance stays what it was, to the last bit.
        shown = color + transmittance * rays.radiance
        return mi.Spectrum(dr.select(transmittance < 1, shown, rays.radiance)), rays.counts


def toward_light(frame_from_world: Numbers) -> Numbers:
    """Unit direction ``(3,)`` toward the light source in the world."""
    axes = np.linalg.inv(np.asarray(frame_from_world, np.float64)[:3, :3])
    axes /= np.linalg.norm(axes, axis=0)
    direction = axes @ np.array(LIGHT)
    unit: Numbers = direction / np.linalg.norm(direction)
    return unit
