"""Nine scenes that the readers' own examples do not cover, held against Tachyon: off edges to 69 dB each."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

pytestmark = [
    pytest.mark.usefixtures("engine"),
    pytest.mark.skipif(shutil.which("tachyon") is None, reason="the program tachyon is not installed"),
]

#: Least agreement off edges in dB: of 16-bit output, with what single precision leaves.
AGREEMENT = 69.0


def camera(center="0 1 -8", view="0 -0.1 1", *, depth=4, zoom=1.2, extra="", up="0 1 0", samples=0):
    return (
        f"BEGIN_SCENE RESOLUTION 64 64\nCAMERA {extra} ZOOM {zoom} ASPECTRATIO 1 ANTIALIASING {samples} "
        f"RAYDEPTH {depth} CENTER {center} VIEWDIR {view} UPDIR {up} END_CAMERA\nBACKGROUND 0.1 0.2 0.4\n"
    )


def finish(color="1 1 1", *, ambient=0.1, diffuse=0.8, mirror=0.0, opacity=1.0, phong="", texture="TEXFUNC 0"):
    light = f"AMBIENT {ambient} DIFFUSE {diffuse} SPECULAR {mirror} OPACITY {opacity} {phong}"
    return f"TEXTURE {light} COLOR {color} {texture}"


LAMPS = "LIGHT CENTER -5 7 -6 RAD 0.1 COLOR 0.9 0.9 0.8\nLIGHT CENTER 6 5 -4 RAD 0.1 COLOR 0.3 0.3 0.5\n"
FLOOR = f"PLANE CENTER 0 -1 0 NORMAL 0 1 0 {finish('0.7 0.7 0.6', mirror=0.2)}\n"
MIRROR = {"ambient": 0.05, "diffuse": 0.1, "mirror": 0.85}


def _mirrors_eight_deep():
    """Balls between two mirrors that face each other: most of the picture has been reflected several times."""
    walls = "".join(
        f"PLANE CENTER {x} 0 0 NORMAL {-x / abs(x):g} 0.02 0 {finish('0.9 0.95 1', **MIRROR)}\n" for x in (-2.5, 2.5)
    )
    balls = "".join(
        f"SPHERE CENTER {x} {y} {z} RAD 0.7 {finish('1 0.6 0.5', **(MIRROR if z else {}))}\n"
        for x, y, z in ((-1.2, 0, 0), (1.1, 0.3, 1), (0, -0.4, -1.5))
    )
    lamp = "LIGHT CENTER 0.5 4 -5 RAD 0.1 COLOR 1 1 1\n"
    return camera(depth=8, view="0.2 -0.1 1") + lamp + FLOOR + walls + balls


def _sphereflake():
    """Mirrored balls that touch each other, eight deep."""
    balls, shell = [], [((0.0, 0.6, 0.0), 1.0)]
    for _ in range(3):
        balls += shell
        shell = [
            (tuple(c + 1.5 * r * a for c, a in zip(center, axis, strict=True)), r / 2)
            for center, r in shell
            for axis in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -1))
        ]
    text = "".join(
        f"SPHERE CENTER {x:g} {y:g} {z:g} RAD {r:g} {finish('0.8 0.9 1', ambient=0.1, diffuse=0.4, mirror=0.5)}\n"
        for (x, y, z), r in balls
    )
    return camera(depth=8, center="1 2 -7", view="-0.1 -0.2 1") + LAMPS + FLOOR + text


def _clipped_spheres():
    groups = "".join(
        f"START_CLIPGROUP NUMPLANES 2 {normal} 0.3 0 1 0 0.5\n"
        f"SPHERE CENTER {x} 0 0 RAD 1 {finish(color, phong='PHONG PLASTIC 0.5 PHONG_SIZE 20')}\nEND_CLIPGROUP\n"
        for x, normal, color in (
            (-2.2, "0 0 -1", "1 0.5 0.3"),
            (0, "0.6 0 -0.8", "0.4 1 0.5"),
            (2.2, "1 0 0", "0.5 0.6 1"),
        )
    )
    inner = f"SPHERE CENTER 0 0 0 RAD 0.5 {finish('1 1 0.2', mirror=0.3, diffuse=0.5)}\n"
    return camera(center="0 2 -8", view="0 -0.2 1") + LAMPS + FLOOR + groups + inner


def _fog(kind, density):
    balls = "".join(
        f"SPHERE CENTER {x} 0 {z} RAD 0.9 {finish(color, mirror=0.3, diffuse=0.5)}\n"
        for x, z, color in ((-2, 0, "1 0.4 0.3"), (0, 5, "0.4 1 0.5"), (3, 11, "0.5 0.6 1"))
    )
    fog = f"FOG {kind} START 4 END 25 DENSITY {density} COLOR 0.6 0.6 0.7\n"
    return camera() + LAMPS + fog + FLOOR + balls


def _depth_of_field():
    """The aperture is sampled at random: evenly coloured areas must agree, the rest counts as edges."""
    flat = {"ambient": 1.0, "diffuse": 0.0}
    walls = "".join(
        f"BOX MIN {x} -3 {z} MAX {x + 2.4} 3 {z + 0.5} {finish(color, **flat)}\n"
        for x, z, color in ((-4, 0, "0.8 0.3 0.2"), (-0.9, 2, "0.3 0.7 0.3"), (2.4, 5, "0.2 0.3 0.8"))
    )
    return camera(extra="PROJECTION PERSPECTIVE_DOF FOCALLENGTH 1 APERTURE 0.2", samples=7) + LAMPS + walls


def _sky_ball():
    """A ball of radius 2 000 000 around the scene, whose picture is repeated five times around."""
    sky = finish(ambient=1, diffuse=0, texture="TEXFUNC 8 sky.ppm CENTER 0 0 0 ROTATE 0 0 0 SCALE 5 3 1")
    ball = f"SPHERE CENTER 0 0.2 0 RAD 1.2 {finish('1 1 1', **MIRROR)}\n"
    return camera(view="-1 0.02 0.02", center="9 0.4 0.1") + LAMPS + f"SPHERE CENTER 0 0 0 RAD 2000000 {sky}\n" + ball


def _planet():
    """The ground is a ball of radius 2 000 000, seen from 20 above it."""
    ground = finish(
        "0.6 0.8 0.5", texture="TEXFUNC 9 sky.ppm CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1 UAXIS 0.004 0 0 VAXIS 0 0 0.004"
    )
    ball = f"SPHERE CENTER 0 8 40 RAD 8 {finish('1 1 1', mirror=0.5, diffuse=0.4)}\n"
    lamp = "LIGHT CENTER 100 900 -50 RAD 0.1 COLOR 1 1 1\n"
    planet = f"SPHERE CENTER 0 -2000000 0 RAD 2000000 {ground}\n"
    return camera(center="0 20 -30", view="0 -0.3 1") + lamp + planet + ball


def _glass_and_rods():
    brass = finish("0.9 0.7 0.3", mirror=0.4, diffuse=0.5)
    rods = "".join(
        f"FCYLINDER BASE {x} -1 {z} APEX {x + 0.3:g} 2.5 {z} RAD 0.06 {brass}\n"
        for x in (-2, -1, 0, 1, 2)
        for z in (-1, 1, 3)
    )
    ball = f"SPHERE CENTER 0 0.6 -2.5 RAD 1.1 {finish('0.7 0.9 1', opacity=0.3, mirror=0.3, diffuse=0.4)}\n"
    return camera(depth=6) + LAMPS + FLOOR + rods + ball


SCENES = {
    "mirrors eight deep": _mirrors_eight_deep,
    "balls on balls": _sphereflake,
    "clipped spheres": _clipped_spheres,
    "linear fog": lambda: _fog("LINEAR", 1),
    "dense fog": lambda: _fog("EXP", 0.12),
    "depth of field": _depth_of_field,
    "sky ball": _sky_ball,
    "planet": _planet,
    "glass and rods": _glass_and_rods,
}


def _write_sky(path):
    y, x = np.mgrid[:256, :512]
    waves = [
        np.sin(x / 512 * 2 * np.pi),
        np.sin(y / 256 * np.pi),
        np.sin(x / 512 * 2 * np.pi) * np.cos(y / 256 * np.pi),
    ]
    texels = (127.5 + 110 * np.stack(waves, -1)).astype(np.uint8)
    path.write_bytes(b"P6\n512 256\n255\n" + texels.tobytes())


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_scenes_agree_off_edges(tachyon, tmp_path, name):
    _write_sky(tmp_path / "sky.ppm")
    (tmp_path / "scene.dat").write_text(SCENES[name]() + "END_SCENE\n")
    reference = tachyon.picture(tmp_path, "scene.dat", tmp_path / "t.ppm")
    mine = tachyon.ours(tmp_path / "scene.dat", spp=None if name == "depth of field" else 1)
    smooth = tachyon.off_edges(mine, reference)
    assert smooth.mean() > 0.2
    assert tachyon.psnr(mine, reference, smooth) >= AGREEMENT
