"""Shadow rays: what dims them, and what blocks them."""

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def panes_and_wall(wall=True):
    """Along z: panes of opacity 0.25 at 1 and 0.5 at 2, over the half x > 0; a wall at 3 over the half y > 0."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f

    def pane(opacity, z):
        surface = {"type": "mask", "opacity": opacity, "bsdf": {"type": "diffuse"}}
        return {"type": "rectangle", "to_world": transform().translate([1, 0, z]), "bsdf": surface}

    scene = {"type": "scene", "near": pane(0.25, 1), "far": pane(0.5, 2)}
    if wall:
        scene["wall"] = {"type": "rectangle", "to_world": transform().translate([0, 1, 3])}
    return scene


def transmittance(shadow_rays, x, y, end=4.0):
    """Of rays along z from 0 to just before ``end`` at these places, with the rays traced for each."""
    import drjit as dr
    import mitsuba as mi

    origin, target = mi.Point3f(mi.Float(x), mi.Float(y), 0), mi.Point3f(mi.Float(x), mi.Float(y), end)
    ray = mi.Ray3f(origin, mi.Vector3f(0, 0, 1), mi.Float(end * (1 - 1e-4)), 0.0, [])
    ray.maxt = mi.Float(end * (1 - 1e-4))
    light, tests = shadow_rays.transmittance(ray, target, dr.full(mi.Bool, True, len(x)))
    return np.array(light.x), np.array(tests)


PLACES = np.array([(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)])


def test_panes_dim_and_walls_block():
    import mitsuba as mi

    from lippmann.rendering.transport.shadow_rays import ShadowRays

    shadow_rays = ShadowRays(mi.load_dict(panes_and_wall()), has_null=True)
    light, tests = transmittance(shadow_rays, *PLACES.T)
    assert light.tolist() == [1.0, 0.375, 0.0, 0.0]
    assert tests.tolist() == [1, 3, 1, 3]
    nearer, _ = transmittance(shadow_rays, *PLACES.T, end=1.5)
    assert nearer.tolist() == [1.0, 0.75, 1.0, 0.75]


def test_a_wall_alone_blocks_at_once():
    import mitsuba as mi

    from lippmann.rendering.transport.shadow_rays import ShadowRays

    wall = {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 1, 3])}
    light, tests = transmittance(ShadowRays(mi.load_dict({"type": "scene", "wall": wall}), has_null=False), *PLACES.T)
    assert light.tolist() == [1.0, 1.0, 0.0, 0.0]
    assert tests.tolist() == [1, 1, 1, 1]


@pytest.mark.slow
def test_many_panes_block():
    import mitsuba as mi

    from lippmann.rendering.transport.shadow_rays import MAX_CROSSINGS, ShadowRays

    clear = {"type": "mask", "opacity": 0.0, "bsdf": {"type": "diffuse"}}
    for panes, expected in ((MAX_CROSSINGS - 1, 1.0), (MAX_CROSSINGS, 0.0)):
        scene = {
            f"pane{i}": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().translate([0, 0, 1 + i / 100]),
                "bsdf": clear,
            }
            for i in range(panes)
        }
        light, _ = transmittance(ShadowRays(mi.load_dict({"type": "scene", **scene}), True), np.zeros(1), np.zeros(1))
        assert light.tolist() == [expected]
