"""Which pictures come with chains of sharp events."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.options.placement import PlacementOptions

pytestmark = pytest.mark.usefixtures("engine")


@pytest.fixture(scope="module")
def balls(engine):
    import lippmann
    from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription

    trimesh = pytest.importorskip("trimesh")
    ball, wall = trimesh.creation.icosphere(3, 12), trimesh.creation.box((300, 200, 2))
    normals = None, ball.vertex_normals.astype(np.float32)
    meshes = [
        Mesh("", m.vertices.astype(np.float32), m.faces.astype(np.uint32), n, normals[n])
        for n, m in enumerate((wall, ball))
    ]
    materials = [Material("wall", roughness=1.0, specular=0.0), Material("chrome", metallic=1.0, roughness=0.0)]

    def scene(radius):
        at, behind, before = np.eye(4), np.eye(4), np.eye(4)
        at[:3, 3] = 3, 4, 120  # its image lies behind the middle lens
        behind[2, 3], before[2, 3] = -20, 4
        light = Light("point", (4e4,) * 3, at, radius=radius)
        instances = [Instance(0, behind), Instance(1, before)]
        return lippmann.load_scene(SceneDescription("balls", meshes, materials, instances, lights=[light]))

    return scene


DISPLAY = Display("test", Panel(96, 64, 1.0), LensArray("square", 8.0), 30.0, "", 500.0, 80.0)
ASKED = {"integrator": "path", "spp": 16, "placement": PlacementOptions(place="display"), "exposure": 0}


def rendered(scene, **options):
    import lippmann

    return lippmann.render(scene, DISPLAY, tone_map="none", **(ASKED | options))


def prepared_chains(scene, **options):
    """Chains of a picture, which are decided before its first sample."""
    from lippmann.rendering.request.plan import resolve
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.session import open_session

    session = open_session(scene, resolve(RenderRequest(**(ASKED | options)), scene, DISPLAY))
    placement = session.place(DISPLAY)

    from lippmann.rendering.session import read_choices
    from lippmann.rendering.transport.ray_source import DisplayRays

    source = DisplayRays(DISPLAY, placement.world_from_display)
    return read_choices(session.integrator(source, placement.display_from_world)).get("seen_chains", 0)


def test_denoised_pictures_of_sharp_surfaces_have_them(engine):
    import lippmann
    from lippmann.scene.values.description import Environment, Instance, Material, Mesh, SceneDescription

    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(3, 12)
    mesh = Mesh("", ball.vertices.astype(np.float32), ball.faces.astype(np.uint32), 0, ball.vertex_normals.astype("f4"))
    sky = np.zeros((64, 128, 3), np.float32)
    sky[:, np.arange(128) % 16 < 8] = 4.0

    def scene(roughness, brightness=1.0):
        materials = [Material("ball", metallic=1.0, roughness=roughness)]
        environment = Environment(sky * np.float32(brightness))
        described = SceneDescription("ball", [mesh], materials, [Instance(0, np.eye(4))], environment=environment)
        return lippmann.load_scene(described)

    sharp, dim = scene(0.02), scene(0.02, brightness=0.2)
    made = rendered(sharp, spp=1).provenance.options["seen_chains"]
    assert made == prepared_chains(sharp, spp=1) == prepared_chains(sharp) > 0
    assert prepared_chains(sharp, spp=None, quality=12.0) > 0
    assert prepared_chains(scene(0.8)) == 0
    # What is mirrored is brighter than white, or is once it is exposed.
    assert prepared_chains(dim, spp=1) == 0
    assert prepared_chains(dim, spp=1, exposure=1.0) > 0
    # Where all the noise is left in, samples bring more; rays through the centre of a pixel are all the same.
    assert prepared_chains(sharp, denoise="none") == 0
    assert prepared_chains(sharp, pixel_filter="point") == 0
    assert prepared_chains(sharp, method="lens-view", denoise="oidn") == 0


@pytest.mark.long
def test_pictures_with_them_state_their_error_as_before(balls):
    scene = balls(3.0)
    first, second = (rendered(scene, seed=seed, spp=32) for seed in (1, 2))
    apart = np.square(np.clip(first.pixels, 0, 1) - np.clip(second.pixels, 0, 1)).mean() / 2
    told = first.provenance.estimate
    assert told["psnr_low"] - 3 < -10 * np.log10(apart) < told["psnr_high"] + 3
