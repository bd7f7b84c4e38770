"""Every command does its work, and says so as text and as JSON."""

import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from lippmann.display import load_display
from lippmann.image import IntegralImage, read_picture
from lippmann.image.metadata import Provenance


def picture_size(path):
    from PIL import Image

    with Image.open(path) as picture:
        return picture.size


@pytest.mark.slow
def test_render_says_what_it_did(lippmann, tmp_path, engine):
    out = tmp_path / "a.png"
    done = lippmann("render", "teapot", "--method", "full", "--spp", 2, "--depth", 2, "--seed", 7, "--json", "-o", out)
    assert done.code == 0
    values = done.json
    assert values["output"] == str(out)
    assert (values["method"], values["spp"], values["seed"], values["traced_fraction"]) == ("full", 2, 7, 1.0)
    assert values["size"] == [512, 512]
    assert values["rays"]["primary"] == 512 * 512 * 2
    assert set(values["rays"]) == {"primary", "shadow", "secondary"}
    assert set(values["seconds"]) == {"load", "build", "compile", "trace", "reuse", "write", "total"}
    assert values["seconds"]["total"] >= values["seconds"]["trace"] > 0
    assert read_picture(out).provenance.depth == 2
    assert "mm behind" in done.err
    # What `displays` says, too: rays are recorded from 10 mm in front on.
    assert "depth budget of the display from 54.4 mm behind to 10.0 mm in front" in done.err


@pytest.mark.long
def test_an_empty_picture_is_told(lippmann, tmp_path, engine):
    words = ("render", "teapot", "--spp", 1, "--place", "fit", "-o", tmp_path / "a.png")
    done = lippmann(*words, "--shift", "500,0,0")
    assert done.code == 0
    assert "the picture is nearly empty (nothing)" in done.err
    assert any("nearly empty" in note for note in read_picture(tmp_path / "a.png").provenance.notes)
    assert "empty" not in lippmann(*words).err


def test_quiet_says_nothing(lippmann, tmp_path, engine):
    done = lippmann("render", "teapot", "--integrator", "normal", "--spp", 1, "-q", "-o", tmp_path / "a.png")
    assert (done.code, done.out, done.err) == (0, "", "")


def test_info_tells_where_a_picture_came_from(lippmann, picture):
    text = lippmann("info", picture).out
    assert "seed-lenticular" in text
    assert "teapot" in text
    values = lippmann("info", picture, "--json").json
    assert values["size"] == [512, 512]
    assert values["provenance"]["integrator"] == "direct"
    assert values["display"]["gap"] == 6.8


@pytest.mark.slow
@pytest.mark.parametrize("command", ["views", "micro-images"])
def test_taking_apart_and_composing_gives_the_same_pixels(lippmann, picture, tmp_path, command):
    folder, out = tmp_path / "parts", tmp_path / "again.png"
    done = lippmann(command, picture, "-o", folder, "--json")
    assert done.code == 0
    assert done.json["views" if command == "views" else "lenses"] == ([1, 8] if command == "views" else [1, 64])
    assert lippmann("compose", folder, "-o", out).code == 0
    assert np.array_equal(read_picture(out).pixels, read_picture(picture).pixels)


def test_replay_and_refocus_write_plain_pictures(lippmann, picture, tmp_path):
    assert lippmann("replay", picture, "--eye", "10,0,600", "--size", "64x48", "-o", tmp_path / "r.png").code == 0
    assert picture_size(tmp_path / "r.png") == (64, 48)
    assert lippmann("refocus", picture, "--plane", "-20", "--size", "32x32", "-o", tmp_path / "f.png").code == 0
    assert picture_size(tmp_path / "f.png") == (32, 32)


def test_replay_through_a_real_lens(lippmann, picture, tmp_path):
    """A display that gives a lens; others, quilts and filters are named."""
    sheet, out = tmp_path / "sheet.png", tmp_path / "seen.png"
    display = "print:lpi=40,ppi=360,size=12x8mm,thickness=1mm,index=1.57"
    image = IntegralImage(np.full((113, 170, 3), 0.5, np.float32), load_display(display))
    image.save(sheet)
    done = lippmann("replay", sheet, "--optics", "--eye", "0,0,600", "--size", "60x40", "--json", "-o", out)
    assert (done.code, done.json["optics"]) == (0, True)
    from PIL import Image

    with Image.open(out) as seen:
        assert np.asarray(seen)[10:30, 20:40].mean() == pytest.approx(image.srgb().mean(), abs=2)
    assert (
        lippmann(
            "replay", sheet, "--optics", "--sweep", "--frames", 2, "--size", "32x32", "-o", tmp_path / "s.png"
        ).code
        == 0
    )
    for words, says in (
        ((picture, "--optics"), "gives no lens"),
        ((sheet, "--optics", "--filter", "linear"), "--filter: given beside optics"),
    ):
        done = lippmann("replay", *words, "-o", tmp_path / "none.png")
        assert done.code == 2
        assert says in done.err
    assert not (tmp_path / "none.png").exists()


@pytest.mark.parametrize("ending", ["png", "mp4"])
def test_a_sweep_is_an_animation(lippmann, picture, tmp_path, ending):
    out = tmp_path / f"sweep.{ending}"
    words = ("replay", picture, "--sweep", "--frames", 3, "--size", "32x32", "--json", "-o", out)
    values = lippmann(*words).json
    assert values["frames"] == 3
    assert values["start"][0] == -values["stop"][0] < 0
    if ending == "png":
        from PIL import Image

        with Image.open(out) as animation:
            assert animation.n_frames == 3
    else:
        assert out.read_bytes()[4:8] == b"ftyp"


def test_a_sweep_ends_before_the_views_flip(lippmann, tmp_path):
    display = load_display("looking-glass-portrait")
    display = replace(display, panel=replace(display.panel, width=192, height=64))
    panel_x = (np.arange(192)[None, :, None] + np.array([-1, 0, 1]) / 3 - 95.5) * display.panel.pixel_pitch
    panel_y = np.broadcast_to((31.5 - np.arange(64))[:, None, None] * display.panel.pixel_pitch, (64, 192, 3))
    i, j = display.lens_of(np.broadcast_to(panel_x, (64, 192, 3)), panel_y)
    center = display.lens_center(i, j, panel_x, panel_y)[0] * display.magnification
    image = IntegralImage((panel_x > center).astype(np.float32), display, provenance=Provenance(subpixels=True))
    image.save(tmp_path / "sides.exr")
    words = ("replay", tmp_path / "sides.exr", "--sweep", "--frames", 2, "--size", "192x64", "--json")
    ends = lippmann(*words, "-o", tmp_path / "s.png").json
    for eye, level in ((ends["start"], 1.0), (ends["stop"], 0.0)):
        seen = image.replay(tuple(eye), size=(192, 64))[8:-8, 8:-8]
        assert np.mean(seen == level) > 0.99


def test_a_sweep_says_how_far_it_is(lippmann, picture, tmp_path, monkeypatch):
    monkeypatch.setattr("lippmann.progress_bar.PLAIN_INTERVAL", 0.0)
    done = lippmann("replay", picture, "--sweep", "--frames", 3, "--size", "32x32", "-o", tmp_path / "sweep.png")
    assert done.err.count(": drawing") == 3


@pytest.mark.slow
def test_preview_renders_the_plain_picture(lippmann, tmp_path, engine):
    done = lippmann("preview", "teapot", "--plain", "--spp", 1, "--pixels", "40x30", "-o", tmp_path / "p.png", "--json")
    assert done.json["rays"]["primary"] == 1200
    assert picture_size(tmp_path / "p.png") == (40, 30)


def test_displays_lists_pixels_lenses_field_and_depth(lippmann):
    rows = {row["name"]: row for row in lippmann("displays", "--json").json["displays"]}
    paper = rows["seed-lenticular"]
    assert paper["pixels"] == [512, 512]
    assert paper["lenses"][0] == 64
    assert paper["field_of_view"] == pytest.approx(17.7, abs=0.05)
    assert paper["depth_budget"] == pytest.approx([10, -54.4])
    text = lippmann("displays").out
    assert all(name in text for name in rows)
    assert text.splitlines()[0].split()[:3] == ["name", "pixels", "lenses"]
    assert re.search("^seed-lenticular +512x512 +64 +8 ", text, re.MULTILINE)


@pytest.mark.slow
def test_doctor_says_whether_a_render_would_run(lippmann):
    done = lippmann("doctor", "--json")
    assert done.code == 0
    assert done.json["ok"] is True
    said = lippmann("doctor").out
    assert "LLVM" in said
    for extra in ("cluster", "exchange", "heif", "molecules", "notebook", "usd", "volumes", "vtk"):
        assert f"extra {extra}" in said


@pytest.mark.slow
def test_version_and_help(lippmann):
    import lippmann as package

    assert lippmann("--version").out.strip() == f"lippmann {package.__version__}"
    for words in ((), *((name,) for name in ("render", "preview", "info", "views", "compose", "replay", "refocus"))):
        assert "-h, --help" in lippmann(*words, "-h").out


def test_what_is_split_or_refocused_is_named_after_the_picture(lippmann, picture, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for words, name in (
        (("views",), "views"),
        (("micro-images",), "micro-images"),
        (("refocus", "--plane", "0"), "refocused.png"),
        (("refocus", "--planes", "-5:5:2"), "planes"),
    ):
        assert lippmann(words[0], picture, *words[1:]).code == 0
        assert (tmp_path / f"{picture.stem}-{name}").exists()


def test_what_is_woven_is_named_after_its_views(lippmann, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cup").mkdir()
    for number in range(3):
        Image.fromarray(np.full((256, 256, 3), 40 * number, np.uint8)).save(tmp_path / "cup" / f"view_{number}.png")
    assert lippmann("weave", "cup", "--display", "seed-lenticular").code == 0
    assert (tmp_path / "cup-native.png").exists()
