"""Shadow rays: how much of an emitter's light reaches a surface past everything between the two.

Whatever lets rays straight through (alpha masks, thin glass) dims them instead of blocking them, so that the nearest
hit of each ray has to be found and asked, again and again. Most of what is in the way is opaque, and any hit on it
will do, which is found in half the time. So the opaque surfaces of a scene get an acceleration structure of their own,
and only rays that pass them are followed through the others.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.straight_through import is_instance, may_pass
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, MitsubaScene, Point3f, Ray3f, Shape, Spectrum, UInt32
from lippmann.rendering.transport.tuning import TUNING

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

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, scene: MitsubaScene, has_null: bool) -> None:
        #: Surfaces that block all light, and those that have to be asked how much; either may be all there are.
        divided: tuple[MitsubaScene, MitsubaScene] = _divided(scene) if has_null else (scene, None)
        self.opaque, self.asked = divided

    @syntax
    def transmittance(self, ray: Ray3f, end: Point3f, active: Bool) -> tuple[Spectrum, UInt32]:
        """Transmittance in [0, 1] along ``ray``, which stops short of ``end``, and the rays traced for it.

        A ray that an opaque surface blocks counts once, one that crosses n surfaces n + 1 times.
        """
        active = mi.Bool(active)
        tests = dr.select(active, mi.UInt32(1), mi.UInt32(0))
        transmittance = mi.Spectrum(1)
        if dr.hint(self.opaque is not None, mode="scalar"):
            blocked = self.opaque.ray_test(ray, active)
            transmittance = dr.select(blocked, mi.Spectrum(0), transmittance)
            active &= ~blocked
        if dr.hint(self.asked is not None, mode="scalar"):
            crossings = mi.UInt32(0)
            # What does not change, such as a ray's time, is no state: else Dr.Jit would record the loop a second time.
            o, d, distance = mi.Point3f(ray.o), mi.Vector3f(ray.d), mi.Float(ray.maxt)
            while dr.hint(active, label="visibility", exclude=[end]):
                part = mi.Ray3f(o, d)
                part.maxt = distance
                hit = self.asked.ray_intersect(part, mi.RayFlags.All, False, active)
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


def _divided(scene: MitsubaScene) -> tuple[MitsubaScene, MitsubaScene]:
    """The opaque shapes of a scene, and the others, as scenes of their own; None for none."""
    shapes = scene.shapes()
    passing = [may_pass(shape) for shape in shapes]
    opaque = [shape for shape, passes in zip(shapes, passing, strict=True) if not passes]
    others = [shape for shape, passes in zip(shapes, passing, strict=True) if passes]
    if not others:
        return scene, None
    # Instances need their groups, which no scene tells. A kernel of the GPU traces rays in one scene alone: those in a
    # second one meet nothing, and Dr.Jit only warns.
    undivided = dr.backend_v(mi.Float) == dr.JitBackend.CUDA or any(is_instance(shape) for shape in others)
    if undivided or not opaque or sum(shape.primitive_count() for shape in opaque) > TUNING.most_opaque:
        return None, scene
    return _scene_of(opaque), _scene_of(others)


def _scene_of(shapes: list[Shape]) -> MitsubaScene:
    return mi.load_dict({"type": "scene", **{f"shape{number}": shape for number, shape in enumerate(shapes)}})
