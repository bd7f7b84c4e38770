"""Which shapes may let rays straight through."""

import pytest

pytestmark = pytest.mark.usefixtures("engine")

MASK = {"type": "mask", "opacity": 0.5, "bsdf": {"type": "diffuse"}}


def test_surfaces_tell_and_instances_may():
    import mitsuba as mi

    from lippmann.device.pbr.scene import is_instance, may_pass

    wall, mask = (mi.load_dict({"type": "rectangle", "bsdf": surface}) for surface in ({"type": "diffuse"}, MASK))
    group = {"type": "shapegroup", "wall": {"type": "rectangle"}}
    scene = mi.load_dict(
        {"type": "scene", "group": group, "copy": {"type": "instance", "of": {"type": "ref", "id": "group"}}}
    )
    instance = scene.shapes()[0]
    assert [may_pass(shape) for shape in (wall, mask, instance)] == [False, True, True]
    assert [is_instance(shape) for shape in (wall, mask, instance)] == [False, False, True]


def test_a_scene_with_instances_may_let_rays_through():
    """A floor under a point light, with an instance of a half-transparent plate between them."""
    import mitsuba as mi

    from lippmann.api import load_scene
    from lippmann.device.pbr import build

    scene = {
        "type": "scene",
        "floor": {"type": "rectangle"},
        "plates": {"type": "shapegroup", "plate": {"type": "rectangle", "bsdf": MASK}},
        "plate": {
            "type": "instance",
            "of": {"type": "ref", "id": "plates"},
            "to_world": mi.ScalarTransform4f().translate([0, 0, 1]),
        },
        "light": {"type": "point", "position": [0, 0, 2]},
    }
    assert build(load_scene(mi.load_dict(scene))).has_null
