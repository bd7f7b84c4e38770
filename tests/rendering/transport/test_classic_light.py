"""The classic light models against what can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.scene.values.whitted_surfaces import (
    AmbientOcclusion,
    Background,
    ClassicLight,
    ClassicMaterial,
    Fog,
    Shading,
)
from lippmann.scene.whitted.builder import ClassicSceneBuilder

pytestmark = pytest.mark.usefixtures("engine")

SKY = Background(color=(0.25, 0.5, 1.0))
MATT = ClassicMaterial(color=(0.5, 0.6, 0.7), ambient=0.2, diffuse=0.8)


class Lab:
    """A right-handed scene in which single rays are looked along."""

    def __init__(self, rules="tachyon", handedness="right"):
        self.builder = ClassicSceneBuilder("lab", rules=rules, handedness=handedness)

    def plane(self, z, material, normal=(0, 0, 1)):
        self.builder.planes((0, 0, z), normal, self.builder.material(material))

    def lamp(self, center, color=(1.0, 1.0, 1.0), **rest):
        self.builder.light(ClassicLight(rest.pop("kind", "point"), center=center, color=color, **rest))

    def look(self, origin, direction, depth=5, **rest):
        """Colours ``(n, 3)`` and what else the integrator says, for rays given as rows."""
        import drjit as dr
        import mitsuba as mi

        from lippmann.device.sobol import SampleStream
        from lippmann.device.whitted.scene import build_classic
        from lippmann.rendering.transport.whitted import WhittedIntegrator

        rest.setdefault("background", SKY)
        integrator = WhittedIntegrator(build_classic(self.builder.build(**rest)), depth)
        o, d = np.atleast_2d(np.array(origin, float)), np.atleast_2d(np.array(direction, float))
        o, d = np.broadcast_arrays(o, d / np.linalg.norm(d, axis=1, keepdims=True))
        ray = mi.Ray3f(mi.Point3f(o.T.astype(np.float32)), mi.Vector3f(d.T.astype(np.float32)))
        stream = SampleStream.of_pixels(dr.arange(mi.UInt32, len(o)), mi.UInt32(0), mi.UInt32(0))
        color, counts, first = integrator.sample_with_hit(ray, stream, mi.Bool(True))
        # By one kernel, not one for each.
        dr.eval(color, counts.shadow, counts.secondary, first.distance, first.view_dependent)
        return Seen(
            np.array(color).T,
            np.array(counts.shadow),
            np.array(counts.secondary),
            np.array(first.distance),
            np.array(first.view_dependent),
        )


class Seen:
    def __init__(self, color, shadow, secondary, distance, view_dependent):
        self.color, self.shadow, self.secondary = color, shadow, secondary
        self.distance, self.view_dependent = distance, view_dependent


def close(actual, expected, tolerance=1e-5):
    np.testing.assert_allclose(actual, np.broadcast_to(expected, np.shape(actual)), atol=tolerance)


DOWN = (0, 0, -1)
C = np.array(MATT.color)


def test_ambient_and_diffuse_light():
    lab = Lab()
    lab.plane(0, MATT)
    lab.lamp((3, 0, 4), (0.5, 1.0, 0.25))  # the cosine is 4/5
    seen = lab.look((0, 0, 2), DOWN)
    close(seen.color[0], C * (0.2 + 0.8 * 0.8 * np.array([0.5, 1.0, 0.25])))
    assert (seen.shadow[0], seen.secondary[0]) == (1, 0)
    assert seen.distance[0] == pytest.approx(2)
    assert not seen.view_dependent[0]


def test_a_lamp_behind_the_surface_gives_nothing_and_costs_no_ray():
    lab = Lab()
    lab.plane(0, MATT)
    lab.lamp((0, 0, -4))
    seen = lab.look((0, 0, 2), DOWN)
    close(seen.color[0], 0.2 * C)
    assert seen.shadow[0] == 0


def test_attenuation_spot_and_direction():
    lab = Lab()
    lab.plane(0, ClassicMaterial(color=(1, 1, 1), ambient=0, diffuse=1))
    lab.lamp((0, 0, 4), attenuation=(1.0, 0.5, 0.0625))  # 1 / (1 + 2 + 1)
    close(lab.look((0, 0, 2), DOWN).color[0], 0.25)
    lab = Lab()
    lab.plane(0, ClassicMaterial(color=(1, 1, 1), ambient=0, diffuse=1))
    lab.lamp((0, 0, 1), kind="spot", direction=(0.0, 0.0, -1.0), falloff_start=0.0, falloff_end=90.0)
    # At x = 1 the angle off the axis is 45 degrees: half of the spot, and a cosine of sqrt(1/2).
    close(lab.look((1, 0, 2), DOWN).color[0], 0.5 * np.sqrt(0.5))
    lab = Lab()
    lab.plane(0, ClassicMaterial(color=(1, 1, 1), ambient=0, diffuse=1))
    lab.lamp((0, 0, 0), kind="directional", direction=(0.6, 0.0, -0.8), color=(0.5, 0.5, 0.5))
    close(lab.look((5, 5, 2), DOWN).color[0], 0.4)


@pytest.mark.parametrize("highlight", ["blinn", "phong"])
@pytest.mark.parametrize("kind", ["plastic", "metal"])
def test_highlights(highlight, kind):
    lab = Lab()
    shiny = ClassicMaterial(color=(0.5, 0.6, 0.7), ambient=0, diffuse=0, phong=0.7, phong_size=12.0, phong_kind=kind)
    lab.plane(0, shiny)
    lamp = np.array([0.2, 0.8, 0.4])
    lab.lamp((3, 0, 4), tuple(lamp))
    seen = lab.look((0, 0, 2), DOWN, shading=Shading(highlight=highlight))
    half = np.array([0.6, 0, 1.8]) / np.linalg.norm([0.6, 0, 1.8])
    cosine = half[2] if highlight == "blinn" else 0.8
    close(seen.color[0], (lamp if kind == "plastic" else C) * 0.7 * cosine**12)
    assert seen.view_dependent[0]


def test_mirrors_are_untinted_and_end_at_the_ray_depth():
    mirror = ClassicMaterial(color=(1, 0, 0), ambient=0, diffuse=0, specular=0.5)
    lab = Lab()
    lab.plane(0, mirror)
    lab.plane(10, MATT)
    rows = [lab.look((0, 0, 2), DOWN, depth) for depth in (1, 2)]
    close(rows[0].color[0], SKY.color)  # the background as it is, not halved
    close(rows[1].color[0], 0.5 * 0.2 * C)
    assert rows[1].secondary[0] == 1
    assert rows[1].view_dependent[0]


def test_nff_adds_nothing_beyond_the_ray_depth():
    lab = Lab("nff")
    lab.plane(0, ClassicMaterial(ambient=0, diffuse=0, specular=0.5))
    close(lab.look((0, 0, 2), DOWN, depth=1).color[0], 0)
    close(lab.look((0, 0, 2), DOWN, depth=2).color[0], 0.5 * np.array(SKY.color))


def test_two_mirrors_face_to_face_take_all_the_depth():
    lab = Lab()
    mirror = ClassicMaterial(color=(1, 1, 1), ambient=0.125, diffuse=0, specular=0.5)
    lab.plane(0, mirror)
    lab.plane(10, mirror)
    seen = lab.look((0, 0, 2), DOWN, depth=6)
    close(seen.color[0], 0.125 * (2 - 2.0**-5) + np.array(SKY.color) * 2.0**-5)
    assert seen.secondary[0] == 5


def test_what_lets_light_through_adds_to_what_lies_behind():
    lab = Lab()
    lab.plane(0, ClassicMaterial(color=(1, 1, 1), ambient=0.3, diffuse=0, opacity=0.75))
    lab.plane(-1, MATT)
    close(lab.look((0, 0, 2), DOWN).color[0], 0.3 + 0.25 * 0.2 * C)
    faded = Shading(local_times_opacity=True)
    close(lab.look((0, 0, 2), DOWN, shading=faded).color[0], 0.3 * 0.75 + 0.25 * 0.2 * C)


@pytest.mark.long
def test_both_ways_at_once():
    """A surface that mirrors and lets through, before a wall and under a ceiling, seen twice."""
    pane = ClassicMaterial(color=(1, 1, 1), ambient=0.1, diffuse=0, specular=0.5, opacity=0.75)
    lab = Lab()
    lab.plane(0, pane)
    lab.plane(-1, pane)
    lab.plane(-2, MATT)
    lab.plane(9, ClassicMaterial(color=(1, 1, 1), ambient=1, diffuse=0))
    # From the lower pane: mirrored up (through the upper one: the ceiling; mirrored by it: down again) and through.
    ceiling, wall = 1.0, 0.2 * C

    def expected(down, depth):
        # Light along a ray that runs down onto pane `down` (0: upper, 1: lower, 2: wall).
        if down == 2:
            return wall
        if depth == 1:
            return 0.1 + 2 * np.array(SKY.color)
        up = ceiling if down == 0 else upward(depth - 1)
        return 0.1 + 0.5 * up + 0.25 * expected(down + 1, depth - 1)

    def upward(depth):
        if depth == 1:
            return 0.1 + 2 * np.array(SKY.color)
        return 0.1 + 0.5 * expected(1, depth - 1) + 0.25 * ceiling

    for depth in range(1, 8):
        close(lab.look((0, 0, 2), DOWN, depth).color[0], expected(0, depth), 1e-4)


@pytest.mark.slow
def test_shadows_are_filtered_once_per_crossing():
    lab = Lab()
    lab.plane(0, ClassicMaterial(color=(1, 1, 1), ambient=0, diffuse=1))
    glass = lab.builder.material(ClassicMaterial(opacity=0.25))
    lab.builder.spheres((0, 0, 5), 1, glass)  # the way to the lamp enters and leaves it
    square = [(-1, -1, 3), (1, -1, 3), (1, 1, 3), (-1, 1, 3)]
    lab.builder.mesh(square, [(0, 1, 2), (0, 2, 3)], glass)
    lab.lamp((0.25, 0.125, 8))
    seen = lab.look((0.25, 0.125, 2), DOWN)
    close(seen.color[0], 0.75**3)
    close(lab.look((0.25, 0.125, 2), DOWN, shading=Shading(shadow_filter=False)).color[0], 1)
    lab.builder.spheres((0, 0, 7), 0.5, lab.builder.material(MATT))
    close(lab.look((0.25, 0.125, 2), DOWN).color[0], 0)


def test_lamps_are_seen_and_cast_no_shadow():
    lab = Lab()
    lab.plane(0, ClassicMaterial(color=(1, 1, 1), ambient=0, diffuse=1))
    lab.lamp((0, 0, 5), (0.5, 0.25, 0.125), radius=1.0)
    lab.lamp((0, 0, 10), (0.25, 0.5, 0.25))
    seen = lab.look([(0, 0, 2), (0, 0, 2)], [DOWN, (0, 0, 1)])
    close(seen.color[0], (0.75, 0.75, 0.375))
    close(seen.color[1], (0.5, 0.25, 0.125))
    assert seen.distance[1] == pytest.approx(2)


def test_the_background_is_infinitely_far():
    lab = Lab()
    lab.plane(0, MATT)
    seen = lab.look((0, 0, 2), (0, 0, 1))
    close(seen.color[0], SKY.color)
    assert np.isinf(seen.distance[0])
    gradient = Background("sky-sphere", up=(0, 1, 0), top_value=1.0, top_color=(1, 0, 0), bottom_color=(0, 0, 1))
    close(lab.look((0, 0, 2), (0, 0.6, 0.8), background=gradient).color[0], (0.6, 0, 0.4))


@pytest.mark.parametrize(
    ("fog", "clear"),
    [
        (Fog("linear", 1.0, 5.0, 1.0, (1, 1, 1)), 0.75),
        (Fog("exp", 1.0, 5.0, 0.5, (1, 1, 1)), np.exp(-0.5)),
        (Fog("exp2", 0.0, 5.0, 0.5, (1, 1, 1)), np.exp(-1.0)),
    ],
)
def test_fog(fog, clear):
    lab = Lab()
    lab.plane(0, MATT)
    seen = lab.look([(0, 0, 2), (0, 0, 2)], [DOWN, (0, 0, 1)], fog=fog)
    close(seen.color[0], clear * 0.2 * C + (1 - clear))
    close(seen.color[1], 1)  # radial fog hides the background altogether


def test_modes():
    lab = Lab()
    lab.plane(0, MATT)
    lab.builder.spheres((0, 0, 5), 1, lab.builder.material(MATT))
    lab.lamp((0, 0, 8))
    modes = {
        mode: lab.look((0, 0, 2), DOWN, shading=Shading(mode=mode)) for mode in ("full", "medium", "low", "lowest")
    }
    close(modes["full"].color[0], 0.2 * C)  # the ball shades it
    close(modes["medium"].color[0], C)
    close(modes["low"].color[0], C)
    close(modes["lowest"].color[0], 1)
    assert modes["medium"].shadow[0] == 0


@pytest.mark.slow
def test_only_so_many_transparent_surfaces_are_shaded():
    lab = Lab()
    for z in (0, -1, -2):
        lab.plane(z, ClassicMaterial(color=(1, 1, 1), ambient=0.25, diffuse=0, opacity=0.5))
    lab.plane(-3, MATT)
    seen = [lab.look((0, 0, 2), DOWN, shading=Shading(max_transparent_surfaces=n)).color[0] for n in (0, 1, 3)]
    close(seen[0], 0.2 * C)
    close(seen[1], 0.25 + 0.5 * 0.2 * C)
    close(seen[2], 0.25 * (1 + 0.5 + 0.25) + 0.125 * 0.2 * C)


def test_open_sky_lights_fully():
    lab = Lab()
    lab.plane(0, ClassicMaterial(color=(1, 1, 1), ambient=0, diffuse=0.5))
    seen = lab.look([(0, 0, 2)] * 64, DOWN, ambient_occlusion=AmbientOcclusion(64, (1.0, 0.5, 0.25)))
    close(seen.color.mean(axis=0), np.array([0.5, 0.25, 0.125]), 0.01)
    assert (seen.shadow == 64).all()


def test_winding_decides_on_which_side_a_smooth_normal_lies():
    lab = Lab()
    white = lab.builder.material(ClassicMaterial(color=(1, 1, 1), ambient=0, diffuse=1))
    corners = [[(-1, -1, 0), (1, -1, 0), (0, 1, 0)]]  # counter-clockwise seen from +z
    lab.builder.triangles(corners, white, normals=[[(0, 0, 1)] * 3])
    lab.builder.triangles(np.add(corners, (5, 0, 0)), white, normals=[[(0, 0, -1)] * 3])
    lab.lamp((0, 0, 100))
    seen = lab.look([(0, 0, 2), (5, 0, 2)], DOWN)
    assert seen.color[0, 0] > 0.99
    close(seen.color[1], 0)  # wound against its normals: shaded as if it were the back


def test_a_left_handed_scene_lies_in_the_world_with_its_z_negated():
    lab = Lab(handedness="left")
    lab.builder.spheres((1, 2, 5), 1, lab.builder.material(MATT))
    seen = lab.look([(1, 2, 0), (1, 2, 0)], [(0, 0, -1), (0, 0, 1)])
    assert seen.distance[0] == pytest.approx(4)
    assert np.isinf(seen.distance[1])


def glass(ior, **rest):
    return ClassicMaterial(ambient=0, diffuse=0, opacity=0.0, ior=ior, **rest)


def slab(lab, material, low, high):
    """A block of glass between two heights, wound outward."""
    x = 50.0
    index = lab.builder.material(material)
    top = [(-x, -x, high), (x, -x, high), (x, x, high), (-x, x, high)]
    bottom = [(-x, -x, low), (x, -x, low), (x, x, low), (-x, x, low)]
    lab.builder.mesh(top, [(0, 1, 2), (0, 2, 3)], index)
    lab.builder.mesh(bottom, [(0, 2, 1), (0, 3, 2)], index)


@pytest.mark.slow
def test_nff_refracts_by_snells_law():
    """Seen through a block of glass a line on the wall is shifted by t (tan a - tan b), sin b = sin a / n."""
    ior, thick, angle = 1.5, 2.0, np.radians(50)
    inside = np.arcsin(np.sin(angle) / ior)
    # The wall lies at z = -3; a ray from (0, 0, 1) down meets it here, by 1 + 1 of air and 2 of glass.
    meets = 2 * np.tan(angle) + thick * np.tan(inside)
    for edge, color in ((meets + 0.02, 0.25), (meets - 0.02, 0.75)):
        lab = Lab("nff")
        slab(lab, glass(ior), -2, 0)
        dark = lab.builder.material(ClassicMaterial(color=(1, 1, 1), ambient=0.25, diffuse=0))
        bright = lab.builder.material(ClassicMaterial(color=(1, 1, 1), ambient=0.75, diffuse=0))
        lab.builder.boxes([(-99, -99, -4), (edge, -99, -4)], [(edge, 99, -3), (99, 99, -3)], [dark, bright])
        close(lab.look((0, 0, 1), (np.sin(angle), 0, -np.cos(angle))).color[0], color)


def test_nff_reflects_all_beyond_the_critical_angle():
    lab = Lab("nff")
    slab(lab, glass(1.5), -2, 0)
    lab.plane(-5, MATT)
    light = ClassicMaterial(color=(1, 1, 1), ambient=0.5, diffuse=0)
    lab.builder.boxes((-60, -60, -1.9), (-49, 60, -0.1), lab.builder.material(light))
    # From inside the glass, at 60 degrees to the normal: it goes to and fro and ends on the box at the side.
    seen = lab.look((-45, 0, -1), (-np.sin(np.radians(60)), 0, -np.cos(np.radians(60))), depth=8)
    close(seen.color[0], 0.5)
    assert seen.secondary[0] >= 1


def test_tachyon_never_refracts():
    lab = Lab()
    slab(lab, glass(1.5), -2, 0)
    wall = lab.builder.material(ClassicMaterial(color=(1, 1, 1), ambient=0.25, diffuse=0))
    lab.builder.boxes((4.9, -99, -4), (5.1, 99, -3), wall)
    close(lab.look((0, 0, 1), (5, 0, -4)).color[0], 0.25)


def test_nff_highlight_and_mirror_share_their_factor(tmp_path):
    """A file by hand: one lamp, so that it and the ambient light have sqrt(1) / 2 each."""
    from lippmann import api

    path = tmp_path / "one.nff"
    path.write_text(
        "b 0.2 0.4 0.6\nv\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 10\nhither 1\nresolution 3 3\nl 0 3 4\n"
        "f 0.5 0.25 1 0.6 0.3 4 0 0\np 4 -9 -9 0 9 -9 0 9 9 0 -9 9 0\n"
    )
    middle = api.preview(path, size=(3, 3)).pixels[1, 1]
    # Ambient 1/2 Kd; the lamp's cosine 4/5; the mirrored lamp direction lies at 4/5 from the eye as well.
    local = np.array([0.5, 0.25, 1.0]) * (0.6 * 0.5 + 0.6 * 0.8 * 0.5)
    close(middle, local + 0.3 * 0.5 * 0.8**4 + 0.3 * np.array([0.2, 0.4, 0.6]))
