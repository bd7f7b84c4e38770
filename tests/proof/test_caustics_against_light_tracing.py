"""Caustics by photons against Mitsuba's particle tracer, which shares nothing with them.

It starts from the emitters as photons do, but has neither photons in cells nor look-ups: each particle is connected to
the camera straight from the surface that it meets. A lens of an array without a viewing distance is a pinhole, whose
micro-image is the picture of a perspective camera at its centre.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel

pytestmark = pytest.mark.usefixtures("engine")

PIXELS, GAP, LENSES = 8, 30.0, 3
DISPLAY = Display(
    "pinholes", Panel(LENSES * PIXELS, LENSES * PIXELS, 1.0), LensArray("square", PIXELS), GAP, "", math.inf, 60.0
)
DEPTH = 8
#: Runs of the particle tracer, of which the scatter tells their error, and its samples of a pixel in each.
RUNS, SAMPLES = 6, 4096


def glass_before_a_wall():
    """A wall beyond the lens plane, lit past a glass ball by a spot that has no size.

    No lens sees the ball: what is seen through it cannot be connected to a camera.
    """
    import mitsuba as mi

    transform = mi.ScalarTransform4f
    return {
        "type": "scene",
        "wall": {
            "type": "rectangle",
            "to_world": transform().translate([0, 0, -200]).scale(100),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.5, 0.3]}},
        },
        "ball": {"type": "sphere", "center": [50, 44, -150], "radius": 14, "bsdf": {"type": "dielectric"}},
        "spot": {
            "type": "spot",
            "to_world": transform().look_at(origin=[85, 78, -70], target=[48, 42, -154], up=[0, 1, 0]),
            "intensity": 4e4,
            "cutoff_angle": 25.0,
        },
    }


def micro_images_by_particles(scene, seed):
    """``(lenses, lenses, 3)``: mean radiance of each micro-image."""
    import mitsuba as mi

    integrator = mi.load_dict({"type": "ptracer", "max_depth": DEPTH + 1, "rr_depth": 100})
    means = np.empty((LENSES, LENSES, 3))
    for row in range(LENSES):
        for column in range(LENSES):
            x, y = PIXELS * (column - (LENSES - 1) / 2), PIXELS * ((LENSES - 1) / 2 - row)
            camera = mi.load_dict(
                {
                    "type": "perspective",
                    "fov": math.degrees(2 * math.atan(0.5 * PIXELS / GAP)),
                    "to_world": mi.ScalarTransform4f().look_at(origin=[x, y, 0], target=[x, y, -1], up=[0, 1, 0]),
                    "film": {"type": "hdrfilm", "width": PIXELS, "height": PIXELS, "rfilter": {"type": "box"}},
                    "sampler": {"type": "independent", "sample_count": SAMPLES},
                }
            )
            lens = LENSES * row + column
            picture = mi.render(scene, sensor=camera, integrator=integrator, seed=seed * LENSES**2 + lens)
            means[row, column] = np.array(picture)[..., :3].mean(axis=(0, 1))
    return means


@pytest.mark.long
def test_micro_images_have_the_light_of_particles():
    import mitsuba as mi

    import lippmann
    from lippmann.options.placement import PlacementOptions

    scene = mi.load_dict(glass_before_a_wall())
    particles = np.stack([micro_images_by_particles(scene, seed) for seed in range(RUNS)])
    truth, error = particles.mean(axis=0), particles.std(axis=0, ddof=1) / math.sqrt(RUNS)

    def rendered(caustics):
        picture = lippmann.render(
            lippmann.load_scene(scene, background=(0.0, 0.0, 0.0)),
            DISPLAY,
            integrator="path",
            method="full",
            caustics=caustics,
            depth=DEPTH,
            spp=64,
            exposure=0,
            tone_map="none",
            placement=PlacementOptions(place="display"),
        )
        return picture.micro_images().mean(axis=(2, 3))

    photons, without = rendered("photons"), rendered("none")
    # There is something to compare: the caustic is a tenth to two fifths of the light.
    share = 1 - without.mean(axis=2) / photons.mean(axis=2)
    assert 0.09 < share.min() < 0.2 < 0.35 < share.max()
    # Photons have noise, too, and a look-up blurs some of it into the next micro-image.
    assert (np.abs(photons - truth) < 4 * error + 0.005 * truth).all()
    assert photons.mean() == pytest.approx(truth.mean(), rel=0.003)
