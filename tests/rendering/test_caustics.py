"""Pictures with caustics by photons, as they are asked for."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import lippmann
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import MemoryLimitError, UsageError
from lippmann.options.placement import PlacementOptions
from lippmann.scene.values.description import Image, Instance, Light, Material, Mesh, SceneDescription, Texture

pytestmark = pytest.mark.usefixtures("engine")

DISPLAYS = {
    layout: Display("test", Panel(96, 64, 1.0), LensArray(layout, 8.0), 30.0, "", 500.0, 80.0)
    for layout in ("lenticular", "square", "hexagonal")
}


#: Holds the picture, but not the photons of MANY samples.
SMALL, MANY = 4 << 20, 32


def place(x, y, z):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def emitter_over_glass(*, instances=1, is_exposed=False):
    """A matt wall behind a glass ball and a glossy block, lit by an emitter that has no size."""
    shapes = [trimesh.creation.box((300, 200, 2)), trimesh.creation.icosphere(4, 18), trimesh.creation.box((20, 20, 4))]
    meshes = [Mesh("", m.vertices.astype(np.float32), m.faces.astype(np.uint32), n) for n, m in enumerate(shapes)]
    materials = [
        Material("wall", base_color=(0.6, 0.6, 0.6), roughness=1.0, specular=0.0),
        Material("glass", transmission=1.0, roughness=0.0, ior=1.5, thickness=1.0),
        Material("gloss", base_color=(0.1, 0.1, 0.4), roughness=0.1),
    ]
    found = [Instance(0, place(0, 0, -20)), Instance(1, place(-15, 0, 4)), Instance(2, place(30, 0, -10))]
    found += [Instance(1, place(20 * number, 25, 4)) for number in range(instances - 1)]
    emitter = Light("point", (4e4, 4e4, 4e4), place(60.0, 40.0, 90.0))
    return lippmann.load_scene(
        SceneDescription(
            "emitter", meshes=meshes, materials=materials, instances=found, lights=[emitter], physical_lights=is_exposed
        )
    )


def rendered(scene, layout="lenticular", **options):
    chosen = {"integrator": "path", "method": "full", "spp": 8, "placement": PlacementOptions(place="display")}
    return lippmann.render(scene, DISPLAYS[layout], **({"exposure": 0, "tone_map": "none"} | chosen | options))


@pytest.mark.long
@pytest.mark.parametrize("layout", ["lenticular", "hexagonal", pytest.param("square", marks=pytest.mark.long)])
def test_photons_bring_what_paths_do_not_find(layout):
    """Every lens that sees the focus sees it by photons alone; nothing else differs."""
    scene = emitter_over_glass()
    pictures = {way: rendered(scene, layout, caustics=way) for way in ("paths", "photons", "none")}
    pixels = {way: picture.pixels for way, picture in pictures.items()}
    # The block's gloss has a little width, by which a path may meet an emitter without size.
    assert (np.abs(pixels["paths"] - pixels["none"]).max(axis=2) > 1e-5).mean() < 2e-3
    gained = pixels["photons"] - pixels["none"]
    assert gained.min() > -1e-5
    assert gained.max() > 0.1
    assert (gained.max(axis=2) > 0.02).mean() > 0.01
    assert (gained.max(axis=2) < 1e-4).mean() > 0.3
    assert pictures["photons"].provenance.options["caustics"] == "photons"
    assert pictures["none"].provenance.options["caustics"] == "none"
    assert pictures["paths"].provenance.options["caustics"] == "paths"
    assert pictures["paths"].provenance.estimate is None
    assert any("photons bring it" in note for note in pictures["paths"].provenance.notes)
    assert not any("photons bring it" in note for note in pictures["photons"].provenance.notes)


@pytest.mark.slow
def test_photons_are_the_default_where_there_are_caustics():
    scene = emitter_over_glass()
    chosen, photons = rendered(scene), rendered(scene, caustics="photons")
    assert chosen.pixels.tobytes() == photons.pixels.tobytes()
    assert chosen.provenance.options["caustics"] == "photons"
    assert rendered(scene, memory=SMALL, spp=MANY).provenance.options["caustics"] == "paths"
    for options in ({"depth": 1}, {"integrator": "direct"}):  # none, and nothing is missed
        assert "caustics" not in rendered(scene, **options).provenance.options


def test_photons_do_not_depend_on_who_chooses_the_exposure():
    scene = emitter_over_glass(is_exposed=True)
    chosen = rendered(scene, exposure="auto")
    stated = rendered(scene, exposure=chosen.provenance.options["exposure"])
    assert chosen.pixels.tobytes() == stated.pixels.tobytes()
    assert [each.provenance.options.get("caustics") for each in (chosen, stated)] == ["photons", "photons"]


@pytest.mark.slow
def test_halves_have_photons_of_their_own():
    """The photons' noise is in the estimate: pictures of other seeds differ by what it says."""
    scene = emitter_over_glass()
    found = [rendered(scene, caustics="photons", spp=16, seed=seed) for seed in range(3)]
    told = np.mean([picture.provenance.estimate["psnr"] for picture in found])
    from lippmann.color.transfer import encode_srgb

    codes = np.stack([encode_srgb(picture.pixels) for picture in found]).astype(np.float64)
    scatter = -10 * np.log10(codes.var(axis=0, ddof=1).mean())
    assert told == pytest.approx(scatter, abs=1.5)


@pytest.mark.slow
def test_pooled_light_has_them_too():
    scene = emitter_over_glass()
    plain, pooled = (rendered(scene, caustics="photons", method=method, spp=8).pixels for method in ("full", "pooled"))
    assert pooled.mean() == pytest.approx(plain.mean(), rel=0.02)


@pytest.mark.slow
def test_a_scene_without_emitters_is_the_same_with_photons():
    shape = trimesh.creation.icosphere(3, 20)
    mesh = Mesh("", shape.vertices.astype(np.float32), shape.faces.astype(np.uint32), 0)
    mirror = Material("mirror", metallic=1.0, roughness=0.0)
    ball = [Instance(0, np.eye(4))]
    scene = lippmann.load_scene(SceneDescription("ball", meshes=[mesh], materials=[mirror], instances=ball))
    plain, photons = (rendered(scene, caustics=way, spp=2) for way in ("paths", "photons"))
    assert np.array_equal(plain.pixels, photons.pixels)
    assert not any("photons bring it" in note for note in plain.provenance.notes)


@pytest.mark.parametrize("integrator", ["direct", "classic", "depth"])
def test_other_light_has_no_caustics(integrator):
    scene = "primitives" if integrator == "classic" else emitter_over_glass()
    with pytest.raises(UsageError, match="has no caustics"):
        rendered(scene, integrator=integrator, caustics="photons")


@pytest.mark.slow
def test_too_little_memory_is_refused():
    with pytest.raises(MemoryLimitError, match="photons of caustics"):
        rendered(emitter_over_glass(), caustics="photons", memory=SMALL, spp=MANY)


def bumps():
    texels = np.random.default_rng(1).normal(128, 40, (16, 16, 3)).clip(38, 218)
    texels[..., 2] = 230
    return Texture(Image("bumps", texels.astype(np.uint8)), srgb=False)


RECEIVERS = {
    "rough metal": Material("floor", base_color=(0.8, 0.6, 0.3), metallic=1.0, roughness=0.5),
    "clear coat": Material("floor", base_color=(0.5, 0.3, 0.3), roughness=0.6, clearcoat=1.0, clearcoat_roughness=0.02),
    "cloth": Material("floor", base_color=(0.4, 0.2, 0.5), roughness=1.0, sheen_color=(0.6, 0.6, 0.6)),
    "normal map": Material("floor", base_color=(0.6, 0.6, 0.6), roughness=1.0, normal_texture=bumps()),
}


def glass_under_a_wide_emitter():
    """Caustics that paths find, too: a ball before a wall of four parts, one of each receiver.

    One scene, so that its kernels are compiled once.
    """
    part, ball, panel = (
        trimesh.creation.box((60, 60, 2)),
        trimesh.creation.icosphere(4, 12),
        trimesh.creation.box((80, 60, 1)),
    )
    meshes = [
        Mesh(
            "",
            m.vertices.astype(np.float32),
            m.faces.astype(np.uint32),
            n,
            uvs=((m.vertices[:, :2] / 40).astype(np.float32),),
        )
        for n, m in enumerate((part, part, part, part, ball, panel))
    ]
    glass = Material("glass", transmission=1.0, roughness=0.0, ior=1.5, thickness=1.0)
    glow = Material("glow", base_color=(0.0, 0.0, 0.0), emission=(12.0, 11.0, 9.0))
    corners = [(x, y) for y in (30, -30) for x in (-30, 30)]
    walls = [Instance(number, place(*corner, -20)) for number, corner in enumerate(corners)]
    balls = [Instance(4, place(x * 0.7, y * 0.5, 4)) for x, y in corners]
    return lippmann.load_scene(
        SceneDescription(
            "receivers",
            meshes=meshes,
            materials=[*RECEIVERS.values(), glass, glow],
            instances=[*walls, *balls, Instance(5, place(0, 0, 120))],
        )
    )


@pytest.mark.long
def test_every_receiver_has_the_light_of_paths():
    """Blocks of pixels, by the scatter of independent pictures."""
    scene = glass_under_a_wide_emitter()
    found = {
        way: np.stack([rendered(scene, "square", caustics=way, spp=64, seed=seed).pixels for seed in range(4)])
        for way in ("paths", "photons")
    }
    parts = {way: p.reshape(4, 8, 8, 12, 8, 3).mean(axis=(2, 4)) for way, p in found.items()}
    mean = {way: values.mean(axis=0) for way, values in parts.items()}
    error = np.sqrt(sum(parts[way].var(axis=0, ddof=1) / 4 for way in ("paths", "photons")))
    np.testing.assert_array_less(np.abs(mean["photons"] - mean["paths"]), 5 * error + 0.02 * mean["paths"] + 1e-4)
    without = rendered(scene, "square", caustics="none", spp=64).pixels.reshape(8, 8, 12, 8, 3).mean(axis=(1, 3))
    quarters = {"rough metal": (0, 0), "clear coat": (0, 6), "cloth": (4, 0), "normal map": (4, 6)}
    assert list(quarters) == list(RECEIVERS)
    for name, (row, column) in quarters.items():
        own = np.s_[row : row + 4, column : column + 6]
        by_seed = {way: values[(slice(None), *own)].mean(axis=(1, 2, 3)) for way, values in parts.items()}
        error = np.sqrt(sum(values.var(ddof=1) / 4 for values in by_seed.values()))
        paths, photons = by_seed["paths"].mean(), by_seed["photons"].mean()
        assert abs(photons - paths) < 4 * error + 0.01 * paths, name
        assert photons > without[own].mean() * 1.01, name  # and there are some


@pytest.mark.long
def test_what_a_frosted_sheet_lets_through_is_left_to_paths():
    """Photons are gathered on the side that is seen: a caustic on the other side of a sheet is not theirs."""
    corners = [(-80, -60, 0), (80, -60, 0), (80, 60, 0), (-80, 60, 0)]
    sheet, ball, panel = (
        trimesh.Trimesh(corners, [(0, 1, 2), (0, 2, 3)], process=False),
        trimesh.creation.icosphere(4, 14),
        trimesh.creation.box((120, 90, 1)),
    )
    meshes = [
        Mesh("", m.vertices.astype(np.float32), m.faces.astype(np.uint32), n)
        for n, m in enumerate((sheet, ball, panel))
    ]
    materials = [
        Material("frosted", base_color=(0.9, 0.8, 0.6), transmission=0.5, roughness=0.6, double_sided=True),
        Material("glass", transmission=1.0, roughness=0.0, ior=1.5, thickness=1.0),
        Material("glow", base_color=(0.0, 0.0, 0.0), emission=(12.0, 11.0, 9.0)),
    ]
    instances = [Instance(0, place(0, 0, -4)), Instance(2, place(0, 0, -140))]
    instances += [Instance(1, place(x, y, -24)) for x in (-28, 0, 28) for y in (-16, 16)]
    scene = lippmann.load_scene(SceneDescription("sheet", meshes=meshes, materials=materials, instances=instances))
    found = {
        way: np.stack([rendered(scene, "square", caustics=way, spp=64, seed=seed).pixels for seed in range(3)])
        for way in ("paths", "photons")
    }
    means = {way: pictures.mean() for way, pictures in found.items()}
    assert means["photons"] == pytest.approx(means["paths"], rel=0.002)
    paths, photons = (pictures.mean(axis=0).reshape(8, 8, 12, 8, 3).mean(axis=(1, 3)) for pictures in found.values())
    assert photons == pytest.approx(paths, rel=0.03)
