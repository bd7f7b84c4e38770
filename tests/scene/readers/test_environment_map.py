"""Environment pictures from files."""

import imagecodecs
import numpy as np
import OpenEXR
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.environment_map import read_environment
from lippmann.scene.readers.load import load_scene


@pytest.fixture
def pixels():
    return np.random.default_rng(1).random((8, 16, 3)).astype(np.float32) * 10


def save_exr(path, channels, kind=OpenEXR.scanlineimage):
    with OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": kind}, channels) as file:
        file.write(str(path))
    return path


def test_exr(tmp_path, pixels):
    found = read_environment(save_exr(tmp_path / "sky.exr", {"RGB": pixels}))
    assert (found.pixels == pixels).all()
    assert found.pixels.dtype == np.float32
    assert found.name == "sky.exr"


def test_what_of_a_header_is_not_used_is_noted(tmp_path, pixels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File({**header, "whiteLuminance": 100.0}, {"RGB": pixels}) as file:
        file.write(str(tmp_path / "sky.exr"))
    scene = load_scene("teapot", environment=tmp_path / "sky.exr")
    assert "sky.exr: its attribute whiteLuminance is not used" in scene.notes


def test_half_precision_and_alpha(tmp_path, pixels):
    rgba = np.concatenate([pixels, np.ones((8, 16, 1), np.float32)], axis=-1).astype(np.float16)
    found = read_environment(save_exr(tmp_path / "sky.exr", {"RGBA": rgba}))
    assert found.pixels == pytest.approx(pixels, rel=1e-3)


def test_luminance_alone_is_grey(tmp_path, pixels):
    found = read_environment(save_exr(tmp_path / "sky.exr", {"Y": np.ascontiguousarray(pixels[..., 0])}))
    assert (found.pixels == pixels[..., :1]).all()


def test_hdr(tmp_path, pixels):
    path = tmp_path / "sky.hdr"
    path.write_bytes(imagecodecs.rgbe_encode(pixels, header=True))
    found = read_environment(path).pixels
    assert np.abs(found - pixels).max() < pixels.max() / 128  # the format's own step


def test_the_content_counts_and_not_the_name(tmp_path, pixels):
    save_exr(tmp_path / "sky.exr", {"RGB": pixels}).rename(tmp_path / "sky.hdr")
    assert (read_environment(tmp_path / "sky.hdr").pixels == pixels).all()


@pytest.mark.parametrize(
    ("value", "counts_as"), [((1, np.nan, 1), (1, 0, 1)), ((np.inf, 1, 1), (65504, 1, 1)), ((-1e-7, 3, 0), (0, 3, 0))]
)
def test_light_that_cannot_be_is_mended_with_a_note(tmp_path, pixels, value, counts_as):
    pixels[2, 3] = value
    sky = read_environment(save_exr(tmp_path / "sky.exr", {"RGB": pixels}))
    assert sky.pixels[2, 3].tolist() == list(counts_as)
    assert [note for note in sky.notes if note.startswith("sky.exr: 1 pixels hold negative light")]
    pixels[2, 3] = counts_as
    assert (sky.pixels == pixels).all()
    assert not read_environment(save_exr(tmp_path / "sky.exr", {"RGB": pixels})).notes


def test_shapes_that_are_no_panorama(tmp_path, pixels):
    with pytest.raises(SceneError, match=r"is 8x8 pixels; an equirectangular picture"):
        read_environment(save_exr(tmp_path / "sky.exr", {"RGB": np.ascontiguousarray(pixels[:, :8])}))
    with pytest.raises(SceneError, match=r"is 2x1 pixels"):
        read_environment(save_exr(tmp_path / "sky.exr", {"RGB": np.ascontiguousarray(pixels[:1, :2])}))


def test_a_single_pixel_is_light_from_everywhere(tmp_path, pixels):
    """As Blender writes a world of one colour beside a stage."""
    sky = read_environment(save_exr(tmp_path / "sky.exr", {"RGB": np.ascontiguousarray(pixels[:1, :1])}))
    assert sky.pixels.shape == (2, 4, 3)
    assert (sky.pixels == pixels[0, 0]).all()


def test_channels_that_are_no_colour(tmp_path, pixels):
    with pytest.raises(SceneError, match=r"has the channels Z; R, G and B"):
        read_environment(save_exr(tmp_path / "sky.exr", {"Z": np.ascontiguousarray(pixels[..., 0])}))


@pytest.mark.parametrize("others", [{}, {"View.DiffCol": 0.5}])
def test_the_colours_of_a_layer(tmp_path, pixels, others):
    """As Blender writes its multi-layer files."""
    layers = {"View.Combined": 1.0, **others}
    channels = {
        f"{layer}.{letter}": np.ascontiguousarray(factor * pixels[..., index])
        for layer, factor in layers.items()
        for index, letter in enumerate("RGB")
    }
    sky = read_environment(save_exr(tmp_path / "sky.exr", channels))
    assert (sky.pixels == pixels).all()
    assert sky.notes == ("sky.exr: its layer View.Combined is taken for the picture",)


def test_several_layers_of_which_none_is_the_picture(tmp_path, pixels):
    channels = {f"{layer}.{letter}": np.ascontiguousarray(pixels[..., 0]) for layer in "ab" for letter in "RGB"}
    with pytest.raises(SceneError, match=r"has the channels a\.B, a\.G, a\.R, b\.B"):
        read_environment(save_exr(tmp_path / "sky.exr", channels))


def save_parts(path, parts):
    parts = [OpenEXR.Part({"name": name, "type": OpenEXR.scanlineimage}, held) for name, held in parts.items()]
    with OpenEXR.File(parts) as file:
        file.write(str(path))
    return path


def test_of_several_parts_the_first_with_colours_is_the_picture(tmp_path, pixels):
    depth, other = np.ones(pixels.shape[:2], np.float32), np.ones_like(pixels)
    path = save_parts(tmp_path / "sky.exr", {"depth": {"Z": depth}, "beauty": {"RGB": pixels}, "light": {"RGB": other}})
    sky = read_environment(path)
    assert (sky.pixels == pixels).all()
    assert sky.notes == ("sky.exr: of its 3 parts 'beauty' is shown",)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) - len(other.tobytes()) // 2])
    with pytest.raises(SceneError, match=r"sky\.exr: cannot be decoded"):
        read_environment(path)


def test_deep_parts_are_refused_with_the_tool_that_flattens_them(tmp_path, pixels):
    path = save_exr(tmp_path / "sky.exr", {"RGB": pixels})
    data = bytearray(path.read_bytes())
    data[5] |= 0x08  # the flag of deep data
    path.write_bytes(data)
    with pytest.raises(SceneError, match=r"deep OpenEXR file\); flat ones are read; flatten it, by oiiotool") as caught:
        read_environment(path)
    assert "cut short" not in str(caught.value)


def test_damaged_and_foreign_files(tmp_path, pixels):
    path = save_exr(tmp_path / "sky.exr", {"RGB": pixels})
    data = path.read_bytes()
    for end in (100, 350, len(data) - 20):
        path.write_bytes(data[:end])
        with pytest.raises(SceneError, match=r"sky\.exr: cannot be decoded"):
            read_environment(path)
    path.write_bytes(imagecodecs.rgbe_encode(pixels, header=True)[:90])
    with pytest.raises(SceneError, match=r"sky\.exr: cannot be decoded"):
        read_environment(path)
    path.write_bytes(b"\x89PNG")
    with pytest.raises(SceneError, match=r"is no picture in linear light; OpenEXR"):
        read_environment(path)
    with pytest.raises(SceneError, match="no such file"):
        read_environment(tmp_path / "none.exr")


@pytest.mark.parametrize("across", [0, 2, -3, 17, 40, -17])
@pytest.mark.parametrize("down", [0, 1, -2, 9, 20, -9])
def test_exr_pixels_lie_in_the_display_window(tmp_path, pixels, across, down):
    """A crop of a rendered sky, or pixels all beyond it: where none are stored it is black."""
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "dataWindow": (np.array([across, down], np.int32), np.array([across + 15, down + 7], np.int32)),
        "displayWindow": (np.array([0, 0], np.int32), np.array([15, 7], np.int32)),
    }
    with OpenEXR.File(header, {"RGB": pixels}) as file:
        file.write(str(tmp_path / "sky.exr"))
    expected = np.zeros_like(pixels)
    for row, column in np.ndindex(8, 16):
        if 0 <= row - down < 8 and 0 <= column - across < 16:
            expected[row, column] = pixels[row - down, column - across]
    assert (read_environment(tmp_path / "sky.exr").pixels == expected).all()


def test_exr_chromaticities_are_converted(tmp_path):
    """Rec. 2020, with the matrix of ITU-R BT.2087-0; grey stays grey."""
    pixels = np.tile(np.float32([[1.0, 0.5, 0.5]]), (8, 16, 1))
    pixels[4:] = 0.25
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "chromaticities": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    }
    with OpenEXR.File(header, {"RGB": pixels}) as file:
        file.write(str(tmp_path / "sky.exr"))
    found = read_environment(tmp_path / "sky.exr").pixels
    to_709 = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
    assert found[0, 0] == pytest.approx(to_709 @ [1.0, 0.5, 0.5], abs=2e-4)
    assert found[-1, -1] == pytest.approx(np.full(3, 0.25), abs=1e-4)
