"""Shadow rays: transmittance between a surface and an emitter.

Surfaces that let rays straight through (alpha masks, thin glass) attenuate shadow rays instead of blocking them. In
scenes with such surfaces the nearest hits are found and evaluated one after another; in others any hit blocks.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, MitsubaScene, Point3f, Ray3f, Spectrum, UInt32

#: Straight-through surfaces that one ray may cross before it counts as blocked. Bounds the loop between many panes.
MAX_CROSSINGS = 64


class ShadowRays:
    """Shadow rays in one scene.

    Parameters
    ----------
    scene:
        A ``mi.Scene``.
    has_null:
        Whether some of its surfaces let rays straight through.
    """

    def __init__(self, scene: MitsubaScene, has_null: bool) -> None:
        self._scene, self._has_null = scene, has_null

    @syntax
    def transmittance(self, ray: Ray3f, end: Point3f, active: Bool) -> tuple[Spectrum, UInt32]:
        """Transmittance in [0, 1] along ``ray``, which stops short of ``end``, and the rays traced for it.

        A ray that crosses n surfaces counts n + 1 times.
        """
        active = mi.Bool(active)
        tests = dr.select(active, mi.UInt32(1), mi.UInt32(0))
        transmittance = mi.Spectrum(1)
        if dr.hint(not self._has_null, mode="scalar"):
            transmittance = dr.select(self._scene.ray_test(ray, active), mi.Spectrum(0), transmittance)
        else:
            crossings = mi.UInt32(0)
            o, d, distance = mi.Point3f(ray.o), mi.Vector3f(ray.d), mi.Float(ray.maxt)
            while dr.hint(active, label="visibility", exclude=[end]):
                part = mi.Ray3f(o, d)
                part.maxt = distance
                hit = self._scene.ray_intersect(part, mi.RayFlags.All, False, active)
                crosses = hit.is_valid()
                through = hit.bsdf(part).eval_null_transmission(hit, crosses)
                transmittance = dr.select(crosses, transmittance * through, transmittance)
                crossings += 1
                transmittance = dr.select(crosses & (crossings >= MAX_CROSSINGS), mi.Spectrum(0), transmittance)
                active = crosses & (dr.max(transmittance) > 0) & (crossings < MAX_CROSSINGS)
                tests += dr.select(active, mi.UInt32(1), mi.UInt32(0))
                rest = hit.spawn_ray_to(end)
                o, d, distance = mi.Point3f(rest.o), mi.Vector3f(rest.d), mi.Float(rest.maxt)
        return transmittance, tests
