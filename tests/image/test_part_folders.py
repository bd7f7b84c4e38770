import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel
from lippmann.errors import OutputError, PictureError
from lippmann.image import IntegralImage, compose, read_picture, write_micro_images, write_views
from lippmann.image.part_folders import MANIFEST
from lippmann.image.write import write_plain_picture

WRITERS = [write_views, write_micro_images]


def assert_same(back, image):
    np.testing.assert_array_equal(back.pixels, image.pixels)
    np.testing.assert_array_equal(back.world_from_display, image.world_from_display)
    assert (back.display, back.provenance, back.stored) == (image.display, image.provenance, image.stored)


@pytest.mark.slow
@pytest.mark.parametrize("write", WRITERS)
@pytest.mark.parametrize("layout", ["lenticular", "square", "hexagonal"])
@pytest.mark.parametrize(("name", "bits"), [("a.png", 8), ("a.png", 16), ("a.exr", 32), ("a.exr", 16), ("a.tif", 16)])
def test_there_and_back_in_the_depth_of_the_source(tmp_path, display, picture, write, layout, name, bits):
    picture(display(layout, lenses=(5, 4), pixels=3, distance=500.0)).save(tmp_path / name, bits)
    image = read_picture(tmp_path / name)
    write(image, tmp_path / "parts")
    back = compose(tmp_path / "parts")
    assert_same(back, image)
    back.save(tmp_path / f"back-{name}")
    assert_same(read_picture(tmp_path / f"back-{name}"), image)


@pytest.mark.parametrize("write", WRITERS)
@pytest.mark.parametrize(("format", "bits"), [(None, None), ("exr", 32), ("tiff", None), ("tiff", 32)])
def test_computed_values_come_back_as_they_are(tmp_path, display, picture, write, format, bits):
    image = picture(display("hexagonal", pixels=5))
    write(image, tmp_path / "parts", format=format, bits=bits)
    assert_same(compose(tmp_path / "parts"), image)


@pytest.mark.parametrize("write", WRITERS)
def test_maps_travel_along(tmp_path, display, picture, write):
    array = display("hexagonal", pixels=4)
    shape = (array.panel.height, array.panel.width)
    depth = np.random.default_rng(1).random(shape, dtype=np.float32)
    maps = {"depth": depth, "id": np.arange(depth.size, dtype=np.uint32).reshape(shape)}
    write(picture(array, maps=maps), tmp_path / "parts")
    back = compose(tmp_path / "parts")
    assert set(back.maps) == {"depth", "id"}
    np.testing.assert_array_equal(back.maps["depth"], depth)
    np.testing.assert_array_equal(back.maps["id"], maps["id"])


@pytest.mark.slow
@settings(
    deadline=None, max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(data=st.data())
def test_any_display_there_and_back(tmp_path, random_displays, picture, data):
    image = picture(data.draw(random_displays()))
    parts = tmp_path / "parts"
    write_micro_images(image, parts)
    assert_same(compose(parts), image)
    write_views(image, parts)
    if image.views_are_exact:
        assert_same(compose(parts), image)
    else:
        assert json.loads((parts / MANIFEST).read_text())["exact"] is False
        with pytest.raises(PictureError, match="do not cover whole pixels; its views are resampled"):
            compose(parts)


def test_files_and_names(tmp_path, display, picture):
    image = picture(display("lenticular", lenses=(11, 2), pixels=3))
    write_views(image, tmp_path / "views", format="png", bits=16)
    shown = {name for name in os.listdir(tmp_path / "views") if not name.startswith(".")}
    assert shown == {"view_0_0.png", "view_0_1.png", "view_0_2.png", MANIFEST}
    write_micro_images(image, tmp_path / "lenses")
    shown = {name for name in os.listdir(tmp_path / "lenses") if not name.startswith(".")}
    assert shown == {f"lens_00_{k:02}.exr" for k in range(11)} | {MANIFEST}
    manifest = json.loads((tmp_path / "views" / MANIFEST).read_text())
    assert manifest["files"] == [["view_0_0.png", "view_0_1.png", "view_0_2.png"]]
    assert manifest["display"] == image.display.to_dict()
    assert "far left" in manifest["order"]


def test_a_view_file_shows_one_pixel_per_lens(tmp_path, display, picture):
    image = picture(display("square", lenses=(4, 3), pixels=3))
    write_views(image, tmp_path / "views", format="exr")
    one = Display("one", Panel(4, 3, 1.0), LensArray("square", 1.0), gap=1.0)
    view = read_picture(tmp_path / "views" / "view_2_0.exr", display=one)
    np.testing.assert_array_equal(view.pixels, image.pixels[2::3, 0::3])


def test_corners_of_hexagons_are_not_written(tmp_path, display, picture):
    image = picture(display("hexagonal", lenses=(3, 3), pixels=8))
    written = write_views(image, tmp_path / "views")
    assert written == len([name for name in os.listdir(tmp_path / "views") if name.startswith("view_")])
    assert written == int(image.view_mask().any(axis=(2, 3)).sum()) < image.views().shape[0] * image.views().shape[1]


def test_progress_counts_the_files(tmp_path, display, picture):
    reports = []
    write_views(picture(display("square", pixels=2)), tmp_path / "views", progress=reports.append)
    assert [(report.stage, report.done, report.total) for report in reports] == [("write", k, 4) for k in (1, 2, 3, 4)]
    reports.clear()
    compose(tmp_path / "views", progress=reports.append)
    assert (reports[-1].stage, reports[-1].done, reports[-1].total) == ("read", 4, 4)


@pytest.fixture
def views(tmp_path, display, picture):
    write_views(picture(display("square")), tmp_path / "views", format="png")
    return tmp_path / "views"


def change(folder, **changes):
    values = json.loads((folder / MANIFEST).read_text())
    (folder / MANIFEST).write_text(json.dumps({**values, **changes}))


def test_a_missing_file_is_named(views):
    (views / "view_1_2.png").unlink()
    with pytest.raises(PictureError, match=r"view_1_2.png: no such file"):
        compose(views)


def test_a_file_of_another_size_or_depth_is_named(views):
    write_plain_picture(np.zeros((3, 5, 3), np.float32), views / "view_1_2.png")
    with pytest.raises(PictureError, match=r"view_1_2.png: has 5 x 3 pixels; the views of this folder have 4 x 3"):
        compose(views)
    write_plain_picture(np.zeros((3, 4, 3), np.float32), views / "view_1_2.png", bits=16)
    with pytest.raises(PictureError, match=r"view_1_2.png: holds uint16 values; lippmann.json says uint8"):
        compose(views)
    (views / "view_1_2.png").write_bytes(b"")
    with pytest.raises(PictureError, match=r"view_1_2.png: is empty"):
        compose(views)


def test_other_layers_than_the_first_are_refused(tmp_path, display, picture):
    folder = tmp_path / "views"
    write_views(picture(display("square")), folder)
    maps = {"depth": np.zeros((3, 4), np.float32)}
    view = IntegralImage(np.zeros((3, 4, 3), np.float32), display("square").resized(4, 3), maps=maps)
    view.save(folder / "view_1_2.exr")
    with pytest.raises(PictureError, match=r"view_1_2.exr: has the layers RGB, depth; all files"):
        compose(folder)


def test_two_files_in_each_others_place_are_not_noticed_but_used_as_listed(views, display, picture):
    # The manifest decides: names carry no meaning.
    files = json.loads((views / MANIFEST).read_text())["files"]
    before = compose(views)
    files[0][0], files[0][1] = files[0][1], files[0][0]
    change(views, files=files)
    after = compose(views)
    np.testing.assert_array_equal(after.views()[0, 0], before.views()[0, 1])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lippmann": 99}, "version 99"),
        ({"kind": "photos"}, "kind is 'photos'; it must be one of views, micro-images"),
        ({"kind": ["views"]}, "kind is"),
        ({"stored": "int8"}, "stored is 'int8'"),
        ({"files": None}, "'files' makes no sense"),
        ({"files": [["../secret.png"] * 3] * 3}, "'files' makes no sense"),
        ({"files": [["a\0b"] * 3] * 3}, "'files' makes no sense"),
        ({"files": [[".."] * 3] * 3}, "'files' makes no sense"),
        ({"files": [[1, 2, 3]] * 3}, "'files' makes no sense"),
        ({"files": [["a.png"] * 2] * 3}, "does not have 3 rows of 3; the views of the display test-square are 3 x 3"),
        ({"files": []}, "does not have 3 rows"),
        ({"files": [["a.png", None, "b.png"]] * 3}, "no name in row 0, column 1"),
        ({"display": {}}, "makes no sense"),
        ({"kind": "micro-images"}, "does not have 3 rows of 4"),
    ],
)
def test_a_manifest_that_makes_no_sense_is_named(views, changes, message):
    change(views, **changes)
    with pytest.raises(PictureError, match=message) as caught:
        compose(views)
    assert str(caught.value).startswith(str(views / MANIFEST))


def test_a_folder_without_a_manifest(tmp_path, views):
    with pytest.raises(PictureError, match=r"lippmann.json: no such file; give a folder written by"):
        compose(tmp_path)
    with pytest.raises(PictureError, match=r"lippmann.json: no such file; give a folder written by"):
        compose(views / MANIFEST)
    for content in (b"", b"{}", b"\xff\xfe", b"[]"):
        (views / MANIFEST).write_bytes(content)
        with pytest.raises(PictureError, match="describes no folder of views or micro-images"):
            compose(views)


def test_another_display_than_the_files_were_made_for_is_refused(views, display):
    change(views, display=display("square", lenses=(6, 3)).to_dict())
    with pytest.raises(PictureError, match="has 4 x 3 pixels"):
        compose(views)


def test_formats_that_cannot_be(tmp_path, display, picture):
    image = picture(display())
    with pytest.raises(OutputError, match="unknown format 'jpeg'; known are png, exr, tiff"):
        write_views(image, tmp_path / "views", format="jpeg")
    with pytest.raises(OutputError, match="32 bits per channel"):
        write_views(image, tmp_path / "views", format="png", bits=32)
    assert os.listdir(tmp_path) == []


def test_a_failure_in_the_middle_leaves_nothing(tmp_path, display, picture):
    def interrupt(report):
        if report.done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_views(picture(display("square")), tmp_path / "views", progress=interrupt)
    assert os.listdir(tmp_path) == []


def test_a_second_run_replaces_the_first(views, display, picture):
    other = picture(display("square", pixels=2), seed=5)
    write_views(other, views)
    assert_same(compose(views), other)
    assert not (views / "view_2_2.png").exists()


def test_a_copied_folder_composes(tmp_path, views):
    shutil.copytree(views, tmp_path / "copy")
    assert_same(compose(tmp_path / "copy"), compose(views))


def test_linear_transfer_is_kept(tmp_path, display, picture, provenance):
    image = picture(display(), provenance=replace(provenance, transfer="linear"))
    image.save(tmp_path / "a.png")
    image = read_picture(tmp_path / "a.png")
    write_views(image, tmp_path / "views")
    assert_same(compose(tmp_path / "views"), image)
