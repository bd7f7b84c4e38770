"""Paths joined to points that emitters light: as much light as without by all emitters and surfaces, less noise.

Pictures with and without are compared by blocks of pixels and as a whole, each seed with light vertices of its own.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from block_agreement import SIDE, agree

pytestmark = pytest.mark.usefixtures("engine")


def rgb(*values):
    return {"type": "rgb", "value": list(values) if len(values) > 1 else values[0]}


def diffuse(*values):
    return {"type": "diffuse", "reflectance": rgb(*values)}


def emitters():
    """Emitters that send rays, each beside a wall of :func:`room`, and what they are in."""
    import mitsuba as mi

    place = mi.ScalarTransform4f
    at = [-0.6, 0.6, 0.2]
    area = {"type": "area", "radiance": rgb(60, 50, 40)}
    texels = np.zeros((8, 8, 3), np.float32)
    texels[2:4, 1:7] = 120
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True, "filter_type": "nearest"}
    turned = place().translate(at).rotate([0.6, 0.8, 0], 70).scale(0.1)
    return {
        "sphere": {"type": "sphere", "center": at, "radius": 0.08, "emitter": area},
        "mesh": {"type": "cube", "to_world": turned, "emitter": area},
        "rectangle": {"type": "rectangle", "to_world": turned, "emitter": area},
        "disk": {"type": "disk", "to_world": turned, "emitter": area},
        "textured": {"type": "rectangle", "to_world": turned, "emitter": {"type": "area", "radiance": texture}},
        "point": {"type": "point", "position": at, "intensity": rgb(0.9, 0.8, 0.6)},
        "spot": {
            "type": "spot",
            "to_world": place().look_at(at, [-1, 0.9, -0.9], [0, 1, 0]),
            "intensity": rgb(4),
            "cutoff_angle": 50,
        },
    }


def room(*names, surface=None, more=None):
    """A room open to the eye, with some of the emitters, a ball, and a dim sky."""
    import mitsuba as mi

    place = mi.ScalarTransform4f
    walls = {
        "back": (place().translate([0, 0, -1]), diffuse(0.7, 0.6, 0.5)),
        "left": (place().translate([-1, 0, 0]).rotate([0, 1, 0], 90), diffuse(0.7, 0.3, 0.2)),
        "right": (place().translate([1, 0, 0]).rotate([0, 1, 0], -90), diffuse(0.2, 0.6, 0.3)),
        "floor": (place().translate([0, -1, 0]).rotate([1, 0, 0], -90), diffuse(0.6)),
        # Seen from its back, too.
        "ceiling": (place().translate([0, 1, 0]).rotate([1, 0, 0], -90), {"type": "twosided", "bsdf": diffuse(0.7)}),
    }
    scene = {
        name: {"type": "rectangle", "to_world": pose, "bsdf": surface if surface and name == "back" else bsdf}
        for name, (pose, bsdf) in walls.items()
    }
    ball = {"type": "sphere", "center": [0.3, -0.5, 0], "radius": 0.4, "bsdf": surface or diffuse(0.5)}
    chosen = {name: emitters()[name] for name in names}
    sky = {"type": "constant", "radiance": rgb(0.1)}
    return {"type": "scene", **scene, "ball": ball, **chosen, "sky": sky, **(more or {})}


def surfaces():
    hole = {"type": "mask", "opacity": 0.6, "bsdf": {"type": "twosided", "bsdf": diffuse(0.6)}}
    return {
        "matt": diffuse(0.6, 0.5, 0.4),
        "plastic": {"type": "roughplastic", "alpha": 0.2, "diffuse_reflectance": rgb(0.5, 0.2, 0.1)},
        "principled": {"type": "principled", "base_color": rgb(0.2, 0.3, 0.6), "roughness": 0.3, "clearcoat": 1.0},
        "metal": {"type": "roughconductor", "material": "Al", "alpha": 0.2},
        "mirror": {"type": "conductor", "material": "Al"},
        "frosted": {"type": "roughdielectric", "alpha": 0.2},
        "bumps": {"type": "bumpmap", "arbitrary": _waves(), "scale": 0.05, "bsdf": diffuse(0.6)},
        "hole": hole,
    }


def _waves():
    import mitsuba as mi

    x = np.linspace(0, 6 * np.pi, 64, endpoint=False)
    height = (np.sin(x)[:, None] * np.sin(x)[None])[..., None].astype(np.float32)
    return {"type": "bitmap", "bitmap": mi.Bitmap(height), "raw": True}


def prepared(scene, *, has_null=False, depth=4):
    """Integrator and eye of a Mitsuba scene or its dictionary."""
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    loaded = mi.load_dict(scene) if isinstance(scene, dict) else scene
    integrator = PathIntegrator(loaded, make_scene_features(loaded, has_null=has_null), depth)
    pose = np.eye(4)
    pose[2, 3] = 3.2
    return integrator, CameraRays(Camera("eye", pose, fov_y=0.7), SIDE, SIDE)


def passes(integrator, seed):
    from lippmann.rendering.transport.light_vertices import LightVertexPasses

    return LightVertexPasses(integrator.scene, integrator.light_sampler, 8, seed, None)


def pictures(integrator, source, joined, *, seeds, spp=8):
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame

    plan = cut_wavefronts(SIDE, SIDE, spp, memory=2**30)
    found = []
    for seed in seeds:
        lit = integrator.lit_by(
            replace(integrator.light, light_vertices=passes(integrator, seed).of_pass(0) if joined else None)
        )
        found.append(trace_frame(lit, source, plan, seed=seed).pixels)
    return np.stack(found).astype(np.float64)


def noise(found):
    """Of the middle one of all pixels: those at the emitter's outline have more than all others."""
    return np.median(found.var(axis=0, ddof=1))


@pytest.mark.long_cases(but=["spot"])
@pytest.mark.parametrize("name", ["sphere", "mesh", "rectangle", "disk", "textured", "point", "spot"])
def test_light_of_every_emitter_is_whole_and_less_noisy(name):
    integrator, source = prepared(room(name))
    plain, joined = (pictures(integrator, source, way, seeds=range(16)) for way in (False, True))
    agree(plain, joined)
    assert noise(joined) < 0.8 * noise(plain)


@pytest.mark.long
@pytest.mark.parametrize("name", ["matt", "plastic", "principled", "metal", "mirror", "frosted", "bumps", "hole"])
def test_every_surface_scatters_as_much(name):
    integrator, source = prepared(room("sphere", surface=surfaces()[name]), has_null=name == "hole")
    plain, joined = (pictures(integrator, source, way, seeds=range(24)) for way in (False, True))
    agree(plain, joined)


@pytest.mark.long
def test_several_emitters_share_the_rays():
    integrator, source = prepared(room("mesh", "point", "spot", more=emitter_outside()))
    plain, joined = (pictures(integrator, source, way, seeds=range(24)) for way in (False, True))
    agree(plain, joined)


def emitter_outside():
    light = {"type": "area", "radiance": rgb(9)}
    return {"outside": {"type": "sphere", "center": [9, 9, 9], "radius": 0.1, "emitter": light}}


@pytest.mark.long
def test_weights_are_those_of_the_light_sampler_in_use():
    """Emitters chosen unevenly: the pdf of next-event estimation is that of the sampler in use."""
    from lippmann.rendering.transport.light_sampling import WeightedLightSampler

    integrator, source = prepared(room("sphere", "point"))
    integrator = integrator.lit_by(
        replace(integrator.light, sampler=WeightedLightSampler(integrator.scene, np.array([0.7, 0.05, 0.25])))
    )
    plain, joined = (pictures(integrator, source, way, seeds=range(24)) for way in (False, True))
    agree(plain, joined)


@pytest.mark.long
@pytest.mark.parametrize("depth", [1, 2, 7])
def test_paths_are_no_longer_than_asked(depth):
    integrator, source = prepared(room("point"), depth=depth)
    plain, joined = (pictures(integrator, source, way, seeds=range(24)) for way in (False, True))
    if depth == 1:
        np.testing.assert_array_equal(plain, joined)
    agree(plain, joined)


def test_a_limit_on_indirect_light_holds_for_joins():
    import mitsuba as mi

    integrator, source = prepared(room("point"), depth=2)
    limited, none = (
        pictures(
            integrator.lit_by(replace(integrator.light, most_indirect=mi.Float(most))), source, True, seeds=range(4)
        )
        for most in (0.02, 0.0)
    )
    direct = pictures(prepared(room("point"), depth=1)[0], source, False, seeds=range(4))
    np.testing.assert_allclose(none, direct, rtol=1e-4, atol=1e-5)
    assert direct.mean() < limited.mean() < direct.mean() + 0.06


@pytest.mark.long
def test_coloured_glass_takes_its_light():
    """Light that crosses glass is left to the paths that know how far they went through it."""
    from lippmann.device.pbr import build_description
    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    built = build_description(glass_room())
    features = make_scene_features(built.mitsuba, has_null=built.has_null, absorption=built.absorption)
    assert features.absorption is not None
    integrator = PathIntegrator(built.mitsuba, features, 5)
    pose = np.eye(4)
    pose[2, 3] = 3.2
    source = CameraRays(Camera("eye", pose, fov_y=0.7), SIDE, SIDE)
    plain, joined = (pictures(integrator, source, way, seeds=range(32)) for way in (False, True))
    agree(plain, joined)


def glass_room():
    """Frosted coloured glass about a matt ball, before painted walls, beside a small light."""
    import trimesh

    from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription

    materials = [
        Material(
            "glass",
            transmission=1.0,
            roughness=0.4,
            thickness=1.0,
            attenuation_color=(0.9, 0.3, 0.2),
            attenuation_distance=0.4,
        ),
        Material("matt", base_color=(0.7, 0.6, 0.5), roughness=1.0),
    ]
    shells = [(trimesh.creation.icosphere(3, 0.6), 0), (trimesh.creation.icosphere(2, 0.25), 1)]
    shells.append((trimesh.creation.box((4, 4, 0.1)), 1))
    meshes = [
        Mesh("", one.vertices.astype("f4"), one.faces.astype(np.uint32), kind, one.vertex_normals.astype("f4"))
        for one, kind in shells
    ]
    instances = []
    for number in range(3):
        place = np.eye(4)
        place[2, 3] = -1.0 if number == 2 else 0.0
        instances.append(Instance(number, place))
    at = np.eye(4)
    at[:3, 3] = 0.7, 0.6, -0.7
    return SceneDescription("glass", meshes, materials, instances, lights=[Light("point", (2, 2, 2), at, radius=0.05)])


def glowing_room(kind):
    """Painted walls about a glowing plate, or a light of some size in a cone, of a description."""
    import trimesh

    from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription

    plate = {
        "glow": {"emission": (30.0, 25.0, 20.0)},
        "two-sided": {"emission": (30.0, 25.0, 20.0), "double_sided": True},
    }
    materials = [
        Material("paint", base_color=(0.7, 0.5, 0.4), roughness=1.0),
        Material("plate", base_color=(0.0, 0.0, 0.0), roughness=1.0, **plate.get(kind, {})),
    ]
    wall = trimesh.creation.box((2.4, 2.4, 0.1))
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32) * 0.12
    meshes = [
        Mesh("", wall.vertices.astype("f4"), wall.faces.astype(np.uint32), 0),
        Mesh("", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), 1),
    ]
    instances = []
    for turn, offset in ((0, (0, 0, -1)), (90, (-1, 0, 0)), (-90, (1, 0, 0))):
        place = trimesh.transformations.rotation_matrix(np.radians(turn), [0, 1, 0])
        place[:3, 3] = offset
        instances.append(Instance(0, place))
    at = trimesh.transformations.rotation_matrix(np.radians(50), [1, 1, 0])
    at[:3, 3] = -0.65, 0.3, -0.5
    lights = []
    if kind == "cone":
        lights = [Light("spot", (4, 4, 3), at, radius=0.08, inner_angle=0.5, outer_angle=0.9)]
    else:
        instances.append(Instance(1, at))
    return SceneDescription("glowing", meshes, materials, instances, lights=lights)


@pytest.mark.parametrize(
    "kind", ["glow", pytest.param("two-sided", marks=pytest.mark.long), pytest.param("cone", marks=pytest.mark.long)]
)
def test_glowing_surfaces_and_cones_light_as_much(kind):
    from lippmann.device.pbr import build_description

    built = build_description(glowing_room(kind))
    integrator, source = prepared(built.mitsuba, has_null=built.has_null)
    assert not passes(integrator, 1).are_none
    plain, joined = (pictures(integrator, source, way, seeds=range(16)) for way in (False, True))
    agree(plain, joined)
    assert noise(joined) < 0.8 * noise(plain)


@pytest.mark.parametrize("radius", [0.0, 0.1, 1.0])
def test_a_ball_lit_from_its_middle_shows_what_theory_says(radius):
    """Inside a matt ball every point receives the same of every other: each reflection brings albedo times the last."""
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    albedo, size, power = 0.6, 2.0, 5.0
    ball = {"type": "sphere", "radius": size, "flip_normals": True, "bsdf": diffuse(albedo)}
    light = {"type": "point", "intensity": rgb(power)}
    if radius:
        glow = {"type": "area", "radiance": rgb(power / (math.pi * radius**2))}
        light = {"type": "sphere", "radius": radius, "bsdf": diffuse(0.0), "emitter": glow}
    integrator, _ = prepared({"type": "scene", "ball": ball, "light": light}, depth=3)
    pose = np.eye(4)
    pose[2, 3] = -1.5 * radius  # with the emitter behind it
    source = CameraRays(Camera("within", pose, fov_y=1.0), SIDE, SIDE)
    found = pictures(integrator, source, True, seeds=range(4))
    # The emitter is in the way of that part of the light between the walls that it would receive.
    again = albedo * (1 - (radius / size) ** 2)
    expected = albedo * power / (math.pi * size**2) * (1 + again + again**2)
    assert found.mean() == pytest.approx(expected, rel=2e-3 if radius else 1e-4)


def test_a_join_is_what_its_formula_says():
    """The readable twin: one light vertex, one matt point, each factor by itself."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.rendering.transport.emitter_rays import LitPoints
    from lippmann.rendering.transport.light_vertices import LightVertices

    integrator, _ = prepared(room("point"))
    random = np.random.default_rng(4)
    n = 64

    def unit(vectors):
        return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).astype(np.float32)

    position = random.uniform([-0.9, 0, -0.9], [-0.1, 0.9, 0.9], (n, 3)).astype(np.float32)
    points = LitPoints(
        position,
        unit(random.normal(size=(n, 3))),
        unit(random.normal(size=(n, 3))),
        random.uniform(0, 1, (n, 3)).astype(np.float32),
        *random.uniform(0.1, 2, (3, n)).astype(np.float32),
    )
    rays = 2 * n  # half of them met nothing
    store = LightVertices(integrator.scene, (points, points), rays, np.zeros(2, np.float32))
    ray = mi.Ray3f(mi.Point3f(-0.5, 0, 0.2), mi.Vector3f(0, -1, 0))
    si = integrator.scene.ray_intersect(dr.gather(mi.Ray3f, ray, dr.zeros(mi.UInt32, n)))
    choice = (mi.Float(dr.arange(mi.UInt32, n)) + 0.5) / n
    light, tests = store.join(si, si.bsdf(), choice, mi.UInt32(0), mi.Bool(True), through=True)

    x, normal = np.array([-0.5, -1.0, 0.2]), np.array([0.0, 1.0, 0.0])
    way = position.astype(float) - x
    squared = (way**2).sum(axis=1)
    toward = way / np.sqrt(squared)[:, None]
    at_x, at_y = toward @ normal, -(toward * points.normal).sum(axis=1)
    faces = (at_y > 0) & ((toward * points.shading).sum(axis=1) < 0)
    density = at_x / np.pi * at_y / squared  # with which the path itself would come there
    scale = rays / n
    own = points.reach * scale
    weight = own**2 / (own**2 + (points.sampled * density) ** 2 + (points.scattered * density) ** 2)
    expected = 0.6 / np.pi * (at_x * at_y / squared * weight)[:, None] * points.glow / scale
    np.testing.assert_allclose(np.array(light).T, np.where(faces[:, None], expected, 0), rtol=2e-4, atol=1e-6)
    np.testing.assert_array_equal(np.array(tests), faces)


def test_the_same_seed_gives_the_same_light_vertices_and_halves_their_own():
    integrator, _ = prepared(room("mesh", "point"))
    first, again, other = (passes(integrator, seed) for seed in (1, 1, 2))
    one, two, three = (np.array(each.of_pass(0)._place) for each in (first, again, other))
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one[:400], three[:400])
    later = np.array(first.of_pass(1)._place)
    assert not np.array_equal(one[:400], later[:400])
    np.testing.assert_array_equal(one, np.array(first.of_pass(0)._place))
    half = len(one) // 2
    assert not np.array_equal(one[:400], one[half : half + 400])


def test_there_are_none_where_no_emitter_sends_rays():
    import mitsuba as mi

    sky, _ = prepared(room())
    assert passes(sky, 1).are_none
    sun = {"type": "directional", "direction": [0, -1, -1], "irradiance": rgb(1)}
    assert passes(prepared(room(more={"sun": sun}))[0], 1).are_none
    # Light that meets nothing.
    away = {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 9], [0, 1, 0]),
        "intensity": rgb(1),
    }
    assert passes(prepared(room(more={"away": away}))[0], 1).are_none
