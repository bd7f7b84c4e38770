"""Focal stacks: each plane of the array and of the files is the refocused picture of that plane."""

from __future__ import annotations

import av
import numpy as np
import pytest
import tifffile
from PIL import Image

import lippmann as package
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import UsageError
from lippmann.image import IntegralImage
from lippmann.image.read import open_file
from lippmann.viewing.focal_stack import focal_stack, write_planes
from lippmann.viewing.refocus import refocus

DISPLAY = Display("square", Panel(40, 30, 0.25), LensArray("square", 1.25), gap=6.0)
PLANES = [-6.0, 0.5, 7.0]


@pytest.fixture
def image():
    return IntegralImage(np.random.default_rng(0).random((30, 40, 3)), DISPLAY)


@pytest.mark.parametrize("layout", ["square", "lenticular"])
def test_a_stack_is_its_planes(layout):
    display = Display("d", DISPLAY.panel, LensArray(layout, 1.25), gap=6.0)
    image = IntegralImage(np.random.default_rng(0).random((30, 40, 3)), display)
    reports = []
    stack = package.focal_stack(image, PLANES, size=(20, 16), progress=reports.append)
    assert stack.shape == (3, 16, 20, 3)
    for plane, picture in zip(PLANES, stack, strict=True):
        np.testing.assert_array_equal(picture, refocus(image, plane, size=(20, 16)))
    assert [(report.done, report.total) for report in reports] == [(1, 3), (2, 3), (3, 3)]


def test_all_planes_are_checked_first(image):
    near = Display("near", DISPLAY.panel, DISPLAY.lens_array, gap=6.0, viewing_distance=90.0)
    with pytest.raises(UsageError, match="mm and below the viewing distance"):
        focal_stack(IntegralImage(image.pixels, near), [0.0, 95.0])


@pytest.fixture
def picture(image, tmp_path):
    image.save(tmp_path / "picture.tif", bits=32)
    return tmp_path / "picture.tif"


def coded(image):
    """8-bit sRGB codes of the planes, by the standard's formula."""
    linear = np.stack([refocus(image, plane, size=(24, 18)) for plane in (-6.0, 0.0, 6.0)]).astype(float)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
    return np.round(255 * srgb)


@pytest.fixture
def lippmann(capfd):
    from lippmann.cli import run

    def call(*words):
        code = run([str(word) for word in words])
        return code, capfd.readouterr()

    return call


def test_names_of_pictures_in_a_folder_sort_as_their_planes(tmp_path):
    for count in (10, 11):
        write_planes(iter(np.zeros((count, 2, 2, 3), np.float32)), range(count), tmp_path / "stack")
        digits = len(str(count - 1))
        names = [f"plane_{k:0{digits}}_+{k}mm.png" for k in range(count)]
        assert sorted(path.name for path in (tmp_path / "stack").glob("plane*")) == names


@pytest.mark.long_cases(but=["stack.png"])
@pytest.mark.slow
@pytest.mark.parametrize("name", ["stack", "stack.tif", "stack.png", "stack.mp4"])
def test_the_command_writes_folders_pages_and_animations(lippmann, image, picture, tmp_path, name):
    path = tmp_path / name
    assert lippmann("refocus", picture, "--planes", "-6:6:3", "--size", "24x18", "-o", path)[0] == 0
    if name == "stack":
        names = ["plane_0_-6mm.png", "plane_1_+0mm.png", "plane_2_+6mm.png"]
        assert sorted(file.name for file in path.glob("plane*")) == names
        pages = np.stack([open_file(path / name).decode()[0] for name in names])
    elif name == "stack.tif":
        pages = tifffile.imread(path)
    elif name == "stack.png":
        with Image.open(path) as animation:
            assert animation.n_frames == 3
            pages = []
            for number in range(3):
                animation.seek(number)
                pages.append(np.asarray(animation.convert("RGB")))
    else:
        with av.open(str(path)) as container:
            assert len(list(container.decode(video=0))) == 3
        return
    assert np.abs(np.asarray(pages).astype(float) - coded(image)).max() <= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-o", "a.png"), "say --plane or --planes"),
        (("--plane", 1, "--planes", "0:1:2", "-o", "a.png"), "say --plane or --planes"),
        (("--planes", "0:1", "-o", "a.png"), "--planes: '0:1'; must be FIRST:LAST:COUNT"),
        (("--planes", "0:1:0", "-o", "a.png"), "--planes: '0:1:0'; must be FIRST"),
        (("--planes", "0:1:2", "-o", "a.exr"), "a focal stack is a folder, a .tif or an animation"),
        (("--planes", "0:1:2", "--bits", 16, "-o", "a.png"), "animations have 8"),
    ],
)
def test_errors(lippmann, picture, monkeypatch, tmp_path, words, message):
    monkeypatch.chdir(tmp_path)
    code, texts = lippmann("refocus", picture, *words)
    assert code == 2
    assert message in texts.err
