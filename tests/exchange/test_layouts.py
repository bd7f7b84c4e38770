"""Layouts by name: what each keeps, which one a file has, and what is refused before anything is read."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from lippmann.errors import LippmannError, OutputError, PictureError, UsageError
from lippmann.exchange import LAYOUTS, export_image, import_image
from lippmann.exchange.layouts import recognize, stored_in
from lippmann.exchange.light_field import light_field_of
from lippmann.image import Provenance, write_micro_images, write_views

NAMES = {"hci": "x", "lftoolbox": "x.mat", "eslf": "x.png", "zarr": "x.zarr", "views": "x"}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_is_recognize_and_comes_back(display, picture, same, tmp_path, layout):
    image = picture(display(distance=300), stored="uint8", depth=True)
    path = tmp_path / NAMES[layout]
    done = export_image(image, path, layout)
    assert (done.stored, done.shape) == ("uint8", (3, 3, 3, 4))
    assert recognize(path) == layout
    found, notes = import_image(path)
    same(found, image, maps=layout == "zarr")
    assert notes == ()
    assert any("depth" in note for note in done.notes) == (layout in ("lftoolbox", "eslf", "views"))


def test_a_png_of_another_program_is_said_to_be_taken_for_eslf(display, tmp_path):
    shown = display(distance=300)
    Image.new("RGB", (shown.panel.width, shown.panel.height)).save(tmp_path / "x.png")
    assert import_image(tmp_path / "x.png", "eslf", display=shown)[1] == ()
    (note,) = import_image(tmp_path / "x.png", display=shown)[1]
    assert note.startswith("taken for ESLF, micro-images side by side; whole views")


@pytest.mark.parametrize("write", [write_views, write_micro_images])
def test_our_own_folders_are_composed(display, picture, same, tmp_path, write):
    image = picture(display(), stored="uint8")
    write(image, tmp_path / "x")
    same(import_image(tmp_path / "x")[0], image)
    with pytest.raises(PictureError, match=r"names its own display; leave display=\.\.\. out"):
        import_image(tmp_path / "x", display=image.display)


def test_types_by_layout():
    assert [stored_in(layout, "float32", None) for layout in LAYOUTS] == [
        "uint8",
        "float32",
        "uint8",
        "float32",
        "float32",
    ]
    assert [stored_in(layout, "uint16", None) for layout in LAYOUTS] == ["uint16"] * 5
    assert [stored_in(layout, "uint16", 8) for layout in LAYOUTS] == ["uint8"] * 5
    assert [stored_in(layout, "float16", None) for layout in LAYOUTS] == [
        "uint8",
        "float32",
        "uint8",
        "float16",
        "float32",
    ]
    with pytest.raises(OutputError, match="32 bits per channel are not possible; hci has 8, 16"):
        stored_in("hci", "uint8", 32)


def test_another_display_shows_the_same_views(display, picture, tmp_path):
    image = picture(display(distance=300), stored="uint8")
    other = display(pixel_pitch=0.1, gap=3.0)
    for layout in LAYOUTS:
        export_image(image, tmp_path / f"{layout}{NAMES[layout]}", layout)
        shown, _ = import_image(tmp_path / f"{layout}{NAMES[layout]}", display=other)
        assert shown.display == other
        np.testing.assert_array_equal(shown.pixels, image.pixels)
        with pytest.raises(PictureError, match=r"the display test-square has|multiples of these"):
            import_image(tmp_path / f"{layout}{NAMES[layout]}", display=display(pixels=2))


def test_what_is_not_meant_is_refused(display, picture, tmp_path):
    image = picture(display())
    for words, what in (
        ((image, tmp_path / "x", "hdf"), "layout: unknown layout 'hdf'; known are hci, lftoolbox"),
        ((image, tmp_path / "x.png", "lftoolbox"), "the ending is '.png'; lftoolbox files end in .mat"),
        ((image, tmp_path / "x", "eslf"), "eslf files end in .png"),
    ):
        with pytest.raises(LippmannError) as refused:
            export_image(*words)
        assert what in str(refused.value)
    with pytest.raises(UsageError, match="distance: does not apply to zarr"):
        export_image(image, tmp_path / "x", "zarr", distance=5.0)
    with pytest.raises(UsageError, match="unknown layout 'hdf'"):
        import_image(tmp_path, "hdf")
    with pytest.raises(PictureError, match="no such file"):
        import_image(tmp_path / "no")
    (tmp_path / "x.dat").write_bytes(b"1")
    with pytest.raises(PictureError, match="the layout is not recognized; say layout="):
        import_image(tmp_path / "x.dat")
    (tmp_path / "IMG_0001.LFR").write_bytes(b"\x89LFP\r\n\x1a\n")
    with pytest.raises(PictureError, match="raw light fields are not read; decode them with the Light Field Toolbox"):
        import_image(tmp_path / "IMG_0001.LFR")
    (tmp_path / "lf.h5").write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(PictureError, match=r"HDF5 files are not read; save its views as pictures named by row"):
        import_image(tmp_path / "lf.h5")
    (tmp_path / "input_Cam000.png").write_bytes(b"")
    assert recognize(tmp_path) == "views"  # of the benchmark, without its parameters


@pytest.mark.parametrize(("layout", "library"), [("lftoolbox", "h5py"), ("zarr", "zarr")])
def test_a_missing_library_is_named(display, picture, tmp_path, monkeypatch, layout, library):
    import importlib

    real = importlib.import_module

    def without(name, *rest):
        if name == library:
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", without)
    with pytest.raises(
        UsageError, match=f'{library} is not installed; this layout needs it; install it: pip install "lippmann'
    ):
        export_image(picture(display()), tmp_path / NAMES[layout], layout)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("layout", LAYOUTS)
def test_pictures_whose_codes_are_plain_shares_of_light_stay_so(display, picture, same, tmp_path, layout):
    image = picture(display(), stored="uint8", provenance=Provenance(scene="x", transfer="linear"))
    path = tmp_path / NAMES[layout]
    export_image(image, path, layout)
    same(import_image(path)[0], image)
    for file in (path, *path.glob("*.png")):
        assert file.suffix != ".png" or b"sRGB" not in file.read_bytes()[:200]


def test_the_display_says_how_many_views_there_are_across_and_down(display, picture, tmp_path):
    made = display("lenticular", lenses=(4, 3), pixels=3)
    codes = np.random.default_rng(0).integers(0, 255, (9, 12, 3), dtype=np.uint8)
    Image.fromarray(codes).save(tmp_path / "x.png")
    shown, _ = import_image(tmp_path / "x.png", "eslf", display=made)
    views = light_field_of(shown, "uint8").values
    for s in range(3):
        np.testing.assert_array_equal(views[0, s], codes[:, s::3])
    (tmp_path / "x").mkdir()
    for s in range(3):
        Image.fromarray(views[0, s]).save(tmp_path / "x" / f"{s}.png")
    np.testing.assert_array_equal(import_image(tmp_path / "x", display=made)[0].pixels, shown.pixels)
