"""Layers and guides of scenes in which every value is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.runtime.engine import runs_on_gpu

pytestmark = pytest.mark.usefixtures("engine")

DISPLAY = Display("small", Panel(48, 30, 0.5), LensArray("square", 3.0), 9.0, aperture_distance=20.0)

#: The display stands in the world turned, twice as large and away from the origin.
WORLD_FROM_DISPLAY = np.array(
    [[0.0, -2.0, 0.0, 5.0], [2.0, 0.0, 0.0, -7.0], [0.0, 0.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0]]
)
DISPLAY_FROM_WORLD = np.linalg.inv(WORLD_FROM_DISPLAY)

#: In the display's frame, mm: a ball that stands out, and before it nothing but a wall that leans.
BALL, RADIUS = np.array([1.0, 0.5, -1.0]), 4.0
WALL_POINT, WALL_NORMAL = np.array([0.0, 0.0, -12.0]), np.array([0.0, 0.6, 0.8])
WALL_HALF_WIDTH = 9.0


def traced(built, source=None, display_from_world=DISPLAY_FROM_WORLD, memory=2**30):
    from lippmann.rendering.film.aov import plan_layers, trace_layers
    from lippmann.rendering.transport.ray_source import DisplayRays

    source = source or DisplayRays(DISPLAY, WORLD_FROM_DISPLAY)
    return trace_layers(built, source, plan_layers(source, memory), display_from_world)


def guided(built, source=None, samples=4, memory=2**30, box_filter=True):
    from lippmann.rendering.film.feature_buffers import plan_guides, trace_guides
    from lippmann.rendering.transport.ray_source import DisplayRays

    source = source or DisplayRays(DISPLAY, WORLD_FROM_DISPLAY)
    plan = plan_guides(source, samples, memory)
    return trace_guides(built, source, plan, DISPLAY_FROM_WORLD, box_filter=box_filter)


def of_mitsuba(objects, background=(0.0, 0.0, 0.0)):
    from lippmann.api import load_scene
    from lippmann.device.pbr import build

    return build(load_scene({"type": "scene"} | objects, background=background))


def in_world(matrix):
    import mitsuba as mi

    return mi.ScalarTransform4f((WORLD_FROM_DISPLAY @ matrix).tolist())


def rgb(*values):
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(values)}}


def wall(point=WALL_POINT, normal=WALL_NORMAL, half=WALL_HALF_WIDTH, bsdf=None, color=(0.2, 0.4, 0.8)):
    """A rectangle of the display's frame that faces along ``normal``, level in x."""
    up = np.cross(normal, [1.0, 0.0, 0.0])
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = [half, 0, 0], up * half, normal, point
    return {"type": "rectangle", "to_world": in_world(matrix), "bsdf": bsdf or rgb(*color)}


def ball_and_wall():
    center = (WORLD_FROM_DISPLAY @ [*BALL, 1])[:3]
    ball = {"type": "sphere", "center": center.tolist(), "radius": 2 * RADIUS, "bsdf": rgb(0.5, 0.25, 0.125)}
    return {"ball": ball, "wall": wall()}


def middle_rays(display=DISPLAY):
    """Start and unit direction of the rays through the middles of the pixels, ``(H, W, 3)``, display frame."""
    row, column = np.indices((display.panel.height, display.panel.width)).astype(float)
    x, y = display.panel_point(column + 0.5, row + 0.5)
    origin, direction = (np.stack(np.broadcast_arrays(*part), axis=-1) for part in display.light_ray(x, y))
    return origin, direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def on_ball(o, d, center=BALL, radius=RADIUS):
    """Distance to the near side, NaN beside it."""
    b = ((o - center) * d).sum(-1)
    with np.errstate(invalid="ignore"):
        return -b - np.sqrt(b * b - ((o - center) ** 2).sum(-1) + radius**2)


def on_wall(o, d):
    t = ((WALL_POINT - o) @ WALL_NORMAL) / (d @ WALL_NORMAL)
    at = o + t[..., None] * d - WALL_POINT
    inside = (np.abs(at[..., 0]) < WALL_HALF_WIDTH) & (np.linalg.norm(at - at * [1, 0, 0], axis=-1) < WALL_HALF_WIDTH)
    return np.where(inside, t, np.nan)


def test_ball_and_wall_are_where_they_stand():
    built = of_mitsuba(ball_and_wall())
    layers = traced(built)
    o, d = middle_rays()
    ball, back = on_ball(o, d), on_wall(o, d)
    sees_ball = np.isfinite(ball)
    sees_wall = ~sees_ball & np.isfinite(back)
    sees_none = ~sees_ball & ~sees_wall
    assert min(sees_ball.sum(), sees_wall.sum(), sees_none.sum()) > 100
    point = o + np.where(sees_ball, ball, back)[..., None] * d

    np.testing.assert_allclose(layers["position"][~sees_none], point[~sees_none], rtol=0, atol=2e-5)
    np.testing.assert_allclose(layers["depth"][~sees_none], point[~sees_none][:, 2], rtol=0, atol=2e-5)
    assert layers["depth"][sees_ball].max() > 0 > layers["depth"][sees_wall].max()
    np.testing.assert_allclose(layers["normal"][sees_ball], (point[sees_ball] - BALL) / RADIUS, rtol=0, atol=1e-5)
    assert np.abs(layers["normal"][sees_wall] - WALL_NORMAL).max() < 1e-6
    assert np.abs(layers["albedo"][sees_ball] - [0.5, 0.25, 0.125]).max() < 1e-6
    assert np.abs(layers["albedo"][sees_wall] - [0.2, 0.4, 0.8]).max() < 1e-6
    kinds = ["Sphere" in str(shape) for shape in built.mitsuba.shapes()]
    assert (layers["shape"][sees_ball] == kinds.index(True)).all()
    assert (layers["shape"][sees_wall] == kinds.index(False)).all()

    assert np.isneginf(layers["depth"][sees_none]).all()
    assert np.isnan(layers["position"][sees_none]).all()
    assert not layers["normal"][sees_none].any()
    assert not layers["albedo"][sees_none].any()
    assert (layers["shape"][sees_none] == -1).all()


def test_layers_do_not_depend_on_tiles():
    built = of_mitsuba(ball_and_wall())
    from lippmann.rendering.film.aov import plan_layers
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.transport.ray_source import DisplayRays

    source = DisplayRays(DISPLAY, WORLD_FROM_DISPLAY)
    assert len(plan_layers(source, 2**30).tiles) == 1
    whole = traced(built)
    from lippmann.rendering.film.aov import trace_layers

    for rows in (1, 7):
        plan = cut_wavefronts(48, 30, 1, memory=2**30, preferred_lanes=48 * rows)
        assert len(plan.tiles) > 3
        parts = trace_layers(built, source, plan, DISPLAY_FROM_WORLD)
        for name, values in whole.items():
            assert np.array_equal(values, parts[name], equal_nan=True), name


def test_plans_follow_the_memory():
    from lippmann.display import load_display
    from lippmann.errors import MemoryLimitError
    from lippmann.rendering.film.aov import plan_layers
    from lippmann.rendering.film.feature_buffers import plan_guides
    from lippmann.rendering.film.memory_model import BYTES_PER_LANE
    from lippmann.rendering.transport.ray_source import DisplayRays

    source = DisplayRays(load_display("seed-lenticular"), np.eye(4))
    layers = 512 * 512 * 4 * 11  # what is handed back alone
    for memory in (3 * layers, 4 * layers, 8 * layers):
        for plan in (plan_layers(source, memory), plan_guides(source, 16, memory)):
            assert plan.lanes * BYTES_PER_LANE < memory - layers
    assert plan_layers(source, 3 * layers).lanes < plan_layers(source, 8 * layers).lanes
    with pytest.raises(MemoryLimitError, match="memory: 11 MiB are too small for 512x512 pixels; it needs "):
        plan_layers(source, layers)


def test_sub_pixels_have_the_layers_of_whole_pixels():
    from lippmann.rendering.transport.ray_source import DisplayRays

    built = of_mitsuba(ball_and_wall())
    apart = traced(built, DisplayRays(DISPLAY, WORLD_FROM_DISPLAY, subpixels=True))
    for name, values in traced(built).items():
        assert np.allclose(values, apart[name], atol=1e-5, equal_nan=True), name


def test_layers_survive_an_exr(tmp_path):
    from lippmann.image import IntegralImage
    from lippmann.image.read import read_picture

    layers = traced(of_mitsuba(ball_and_wall()))
    image = IntegralImage(np.zeros((30, 48, 3)), DISPLAY, WORLD_FROM_DISPLAY, maps=layers)
    image.save(tmp_path / "x.exr")
    read = read_picture(tmp_path / "x.exr").maps
    assert read.keys() == layers.keys()
    for name, values in layers.items():
        assert np.array_equal(values, read[name], equal_nan=True), name


# ---- Surfaces of other kinds ----------------------------------------------------------------------------------------


def front(z, half=30.0, **rest):
    return wall(point=np.array([0.0, 0.0, z]), normal=np.array([0.0, 0.0, 1.0]), half=half, **rest)


@pytest.mark.parametrize(("opacity", "sees"), [(0.4, "behind"), (0.6, "sheet")])
def test_surfaces_that_are_mostly_open_are_looked_through(opacity, sees):
    sheet = front(-2.0, bsdf={"type": "mask", "opacity": opacity, "bsdf": rgb(1.0, 0.0, 0.0)})
    layers = traced(of_mitsuba({"sheet": sheet, "behind": front(-6.0, color=(0.0, 1.0, 0.0))}))
    expected = (-2.0, (1, 0, 0)) if sees == "sheet" else (-6.0, (0, 1, 0))
    np.testing.assert_allclose(layers["depth"], np.full((30, 48), expected[0]), rtol=0, atol=1e-5)
    np.testing.assert_allclose(layers["albedo"], np.broadcast_to(expected[1], (30, 48, 3)), rtol=0, atol=1e-6)


def test_panes_are_looked_through_however_many():
    panes = {f"pane{k}": front(-0.5 * k, bsdf={"type": "thindielectric"}) for k in range(1, 8)}
    layers = traced(of_mitsuba({**panes, "behind": front(-6.0)}))
    np.testing.assert_allclose(layers["depth"], np.full((30, 48), -6.0), rtol=0, atol=1e-5)


def test_placements_of_a_mesh_kept_once_are_shapes_of_their_own():
    import trimesh

    from lippmann.device.pbr import build_description
    from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

    ball = trimesh.creation.icosphere(subdivisions=5, radius=3.0)
    mesh = Mesh("ball", ball.vertices.astype(np.float32), ball.faces.astype(np.uint32), 0)
    places = [WORLD_FROM_DISPLAY @ [[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, -3], [0, 0, 0, 1]] for x in (-5.0, 5.0)]
    scene = SceneDescription("balls", [mesh], [Material()], [Instance(0, place) for place in places])
    built = build_description(scene, memory=4 << 20)  # two of them would not fit
    assert len(built.mitsuba.shapes()) == 2  # the mesh itself is kept once, out of sight
    layers = traced(built)
    seen, x = layers["shape"] >= 0, layers["position"][..., 0]
    sides = [set(layers["shape"][mask]) for mask in (seen & (x < 0), seen & (x > 0))]
    assert [len(side) for side in sides] == [1, 1]
    assert sides[0] != sides[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bsdf", "albedo"),
    [
        ({"type": "conductor", "specular_reflectance": {"type": "rgb", "value": [0.9, 0.6, 0.3]}}, (0.9, 0.6, 0.3)),
        ({"type": "dielectric", "specular_transmittance": {"type": "rgb", "value": [0.2, 0.7, 0.9]}}, (0.2, 0.7, 0.9)),
        ({"type": "plastic", "diffuse_reflectance": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}, (0.1, 0.2, 0.3)),
    ],
)
def test_albedo_of_mitsubas_own_surfaces(bsdf, albedo):
    if bsdf["type"] == "conductor":
        bsdf = {"type": "twosided", "bsdf": bsdf | {"material": "none"}}
    layers = traced(of_mitsuba({"sheet": front(-3.0, bsdf=bsdf)}))
    assert np.abs(layers["albedo"] - albedo).max() < 1e-6
    np.testing.assert_allclose(layers["depth"], np.full((30, 48), -3.0), rtol=0, atol=1e-5)


def test_backs_of_surfaces_face_the_viewer():
    turned = wall(point=np.array([0.0, 0.0, -3.0]), normal=np.array([0.0, 0.0, -1.0]), half=30.0)
    normal = traced(of_mitsuba({"turned": turned}))["normal"]
    assert np.abs(normal - [0.0, 0.0, 1.0]).max() < 1e-6


def described(**material):
    """A sheet at z = -3 mm whose texture runs over the panel, u to the right and v down."""
    from lippmann.device.pbr import build_description
    from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

    corners = np.array([[-12.0, -7.5, -3], [12, -7.5, -3], [12, 7.5, -3], [-12, 7.5, -3]], dtype=np.float32)
    world = (corners @ WORLD_FROM_DISPLAY[:3, :3].T + WORLD_FROM_DISPLAY[:3, 3]).astype(np.float32)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)
    mesh = Mesh("sheet", world, faces, 0, uvs=(uv,))
    return build_description(
        SceneDescription("sheet", [mesh], [Material(**material)], [Instance(0, np.eye(4))], background=(0.0, 0.0, 0.0))
    )


def texture(texels, srgb=False):
    from lippmann.scene.values.description import Image, Texture

    return Texture(Image("texels", np.asarray(texels, dtype=np.uint8)), srgb=srgb, filter="nearest", wrap_u="clamp")


def test_base_color_is_read_from_the_texture_where_each_ray_falls():
    left, right = (250, 128, 0), (0, 255, 51)
    layers = traced(described(base_color=(1.0, 0.5, 1.0), base_color_texture=texture([[left, right]]), metallic=1.0))
    on_left = layers["position"][..., 0] < 0
    seen = np.isfinite(layers["depth"])
    assert min((seen & on_left).sum(), (seen & ~on_left).sum()) > 300
    for side, texel in ((on_left, left), (~on_left, right)):
        expected = np.array(texel) / 255 * [1.0, 0.5, 1.0]
        assert np.abs(layers["albedo"][seen & side] - expected).max() < 1e-5


def test_normal_maps_count():
    bent = traced(described(normal_texture=texture([[(192, 108, 230)]])))
    seen = np.isfinite(bent["depth"])
    assert seen.sum() > 600
    texel = np.array([192, 108, 230]) / 255 * 2 - 1
    assert np.abs(bent["normal"][seen] - texel / np.linalg.norm(texel)).max() < 1e-5


# ---- Guides ---------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_guides_average_over_the_pixel():
    built = of_mitsuba(ball_and_wall())
    one, many = guided(built, samples=1, box_filter=False), guided(built, samples=16)
    layers = traced(built)
    np.testing.assert_allclose(one.albedo, layers["albedo"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(one.normal, layers["normal"], rtol=0, atol=1e-5)
    edges = (many.albedo > 1e-3) & (np.abs(many.albedo - one.albedo) > 1e-3)
    assert 50 < edges.any(axis=-1).sum() < 700
    assert np.abs(many.albedo - one.albedo).mean() < 0.05


def test_guides_of_a_straight_edge_have_no_noise():
    from lippmann.rendering.transport.ray_source import DisplayRays

    built = of_mitsuba({"wall": wall(normal=np.array([0.0, 0.0, 1.0]))})
    upright = replace(DISPLAY, lens_array=LensArray("lenticular", 3.0))
    guides = guided(built, DisplayRays(upright, WORLD_FROM_DISPLAY), samples=7)
    assert np.ptp(guides.albedo, axis=0).max() < 1e-6
    blue = guides.albedo[0, :, 2]
    assert blue.max() == pytest.approx(0.8)
    assert ((blue > 0.05) & (blue < 0.75)).any()


@pytest.mark.long
def test_guides_do_not_depend_on_tiles():
    from lippmann.rendering.film.feature_buffers import trace_guides
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.transport.ray_source import DisplayRays

    built = of_mitsuba(ball_and_wall())
    source = DisplayRays(DISPLAY, WORLD_FROM_DISPLAY)
    whole = guided(built, samples=8)
    plan = cut_wavefronts(48, 30, 8, memory=2**30, preferred_lanes=48 * 2)
    assert len(plan.tiles) > 1
    parts = trace_guides(built, source, plan, DISPLAY_FROM_WORLD)
    assert parts.albedo == pytest.approx(whole.albedo, abs=1e-6)
    assert parts.normal == pytest.approx(whole.normal, abs=1e-5)


@pytest.mark.slow
def test_guides_show_what_a_mirror_shows():
    """A mirror at 45 degrees, and above it a red ceiling that faces down."""
    normal = np.array([0.0, 1.0, 1.0]) / np.sqrt(2)
    tint = {"type": "rgb", "value": [0.5, 0.5, 0.5]}
    conductor = {"type": "conductor", "material": "none", "specular_reflectance": tint}
    mirror = wall(np.array([0.0, 0.0, -20.0]), normal, 40.0, bsdf={"type": "twosided", "bsdf": conductor})
    ceiling = wall(np.array([0.0, 60.0, 0.0]), np.array([0.0, -1.0, 0.0]), 400.0, color=(0.8, 0.2, 0.0))
    built = of_mitsuba({"mirror": mirror, "ceiling": ceiling})
    guides = guided(built)
    inner = np.s_[8:-8, 8:-8]
    # A GPU rounds reflectances otherwise.
    assert np.abs(guides.albedo[inner] - [0.4, 0.1, 0.0]).max() < (1e-4 if runs_on_gpu() else 1e-5)
    assert np.abs(guides.normal[inner] - [0.0, -1.0, 0.0]).max() < 1e-5
    assert np.abs(traced(built)["normal"][inner] - normal).max() < 1e-5


def test_guides_show_lamps_and_sky():
    lamp = front(-3.0, half=3.0) | {"emitter": {"type": "area", "radiance": {"type": "rgb", "value": [5.0, 0.5, 0.0]}}}
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}
    built = replace(of_mitsuba({"lamp": lamp | {"bsdf": rgb(0, 0, 0)}, "sky": sky}), background=None)
    layers, guides = traced(built), guided(built, samples=1, box_filter=False)
    on_lamp = np.isfinite(layers["depth"])
    assert np.abs(guides.albedo[on_lamp] - [1.0, 0.5, 0.0]).max() < 1e-6
    assert np.abs(guides.albedo[~on_lamp] - [0.1, 0.2, 0.3]).max() < 1e-6
    assert not guides.normal[~on_lamp].any()


@pytest.mark.long
def test_sub_pixels_have_guides_of_their_own():
    from lippmann.rendering.transport.ray_source import DisplayRays

    # Texels about three times as wide as what a pixel sees of them, with edges that lie inside pixels.
    steps = np.where(np.arange(47)[:, None] % 2, 255, 0) * np.ones(3, dtype=int)
    built = described(base_color_texture=texture(steps[None]))
    apart = guided(built, DisplayRays(DISPLAY, WORLD_FROM_DISPLAY, subpixels=True), samples=16)
    together = guided(built, samples=16)
    red, green, blue = np.moveaxis(apart.albedo, -1, 0)
    assert np.abs(red - blue).max() > 0.5
    assert np.abs(together.albedo[..., 0] - together.albedo[..., 2]).max() < 1e-6
    assert np.abs((red + green + blue) / 3 - together.albedo[..., 0]).mean() < 0.05


# ---- Classic scenes -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("handedness", ["left", "right"])
def test_classic_scenes_have_the_same_layers(handedness):
    from lippmann.device.whitted.scene import build_classic
    from lippmann.scene.values.whitted_surfaces import ClassicLight, ClassicMaterial
    from lippmann.scene.whitted.builder import ClassicSceneBuilder

    turned = np.array([1.0, 1.0, -1.0 if handedness == "left" else 1.0])
    builder = ClassicSceneBuilder("known", handedness=handedness)
    paint = builder.material(ClassicMaterial(color=(0.5, 0.25, 0.125)))
    wood = builder.material(ClassicMaterial(color=(0.2, 0.4, 0.8)))
    builder.spheres((BALL * turned)[None], [RADIUS], paint)
    corners = np.array([[-30.0, -30.0, -8.0], [30.0, -30.0, -8.0], [0.0, 0.0, -8.0]]) * turned
    builder.triangles(corners[None], wood)
    builder.light(ClassicLight("point", center=tuple(np.array([-6.0, 4.0, 0.0]) * turned), radius=2.0))
    built = build_classic(builder.build())

    from lippmann.rendering.transport.ray_source import DisplayRays

    layers = traced(built, DisplayRays(DISPLAY, np.eye(4)), np.eye(4))
    o, d = middle_rays()
    ball = on_ball(o, d)
    lamp = on_ball(o, d, np.array([-6.0, 4.0, 0.0]), 2.0)
    sees_lamp = np.isfinite(lamp) & ~(ball < lamp)
    sees_ball = np.isfinite(ball) & ~sees_lamp
    point = o + np.where(sees_lamp, lamp, ball)[..., None] * d
    assert min(sees_ball.sum(), sees_lamp.sum()) > 50
    for mask, center, radius in ((sees_ball, BALL, RADIUS), (sees_lamp, np.array([-6.0, 4.0, 0.0]), 2.0)):
        np.testing.assert_allclose(layers["position"][mask], point[mask], rtol=0, atol=5e-5)
        np.testing.assert_allclose(layers["normal"][mask], (point[mask] - center) / radius, rtol=0, atol=1e-4)
    assert np.abs(layers["albedo"][sees_ball] - [0.5, 0.25, 0.125]).max() < 1e-6
    assert not layers["albedo"][sees_lamp].any()
    rest = layers["shape"][~sees_ball & ~sees_lamp]
    assert set(np.unique(rest)) == {-1.0, float(wood)}
    assert {float(layers["shape"][mask].min()) for mask in (sees_ball, sees_lamp)} == {2.0, 3.0}
    on_triangle = layers["shape"] == wood
    np.testing.assert_allclose(layers["depth"][on_triangle], -8.0, rtol=0, atol=1e-5)
    assert np.abs(layers["normal"][on_triangle] - [0.0, 0, 1]).max() < 1e-6

    from lippmann.rendering.film.feature_buffers import plan_guides, trace_guides

    source = DisplayRays(DISPLAY, np.eye(4))
    guides = trace_guides(built, source, plan_guides(source, 1, 2**30), np.eye(4), box_filter=False)
    np.testing.assert_allclose(guides.albedo, layers["albedo"], rtol=0, atol=1e-6)  # the background is black
    np.testing.assert_allclose(guides.normal, layers["normal"], rtol=0, atol=1e-5)
