"""Shadow rays: what dims them, what blocks them, and that opaque shapes apart from the others change nothing."""

from dataclasses import replace

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


def on_gpu():
    import mitsuba as mi

    return mi.variant().startswith("cuda")


PLACES = np.array([(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)])


def test_panes_dim_and_walls_block():
    import mitsuba as mi

    from lippmann.rendering.transport.shadow_rays import ShadowRays

    shadow_rays = ShadowRays(mi.load_dict(panes_and_wall()), has_null=True)
    light, tests = transmittance(shadow_rays, *PLACES.T)
    assert light.tolist() == [1.0, 0.375, 0.0, 0.0]
    # The wall is found before any pane is asked; on a GPU it lies among them.
    assert tests.tolist() == ([1, 3, 1, 3] if on_gpu() else [1, 3, 1, 1])
    nearer, _ = transmittance(shadow_rays, *PLACES.T, end=1.5)
    assert nearer.tolist() == [1.0, 0.75, 1.0, 0.75]


def test_opaque_shapes_have_a_structure_of_their_own():
    import mitsuba as mi

    from lippmann.rendering.transport.shadow_rays import ShadowRays

    mixed = ShadowRays(mi.load_dict(panes_and_wall()), has_null=True)
    if on_gpu():
        pytest.skip("a kernel of a GPU traces rays in one structure alone")
    assert (len(mixed.opaque.shapes()), len(mixed.asked.shapes())) == (1, 2)
    panes = mi.load_dict(panes_and_wall(wall=False))
    assert ShadowRays(panes, has_null=True).opaque is None
    assert ShadowRays(panes, has_null=True).asked is panes
    wall = mi.load_dict({"type": "scene", "wall": {"type": "rectangle"}})
    for has_null in (False, True):
        opaque = ShadowRays(wall, has_null)
        assert (opaque.opaque, opaque.asked) == (wall, None)


@pytest.mark.slow
@pytest.mark.parametrize("undivided", ["many", "instanced"])
def test_scenes_that_are_not_divided_give_the_same(monkeypatch, undivided):
    import mitsuba as mi

    from lippmann.rendering.transport import shadow_rays as module

    described = panes_and_wall()
    if undivided == "instanced":
        wall = described.pop("wall")
        described["group"] = {"type": "shapegroup", "wall": {"type": "rectangle"}}
        described["copy"] = {
            "type": "instance",
            "to_world": wall["to_world"],
            "group": {"type": "ref", "id": "group"},
        }
    else:
        monkeypatch.setattr(module, "TUNING", replace(module.TUNING, most_opaque=0))
    scene = mi.load_dict(described)
    whole = module.ShadowRays(scene, has_null=True)
    assert (whole.opaque, whole.asked) == (None, scene)
    light, _ = transmittance(whole, *PLACES.T)
    assert light.tolist() == [1.0, 0.375, 0.0, 0.0]


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
