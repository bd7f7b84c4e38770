"""Damaged scene files end in a scene or in one line that says why, in bounded time, never otherwise."""

import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.errors import SceneError
from lippmann.scene.readers.nff import read_nff
from lippmann.scene.readers.tachyon.reader import read_tachyon
from lippmann.scene.values.whitted_scene import ClassicScene

TACHYON = """BEGIN_SCENE RESOLUTION 64 64
CAMERA PROJECTION PERSPECTIVE_DOF FOCALLENGTH 1 APERTURE 0.1 ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 4
CENTER 0 0 -6 VIEWDIR 0 0 1 UPDIR 0 1 0 FRUSTUM -1 1 -1 1 END_CAMERA
BACKGROUND 0.1 0.2 0.3
BACKGROUND_GRADIENT SKY_SPHERE UPDIR 0 1 0 TOPVAL 1 BOTTOMVAL 0 TOPCOLOR 0 0 1 BOTTOMCOLOR 0 1 0
LIGHT CENTER 3 4 -5 RAD 0.2 ATTENUATION CONSTANT 1 LINEAR 0 QUADRATIC 0 COLOR 0.6 0.6 0.5
SPOTLIGHT CENTER -4 1 -5 RAD 0 DIRECTION 4 -1 5 FALLOFF_START 5 FALLOFF_END 30 COLOR 0 0.3 0.6
DIRECTIONAL_LIGHT DIRECTION 0 -3 1 COLOR 0.2 0.1 0.1
SKY_LIGHT NUMSAMPLES 4 COLOR 1 1 1
FOG LINEAR START 1 END 2 DENSITY 0.5 COLOR 1 1 1
SHADER_MODE FULL TRANS_MAX_SURFACES 3 AMBIENT_OCCLUSION AMBIENT_COLOR 1 1 1 RESCALE_DIRECT 1 SAMPLES 2 END_SHADER_MODE
IMAGEDEF pic FORMAT RGB24 RESOLUTION 2 1 1 ENCODING HEX f00 00ff00
TEXDEF red AMBIENT 0.2 DIFFUSE 0.8 SPECULAR 0.2 OPACITY 1 PHONG PLASTIC 0.5 PHONG_SIZE 20 COLOR 1 0 0
TEXFUNC 10 pic CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1 UAXIS 1 0 0 VAXIS 0 1 0 WAXIS 0 0 1
TEXALIAS rouge red
# a comment
START_CLIPGROUP NUMPLANES 1 1 0 0 2
SPHERE CENTER 1 1 1 RAD 0.5 rouge
CYLINDER CENTER 2 0 2 AXIS 0 3 1 RAD 0.3 red
END_CLIPGROUP
FCYLINDER BASE 0 0 0 APEX 0 1 0 RAD 0.5 red
POLYCYLINDER POINTS 2 0 0 0 1 1 1 RAD 0.5 red
RING CENTER -1 1 0 NORMAL 1 1 -2 INNER 0.3 OUTER 0.7 rouge
BOX MIN -2 -2 0 MAX -1 -1 1 red
PLANE CENTER 0 0 8 NORMAL 0 0 1 red
TRI V0 0 0 0 V1 1 0 0 V2 0 1 0 red
VERTEXARRAY NUMVERTS 3 COORDS 0 0 0 1 0 0 0 1 0 NORMALS 0 0 1 0 0 1 0 0 1
COLORS 1 0 0 0 1 0 0 0 1 TRISTRIP 3 0 1 2 TRIMESH 1 0 1 2 END_VERTEXARRAY
SCAPE RES 3 3 SCALE 9 7 CENTER 0 -3 4 rouge
END_SCENE
"""
NFF = """b 0.1 0.2 0.3
v
from 1 2 3
at 0 0 0
up 0 0 1
angle 45
hither 1
resolution 64 64
l 1 2 3
l 3 2 1 1 0.5 0
f 1 0.5 0.25 0.8 0.2 30 0.5 1.5
s 0 0 0 1
c 0 0 0 1 0 0 1 0.5
p 5
0 0 0 2 0 0 2 2 0 1 0.5 0 0 2 0
pp 3
0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0 1
"""
NUMBERS = [
    "nan",
    "inf",
    "-1",
    "0",
    "1e99",
    "1e38",
    "-0",
    "2000000000",
    "99999999999999999999",
    "0.5",
    "1_0",
    "0x10",
    "-",
]
NAMES = ["#", "TEXTURE", "END_SCENE", "SPHERE", "INCLUDE", "s.dat", "p", "pp", "c", "v", "x", "\x7f", "\u00e9"]
READERS = {"tachyon": (TACHYON, read_tachyon), "nff": (NFF, read_nff)}


@st.composite
def damaged(draw, text: str) -> str:
    """The text with a few words replaced, dropped, doubled, inserted or swapped, and perhaps its end cut off."""
    words = text.split(" ")
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(words) - 1))
        how = draw(st.sampled_from(["replace", "drop", "double", "insert", "swap", "cut"]))
        if how == "replace":
            words[at] = draw(st.sampled_from(NUMBERS + NAMES))
        elif how == "insert":
            words.insert(at, draw(st.sampled_from(NUMBERS + NAMES)))
        elif how == "double":
            words.insert(at, words[at])
        elif how == "swap":
            other = draw(st.integers(0, len(words) - 1))
            words[at], words[other] = words[other], words[at]
        elif how == "cut" or len(words) > 1:
            del words[at : None if how == "cut" else at + 1]
        words = words or ["x"]
    return " ".join(words)


def outcome(read, path) -> ClassicScene | str:
    """The scene, or the line of the error."""
    try:
        return read(path)
    except SceneError as error:
        return str(error)


@pytest.mark.parametrize("kind", READERS)
def test_the_undamaged_file_is_read(tmp_path, kind):
    text, read = READERS[kind]
    (tmp_path / "s.dat").write_text(text)
    assert sum(read(tmp_path / "s.dat").counts().values()) > 5


@pytest.mark.parametrize("kind", READERS)
@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(data=st.data())
def test_damage_gives_a_scene_or_one_line(tmp_path, kind, data):
    text, read = READERS[kind]
    path = tmp_path / "s.dat"
    path.write_text(data.draw(damaged(text)))
    start = time.thread_time()
    result = outcome(read, path)
    if isinstance(result, str):
        assert result.startswith("s.dat")
        assert "\n" not in result
    else:
        assert any(result.counts().values())
        result.bounds()
    assert time.thread_time() - start < 5


@pytest.mark.parametrize("kind", READERS)
@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(data=st.binary(max_size=200), at=st.integers(0, 2000))
def test_foreign_bytes_give_a_scene_or_one_line(tmp_path, kind, data, at):
    text, read = READERS[kind]
    path = tmp_path / "s.dat"
    whole = text.encode()
    path.write_bytes(whole[:at] + data + whole[at + len(data) :])
    result = outcome(read, path)
    assert not isinstance(result, str) or "\n" not in result
