"""What was read is what the Tachyon program sees: written out again, every scene gives the same picture there.

The scenes are written from the plain values alone, pictures as PPM files, landscapes and polycylinders as the
primitives they became; so this holds the geometry, the textures with the order of their rows, the lights and the
camera against the program itself.
"""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lippmann.scene.readers.tachyon.reader import read_tachyon
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import TEXTURE_KINDS, ClassicMaterial, ClassicTexture
from lippmann.scene.whitted.builder import ClassicSceneBuilder

SIZE = 96
SCENES = [
    "2balls",
    "attenuation",
    "clipplanes",
    "fisheye",
    "fog",
    "gears_s2",
    "imagedef",
    "lscapes",
    "polycyl",
    "room",
    "smallballs",
    "spotlight",
    "teapot",
    "texfree",
    "transtest",
    "tree_fcyl",
]


@pytest.fixture(scope="session")
def tachyon() -> str:
    program = shutil.which("tachyon")
    if program is None:
        pytest.skip("the program 'tachyon' is not installed (Debian's package 'tachyon')")
    return program


def picture(tachyon: str, scene: Path, folder: Path) -> np.ndarray:
    """What the program makes of a scene file, (SIZE, SIZE, 3) uint8."""
    out = folder / f"{scene.stem}.tga"
    options = f"-numthreads 1 -aasamples 0 -res {SIZE} {SIZE} -format TARGA -o".split()
    run = subprocess.run([tachyon, scene, *options, out], cwd=scene.parent, capture_output=True, text=True, check=False)
    assert "Parse" not in run.stdout, run.stdout
    with Image.open(out) as image:
        return np.array(image.convert("RGB"))


def written(scene: ClassicScene, folder: Path) -> Path:
    """The scene as a ``.dat`` file of the plainest words."""
    lines = ["BEGIN_SCENE", "RESOLUTION {} {}".format(*scene.resolution), *camera_lines(scene), *sky_lines(scene)]
    for index, image in enumerate(scene.images):
        depth, height, width, _ = image.texels.shape
        if depth == 1:
            Image.fromarray(image.texels[0]).save(folder / f"image{index}.ppm")
        else:
            texels = " ".join("".join(f"{v:02x}" for v in texel) for texel in image.texels.reshape(-1, 3))
            lines += [f"IMAGEDEF ::image{index} FORMAT RGB24 RESOLUTION {width} {height} {depth} ENCODING HEX {texels}"]
    lines += [f"TEXDEF m{index} {texture_body(scene, m)}" for index, m in enumerate(scene.materials)]
    groups = {}
    for keyword, batch, columns in shapes(scene):
        for row in range(len(batch)):
            words = " ".join(f"{name} {vector(values[row])}".strip() for name, values in columns)
            groups.setdefault(int(batch.clip_group[row]), []).append(f"{keyword} {words} m{batch.material[row]}")
    for light in scene.lights:
        groups.setdefault(light.clip_group, []).append(light_line(light))
    lines += groups.pop(-1, [])
    for group, items in groups.items():
        planes = scene.clip_groups[group]
        lines += [f"START_CLIPGROUP NUMPLANES {len(planes)} {vector(planes)}", *items, "END_CLIPGROUP"]
    path = folder / f"{scene.name}_again.dat"
    path.write_text("\n".join([*lines, "END_SCENE"]))
    return path


def vector(values) -> str:
    return " ".join(f"{value:.9g}" for value in np.asarray(values, float).ravel())


def camera_lines(scene: ClassicScene) -> list[str]:
    camera = scene.camera
    projection = {"perspective": "PERSPECTIVE", "orthographic": "ORTHOGRAPHIC", "fisheye": "FISHEYE"}[camera.projection]
    frustum = f"FRUSTUM {vector(camera.frustum)}" if camera.frustum else ""
    return [
        f"CAMERA PROJECTION {projection} ZOOM {camera.zoom:.9g} ASPECTRATIO {camera.aspect:.9g} ANTIALIASING 0",
        f"RAYDEPTH {camera.ray_depth} CENTER {vector(camera.center)} VIEWDIR {vector(camera.view)}",
        f"UPDIR {vector(camera.up)} {frustum} END_CAMERA",
    ]


def sky_lines(scene: ClassicScene) -> list[str]:
    lines = [f"BACKGROUND {vector(scene.background.color)}"]
    if scene.fog:
        fog = scene.fog
        lines += [
            f"FOG {fog.kind.upper()} START {fog.start} END {fog.end} DENSITY {fog.density} COLOR {vector(fog.color)}"
        ]
    return lines


def texture_body(scene: ClassicScene, m: ClassicMaterial) -> str:
    finish = f"AMBIENT {m.ambient:.9g} DIFFUSE {m.diffuse:.9g} SPECULAR {m.specular:.9g} OPACITY {m.opacity:.9g}"
    highlight = f"PHONG {m.phong_kind.upper()} {m.phong:.9g} PHONG_SIZE {m.phong_size:.9g}"
    return f"{finish} {highlight} COLOR {vector(m.color)} TEXFUNC {texture_function(scene, m.texture)}"


def texture_function(scene: ClassicScene, texture: ClassicTexture) -> str:
    number = TEXTURE_KINDS.index(texture.kind)
    if number == 0:
        return "0"
    name = ""
    if texture.image is not None:
        inline = scene.images[texture.image].texels.shape[0] > 1
        name = f"::image{texture.image}" if inline else f"image{texture.image}.ppm"
    axes = ""
    if number >= 9:
        axes += f" UAXIS {vector(texture.u_axis)} VAXIS {vector(texture.v_axis)}"
    if number == 10:
        axes += f" WAXIS {vector(texture.w_axis)}"
    return (
        f"{number} {name} CENTER {vector(texture.center)} ROTATE {vector(texture.rotate)} SCALE {vector(texture.scale)}"
        + axes
    )


def light_line(light) -> str:
    color = f"COLOR {vector(light.color)}"
    if light.attenuation:
        constant, linear, quadratic = (f"{factor:.9g}" for factor in light.attenuation)
        color = f"ATTENUATION CONSTANT {constant} LINEAR {linear} QUADRATIC {quadratic} {color}"
    if light.kind == "directional":
        return f"DIRECTIONAL_LIGHT DIRECTION {vector(light.direction)} {color}"
    place = f"CENTER {vector(light.center)} RAD {light.radius:.9g}"
    if light.kind == "point":
        return f"LIGHT {place} {color}"
    cone = f"FALLOFF_START {light.falloff_start:.9g} FALLOFF_END {light.falloff_end:.9g}"
    return f"SPOTLIGHT {place} DIRECTION {vector(light.direction)} {cone} {color}"


def shapes(scene: ClassicScene):
    s = scene
    yield "SPHERE", s.spheres, [("CENTER", s.spheres.centers), ("RAD", s.spheres.radii)]
    yield "FCYLINDER", s.tubes, [("BASE", s.tubes.base), ("APEX", s.tubes.apex), ("RAD", s.tubes.base_radius)]
    c = s.cylinders
    yield "CYLINDER", c, [("CENTER", c.centers), ("AXIS", c.axes), ("RAD", c.radii)]
    r = s.rings
    yield "RING", r, [("CENTER", r.centers), ("NORMAL", r.normals), ("INNER", r.inner), ("OUTER", r.outer)]
    yield "BOX", s.boxes, [("MIN", s.boxes.minimum), ("MAX", s.boxes.maximum)]
    yield "PLANE", s.planes, [("CENTER", s.planes.centers), ("NORMAL", s.planes.normals)]
    t = s.triangles  # smooth ones all: a flat one carries its own normal at its corners
    corners = [(f"V{i}", t.positions[:, i]) for i in range(3)] + [(f"N{i}", t.normals[:, i]) for i in range(3)]
    yield "STRI", t, corners


def assert_same(first: np.ndarray, again: np.ndarray) -> None:
    """Equal but for a few pixels on silhouettes, which rounding may move."""
    far = np.abs(first.astype(int) - again.astype(int)).max(axis=2) > 2
    assert far.mean() < 1e-3, f"{far.sum()} of {far.size} pixels differ"
    assert first.std() > 5, "the picture is blank"


@pytest.mark.parametrize("name", SCENES)
def test_shared_scene_written_again_gives_the_same_picture(tachyon, shared_scenes, tmp_path, name):
    path = shared_scenes / "tachyon" / f"{name}.dat"
    again = written(read_tachyon(path), tmp_path)
    assert_same(picture(tachyon, path, tmp_path), picture(tachyon, again, tmp_path))


EVERYTHING = """
CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 4 CENTER 0 0 -6 VIEWDIR 0 0 1 UPDIR 0 1 0 END_CAMERA
BACKGROUND 0.1 0.2 0.3
LIGHT CENTER 3 4 -5 RAD 0.2 COLOR 0.6 0.6 0.5
SPOTLIGHT CENTER -4 1 -5 RAD 0 DIRECTION 4 -1 5 FALLOFF_START 5 FALLOFF_END 30 COLOR 0 0.3 0.6
DIRECTIONAL_LIGHT DIRECTION 0 -3 1 COLOR 0.2 0.1 0.1
TEXDEF red AMBIENT 0.2 DIFFUSE 0.8 SPECULAR 0.2 OPACITY 1 PHONG PLASTIC 0.5 PHONG_SIZE 20 COLOR 1 0 0 TEXFUNC 0
TEXALIAS rouge red
TEXDEF red AMBIENT 1 DIFFUSE 0 SPECULAR 0 OPACITY 1 COLOR 0 1 0 TEXFUNC 0
CYLINDER CENTER 2 0 2 AXIS 0 3 1 RAD 0.3 red
RING CENTER -1 1 0 NORMAL 1 1 -2 INNER 0.3 OUTER 0.7 rouge
BOX MIN -2 -2 0 MAX -1 -1 1 missing
VERTEXARRAY NUMVERTS 5
  COORDS 0 0 0  0.5 0 0  0 0.5 0  0.5 0.5 0  0 1 0.5
  NORMALS 0 0 -1  0.2 0 -1  0 0.2 -1  0 0 -1  0 0 -1
  TEXTURE AMBIENT 0.3 DIFFUSE 0.7 SPECULAR 0 OPACITY 1 COLOR 0 1 0 TEXFUNC 1 CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1
  TRISTRIP 5 0 1 2 3 4
  TRIMESH 1 0 2 4
END_VERTEXARRAY
SCAPE RES 9 7 SCALE 9 7 CENTER 0 -3 4 rouge
TPOLYFILE SCALE 2 1 1 ROT 10 20 30 CENTER 1 -1 0 FILE three.tri rouge
SPHERE CENTER 1 1 1 RAD 0.5 TEXTURE AMBIENT 0.2 DIFFUSE 0.8 SPECULAR 0 OPACITY 0.5 COLOR 1 1 0 TEXFUNC 0
PLANE CENTER 0 0 8 NORMAL 0 0 1
  TEXTURE AMBIENT 1 DIFFUSE 0 SPECULAR 0 OPACITY 1 COLOR 1 1 1
  TEXFUNC 9 PICTURE CENTER -5 -5 0 ROTATE 0 0 0 SCALE 0.1 0.1 1 UAXIS 1 0 0 VAXIS 0 1 0
"""


@pytest.mark.parametrize("suffix", ["ppm", "jpg", "tga"])
def test_all_words_written_again_give_the_same_picture(tachyon, tmp_path, suffix):
    ramp = np.mgrid[0:32, 0:48].transpose(1, 2, 0) * (8, 5)
    Image.fromarray(np.concatenate([ramp, ramp[..., :1] * 0], axis=-1).astype(np.uint8)).save(
        tmp_path / f"pic.{suffix}"
    )
    (tmp_path / "three.tri").write_text("3 0 0 0  1 0 0  0 1 0\n3 0 0 1  1 0 1  0 1 1\n")
    path = tmp_path / "everything.dat"
    body = EVERYTHING.replace("PICTURE", f"pic.{suffix}")
    path.write_text(f"BEGIN_SCENE RESOLUTION 64 64 {body} END_SCENE")
    scene = read_tachyon(path)
    assert scene.counts() == {
        "sphere": 1, "tube": 0, "cylinder": 1, "ring": 1, "box": 1, "plane": 1, "triangle": 4 + 96 + 2
    }  # fmt: skip
    assert_same(picture(tachyon, path, tmp_path), picture(tachyon, written(scene, tmp_path), tmp_path))


def test_the_comparison_sees_a_planted_fault(tachyon, shared_scenes, tmp_path):
    path = shared_scenes / "tachyon" / "room.dat"
    scene = read_tachyon(path)
    images = [np.ascontiguousarray(image.texels[:, ::-1]) for image in scene.images]
    builder = ClassicSceneBuilder("upside_down")
    for image, texels in zip(scene.images, images, strict=True):
        builder.image(type(image)(image.name, texels))
    again = written(type(scene)(**{**scene.__dict__, "images": builder.build().images}), tmp_path)
    with pytest.raises(AssertionError, match="pixels differ"):
        assert_same(picture(tachyon, path, tmp_path), picture(tachyon, again, tmp_path))
