"""Files of a real Blender look as Cycles renders them: a camera's picture has the same shapes, and means to 5 %."""

import functools
import subprocess
from pathlib import Path

import numpy as np
import pytest

from lippmann import api
from lippmann.codecs.exr import read_exr, read_exr_header
from lippmann.color.transfer import encode_srgb
from lippmann.scene.readers.blend.find_blender import VARIABLE

MAKE = Path(__file__).with_name("make_cycles_pictures.py")

#: Scenes of ``make_cycles_pictures.py`` that are shown as they are, without a note.
PLAIN = (
    *("temperature", "excluded", "linear_texture", "shift", "tall", "collections", "modifiers", "geometry_nodes"),
    *("principled", "vertex_colors", "slots", "picture_of_another_space"),
)
#: Those of which a note says what is shown otherwise.
NOTED = (
    *("not_normalized", "lights", "working_space", "unseen"),
    *("picture_in_working_space", "vertices_in_working_space"),
)


@pytest.fixture(scope="module")
def pictures(real_blender, tmp_path_factory):
    """Folder of the scenes and of Cycles' pictures of them."""
    folder = tmp_path_factory.mktemp("pictures")
    command = [real_blender, "--background", "--factory-startup", "--disable-autoexec"]
    script = ["--python-exit-code", "1", "--python", str(MAKE), "--", str(folder), *PLAIN, *NOTED]
    subprocess.run([*command, *script], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    return folder


@pytest.fixture(scope="module")
def notes_of(engine, real_blender, pictures):
    """Holds Lippmann's picture of a scene against that of Cycles; the notes on the scene."""

    @functools.cache
    def compare(name):
        path = pictures / f"{name}.exr"
        if not path.exists():
            pytest.skip("this Blender has no Cycles")
        channels = read_exr(path, read_exr_header(path))
        cycles = np.stack([channels[color] for color in "RGB"], axis=-1)
        height, width = cycles.shape[:2]
        options = {"spp": 32, "depth": 9, "pixel_filter": "box", "tone_map": "none", "denoise": "none", "exposure": 0}
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv(VARIABLE, real_blender)
            scene = api.load_scene(path.with_suffix(".blend"))
        seen = api.preview(scene, size=(width, height), camera="Camera", **options).pixels
        assert seen.mean(axis=(0, 1)) == pytest.approx(cycles.mean(axis=(0, 1)), rel=0.05)
        # Red light on red surfaces is a quarter brighter where it is multiplied in Rec. 709 than in ACEScg.
        assert off_share(seen, cycles) < (0.05 if name == "working_space" else 0.01)
        return "\n".join(scene.description.notes)

    return compare


@pytest.mark.parametrize("name", [*PLAIN, *NOTED])
def test_pictures_are_those_of_cycles(notes_of, name):
    said = notes_of(name)
    if name in PLAIN:
        assert said == ""


def test_area_lights_are_seen(notes_of):
    assert "area lights are seen" in notes_of("lights")


def test_light_is_multiplied_in_rec_709(notes_of):
    said = notes_of("working_space")
    if not said:
        pytest.skip("before Blender 5 there is but one working space")
    assert said == "its colours are converted from ACEScg; light is multiplied in Rec. 709"


def off_share(seen, expected):
    """Share of pixels whose codes differ by more than 0.1 from those of all pixels around the same place."""
    codes, wanted = (encode_srgb(np.clip(picture, 0.0, 1.0)) for picture in (seen, expected))
    around = np.pad(wanted, ((1, 1), (1, 1), (0, 0)), mode="edge")
    rows, columns = codes.shape[:2]
    distances = [
        np.abs(codes - around[down : down + rows, right : right + columns]).max(axis=-1)
        for down in range(3)
        for right in range(3)
    ]
    return (np.min(distances, axis=0) > 0.1).mean()
