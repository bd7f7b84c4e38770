"""The classic integrator against the program whose light model it is: pictures of real scenes, and of hand-made ones
that show each texture, primitive and mode."""

from __future__ import annotations

import shutil

import pytest

pytestmark = [
    pytest.mark.usefixtures("engine"),
    pytest.mark.skipif(shutil.which("tachyon") is None, reason="the program tachyon is not installed"),
]

SCENES = [
    *("teapot", "room", "smallballs", "tree_fcyl", "gears_s2", "spotlight", "attenuation", "fog", "polycyl"),
    *("transtest", "clipplanes", "fisheye", "lscapes"),
]


def check(tachyon, mine, reference, total, smooth):
    agreement = tachyon.psnr(mine, reference)
    assert agreement >= total
    mask = tachyon.off_edges(mine, reference)
    if mask.any():  # a picture may be all texture
        assert tachyon.psnr(mine, reference, mask) >= smooth
    assert tachyon.psnr(mine[:, ::-1], reference) < agreement  # same orientation
    assert tachyon.psnr(mine[::-1], reference) < agreement


@pytest.mark.parametrize("name", SCENES)
def test_real_scenes(tachyon, shared_scenes, tmp_path, name):
    folder = shared_scenes / "tachyon"
    reference = tachyon.picture(folder, f"{name}.dat", tmp_path / "t.ppm", "-aasamples", "0")
    # Textured ground far away, and what mirrors show of it, turns on the last digit of a float.
    check(tachyon, tachyon.ours(folder / f"{name}.dat"), reference, 32, 40)


def test_antialiasing_of_the_file(tachyon, shared_scenes, tmp_path):
    folder = shared_scenes / "tachyon"
    reference = tachyon.picture(folder, "fog.dat", tmp_path / "t.ppm")  # ANTIALIASING 8
    assert tachyon.psnr(tachyon.ours(folder / "fog.dat", spp=None), reference) > 32


HEAD = """BEGIN_SCENE RESOLUTION 64 64
CAMERA {projection} ZOOM {zoom} ASPECTRATIO 1.1 ANTIALIASING 0 RAYDEPTH {depth}
       CENTER 0.03 1.01 -12 VIEWDIR 0.01 -0.05 1 UPDIR 0.05 1 0 END_CAMERA
"""
LAMPS = """
LIGHT CENTER -6 8 -10 RAD 0.3 COLOR 0.8 0.8 0.7
LIGHT CENTER 3 2.5 -3 RAD 0.25 COLOR 0.3 0.2 0.3
"""
OTHER_LAMPS = """
DIRECTIONAL_LIGHT DIRECTION 1 -1 1 COLOR 0.4 0.4 0.4
SPOTLIGHT CENTER 0 6 -6 RAD 0.2 DIRECTION 0 -1 1 FALLOFF_START 10 FALLOFF_END 35
          ATTENUATION CONSTANT 0.5 LINEAR 0.1 QUADRATIC 0.01 COLOR 1 0.9 0.8
"""
IMAGES = """
IMAGEDEF ::img FORMAT RGB24 RESOLUTION 4 4 1 ENCODING HEX ff0000 00ff00 0000ff ffffff 102030 304050 ff00ff 00ffff
         808080 ffff00 0f0f0f f0f0f0 123456 654321 abcdef fedcba
IMAGEDEF ::vol FORMAT RGB24 RESOLUTION 2 2 2 ENCODING HEX ff0000 00ff00 0000ff ffffff 102030 304050 ff00ff 00ffff
"""
FLOOR = """
PLANE CENTER 0 -2 0 NORMAL 0 1 0 TEXTURE AMBIENT 0.1 DIFFUSE 0.7 SPECULAR 0.2 OPACITY 1 COLOR 1 1 1
      TEXFUNC 1 CENTER 0.1 0.2 0.1 ROTATE 0 0 0 SCALE 1 1 1
"""
PLACE = "ROTATE 0.1 0.2 0 SCALE 2 3 1"
BALLS = f"""
SPHERE CENTER -3 2.5 0 RAD 1 TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 COLOR 1 1 1
       TEXFUNC 4 CENTER -3 2.5 0 ROTATE 0 0 0 SCALE 0.02 0.02 0.02
SPHERE CENTER -1 2.5 0 RAD 1 TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 COLOR 1 0.7 1
       TEXFUNC 5 CENTER -1 2.5 0 {PLACE}
SPHERE CENTER 1 2.5 0 RAD 1 TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 COLOR 1 1 1
       TEXFUNC 6 CENTER 1 2.5 0 {PLACE}
SPHERE CENTER 3 2.5 0 RAD 1 TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 COLOR 1 1 1
       TEXFUNC 8 ::img CENTER 3 2.5 0 {PLACE}
SPHERE CENTER -3 0 0 RAD 1 TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 COLOR 1 1 1
       TEXFUNC 10 ::vol CENTER -3 0 0 ROTATE 0.1 0.2 0 SCALE 0.4 0.5 0.3 UAXIS 1 0 0 VAXIS 0 1 0 WAXIS 0 0 1
SPHERE CENTER -1 0 0 RAD 1 TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 COLOR 1 1 1
       TEXFUNC 7 ::img CENTER -1 0 0 {PLACE}
SPHERE CENTER 1 0 0 RAD 1 TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 OUTLINE 0.9 OUTLINE_WIDTH 0.7
       PHONG METAL 0.6 PHONG_SIZE 30 COLOR 0.3 0.8 0.4 TEXFUNC 0
SPHERE CENTER 3 0 0 RAD 1 TEXTURE AMBIENT 0.1 DIFFUSE 0.5 SPECULAR 0.3 OPACITY 0.4 TRANSMODE R3D
       PHONG PLASTIC 0.6 PHONG_SIZE 30 COLOR 0.9 0.8 0.4 TEXFUNC 0
"""
SHAPES = """
RING CENTER -3 2 1 NORMAL 0.3 0.4 -1 INNER 0.4 OUTER 1.2
     TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 COLOR 1 0.5 1 TEXFUNC 0
BOX MIN -1.5 1 0 MAX 0 3.5 0.7 TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0.2 OPACITY 0.6 COLOR 0.4 0.5 1 TEXFUNC 0
CYLINDER CENTER 2.5 0 4 AXIS 0.2 1 0.1 RAD 0.7
     TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0.3 OPACITY 1 COLOR 0.4 0.9 1 TEXFUNC 0
FCYLINDER BASE 1 1 -1 APEX 2.5 2.5 -2 RAD 0.6
     TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 PHONG PLASTIC 0.7 PHONG_SIZE 60 COLOR 0.9 0.9 0.2 TEXFUNC 0
FCYLINDER BASE -2 -1 -1 APEX -3.5 -1.2 0 RAD 0.5
     TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0.2 OPACITY 0.5 COLOR 0.9 0.2 0.2 TEXFUNC 0
TRI V0 0 -2 -1 V1 1.5 -2 -1 V2 0.7 0 -0.5
     TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 0.7 COLOR 0.9 0.2 0.9 TEXFUNC 0
STRI V0 2 -2 -1 V1 3.5 -2 -1 V2 2.7 0 -0.5 N0 -0.5 0 1 N1 0.5 0 1 N2 0 1 1
     TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0.2 OPACITY 1 COLOR 0.2 0.2 0.9 TEXFUNC 0
VCSTRI V0 -1.5 -1 -2 V1 -0.2 -1 -2 V2 -0.7 0.5 -1.5 N0 0 0 -1 N1 0 0 -1 N2 0 0 -1 C0 1 0 0 C1 0 1 0 C2 0 0 1
     AMBIENT 0.3 DIFFUSE 0.7 SPECULAR 0 OPACITY 1 PHONG PLASTIC 0.4 PHONG_SIZE 20 VCST
"""
GRADIENT = "BACKGROUND_GRADIENT SKY_SPHERE UPDIR 0 1 0 TOPVAL 0.4 BOTTOMVAL -0.1 TOPCOLOR .1 .2 .9 BOTTOMCOLOR .9 .8 .7"
PLANAR_GRADIENT = GRADIENT.replace("SKY_SPHERE", "SKY_ORTHO_PLANE")
GREY = "BACKGROUND 0.2 0.3 0.4"
CLIPPED = f"START_CLIPGROUP NUMPLANES 2 1 0 0 2.2 0 1 0 2.5 {SHAPES} END_CLIPGROUP"
BESIDE = {
    "textures": LAMPS + IMAGES + FLOOR + BALLS,
    "shapes before a sky": LAMPS + GRADIENT + FLOOR + SHAPES,
    "VMD": f"{LAMPS}{GREY} SHADER_MODE FULL TRANS_VMD FOG_VMD TRANS_MAX_SURFACES 1 END_SHADER_MODE"
    f" FOG EXP2 START 5 END 20 DENSITY 0.08 COLOR 0.5 0.6 0.5 {FLOOR}{SHAPES}",
    "medium": f"{LAMPS}{GREY} SHADER_MODE MEDIUM TRANS_RASTER3D END_SHADER_MODE"
    f" FOG LINEAR START 5 END 30 DENSITY 1 COLOR 0.5 0.6 0.5 {FLOOR}{SHAPES}",
    "low": f"{LAMPS}{GREY} SHADER_MODE LOW END_SHADER_MODE {IMAGES}{FLOOR}{BALLS}{SHAPES}",
    "lowest": f"{LAMPS}{GREY} SHADER_MODE LOWEST END_SHADER_MODE {FLOOR}{SHAPES}",
    "clipped": f"{OTHER_LAMPS}{CLIPPED} SHADER_MODE FULL SHADOW_FILTER_OFF END_SHADER_MODE {FLOOR}",
    "orthographic": LAMPS + PLANAR_GRADIENT + FLOOR + SHAPES,
    "depth 1": LAMPS + GREY + FLOOR + SHAPES,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BESIDE)
def test_each_feature(tachyon, tmp_path, name):
    body = BESIDE[name]
    orthographic = name == "orthographic"
    head = HEAD.format(
        projection="PROJECTION ORTHOGRAPHIC" if orthographic else "",
        zoom=0.15 if orthographic else 1.2,
        depth=1 if name == "depth 1" else 5,
    )
    (tmp_path / "scene.dat").write_text(f"{head}{body}END_SCENE\n")
    reference = tachyon.picture(tmp_path, "scene.dat", tmp_path / "t.ppm")
    check(tachyon, tachyon.ours(tmp_path / "scene.dat"), reference, 32, 40)


@pytest.mark.long
def test_depth_of_field(tachyon, tmp_path):
    """Random in both programs: what lies at distance 1 is sharp, the rest equally blurred."""
    head = HEAD.format(projection="PROJECTION PERSPECTIVE_DOF FOCALLENGTH 1 APERTURE 0.3", zoom=1.2, depth=3)
    near = (
        "SPHERE CENTER -0.15 0.95 -10.95 RAD 0.1 TEXTURE AMBIENT 1 DIFFUSE 0 SPECULAR 0 OPACITY 1 COLOR 1 1 0 TEXFUNC 0"
    )
    (tmp_path / "scene.dat").write_text(
        f"{head.replace('ANTIALIASING 0', 'ANTIALIASING 99')}{LAMPS}{near}{SHAPES}END_SCENE\n"
    )
    reference = tachyon.picture(tmp_path, "scene.dat", tmp_path / "t.ppm")
    mine = tachyon.ours(tmp_path / "scene.dat", spp=None)
    assert tachyon.psnr(mine, reference) > 30
    assert tachyon.psnr(tachyon.ours(tmp_path / "scene.dat"), reference) < 25  # one sample: sharp everywhere


@pytest.mark.slow
def test_sky_light(tachyon, tmp_path):
    """Random in both programs, Tachyon taking the same 64 directions for every pixel: a mean is 0.03 off at most."""
    mode = "SHADER_MODE FULL AMBIENT_OCCLUSION AMBIENT_COLOR 0.6 0.6 0.6 RESCALE_DIRECT 0.5 SAMPLES 64 END_SHADER_MODE"
    head = HEAD.format(projection="", zoom=1.2, depth=3)
    plain = FLOOR.replace("TEXFUNC 1 CENTER 0.1 0.2 0.1 ROTATE 0 0 0 SCALE 1 1 1", "TEXFUNC 0")
    (tmp_path / "scene.dat").write_text(f"{head}{LAMPS}{GREY} {mode} {plain}{SHAPES}END_SCENE\n")
    reference = tachyon.picture(tmp_path, "scene.dat", tmp_path / "t.ppm")
    mine = tachyon.ours(tmp_path / "scene.dat")
    mask = tachyon.off_edges(reference)
    assert abs((mine - reference)[mask].mean()) < 0.03
    assert tachyon.psnr(mine, reference) > 27
