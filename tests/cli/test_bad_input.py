"""Bad input: one line that says what to do, exit code 2, nothing written, nothing lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

FAST = ("--integrator", "normal", "--spp", "1")


def refuse(outcome, *words):
    """The command was refused in one line that holds all ``words``."""
    assert outcome.code == 2, outcome.err
    assert outcome.out == ""
    lines = outcome.err.strip().splitlines()
    assert len(lines) == 1, outcome.err
    assert lines[0].startswith("lippmann: ")
    for word in words:
        assert word in lines[0], outcome.err


@pytest.fixture
def kept(tmp_path):
    """An older picture in the place of the output, which no refusal may touch."""
    path = tmp_path / "out.png"
    path.write_bytes(b"older")
    yield path
    assert path.read_bytes() == b"older"
    assert {entry.name for entry in tmp_path.iterdir() if "part" in entry.name} == set()


def test_an_output_without_its_option_is_told_of_it(lippmann, kept):
    refuse(lippmann("info", "a.png", "b.png"), "extra argument(s) (b.png); see 'lippmann info --help'")
    refuse(lippmann("render", "teapot", kept.name), f"{kept.name}; outputs are named by -o: -o {kept.name}; see")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("weave", "views", "-d", "print", "--lpi", "60"),
            "--lpi: this command takes a print in one word: print:lpi",
        ),
        (("proof", "--lpi", "60"), "print:lpi=60,ppi=720,size=200x300mm"),
        (("render", "teapot", "--dpi", "300"), "--dpi: it is called --ppi here"),
    ],
)
def test_options_of_other_commands_and_programs_are_known(lippmann, words, said):
    refuse(lippmann(*words), said)


@pytest.mark.parametrize(
    ("words", "where"),
    [
        (("render", ""), "an argument"),
        (("render", "teapot", "--display", ""), "--display"),
        (("render", "teapot", "-o", ""), "-o"),
        (("quilt", "render", "teapot", "--display="), "--display"),
    ],
)
def test_nothing_is_not_taken_for_this_folder(lippmann, words, where):
    refuse(lippmann(*words), f"{where}: is empty; give it a value, or leave it out")


@pytest.mark.parametrize("words", [("quilt",), ("quilt", "model.glb"), ("calibrate",)])
def test_a_group_of_commands_names_them(lippmann, words):
    known = {"quilt": "render, pack, unpack, sizes", "calibrate": "pattern, page"}[words[0]]
    refuse(lippmann(*words), "command", f"Known are {known}; see")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("missing.glb", None),
        ("empty.glb", b""),
        ("truncated.glb", b"glTF\x02\x00\x00\x00\xff\x00\x00\x00"),
        ("foreign.glb", b"\x89PNG\r\n\x1a\n" + bytes(64)),
        ("foreign.gltf", b"no json"),
        ("empty.obj", b""),
        ("foreign.ply", b"solid"),
        ("truncated.stl", bytes(80) + b"\x05\x00\x00\x00" + bytes(20)),
        ("foreign.xml", b"<html></html>"),
        ("unknown.blend", b"BLENDER"),
        ("n" * 300 + ".obj", None),
        ("n" * 300, None),
    ],
)
def test_scene_files_that_will_not_do(lippmann, tmp_path, kept, name, content):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    refuse(lippmann("render", path, *FAST, "-o", kept), "" if len(name) > 255 else name)


def test_a_damaged_texture_is_named(lippmann, tmp_path, kept):
    (tmp_path / "a.mtl").write_text("newmtl wood\nmap_Kd cut.png\n")
    (tmp_path / "cut.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    obj = tmp_path / "a.obj"
    obj.write_text("mtllib a.mtl\nusemtl wood\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
    refuse(lippmann("render", obj, *FAST, "-o", kept), "cut.png")


def test_nan_vertices(lippmann, tmp_path, kept):
    obj = tmp_path / "a.obj"
    obj.write_text("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    refuse(lippmann("render", obj, *FAST, "-o", kept), "a.obj", "nan")


def test_a_scene_without_geometry(lippmann, tmp_path, kept):
    obj = tmp_path / "a.obj"
    obj.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n")
    refuse(lippmann("render", obj, *FAST, "-o", kept), "a.obj")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("gap = 0", ("gap",)),
        ("gap = -1.0", ("gap",)),
        ("gap = '3 parsec'", ("display.toml:1", "parsec")),
        ("gap = 3\nfocus = 4", ("focus",)),
        ("gap = 3\n[lens_array]\nlayout = 'lenticular'\npitch = 0", ("pitch",)),
        ("gap = 3\n[panel]\nwidth = 0\nheight = 5\npixel_pitch = 0.1", ("width",)),
        (
            "gap = 3\n[panel]\nwidth = 5\nheight = 5\npixel_pitch = 0.1\n[lens_array]\nlayout = 'square'\npitch = 2",
            ("pixels", "5"),
        ),
        ("gap = ", ("display.toml",)),
    ],
)
def test_displays_that_cannot_be(lippmann, tmp_path, kept, text, words):
    base = "[panel]\nwidth = 64\nheight = 64\npixel_pitch = 0.1\n"
    lenses = "[lens_array]\nlayout = 'square'\npitch = 0.8\n"
    whole = text + "\n" + ("" if "[panel]" in text else base) + ("" if "[lens_array]" in text else lenses)
    path = tmp_path / "display.toml"
    path.write_text(whole)
    refuse(lippmann("render", "teapot", "--display", path, *FAST, "-o", kept), *words)


def test_an_unknown_display_suggests_a_known_one(lippmann, kept):
    refuse(lippmann("render", "teapot", "--display", "seed-lenticluar", *FAST, "-o", kept), "seed-lenticular")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--spp", "0"), "--spp"),
        (("--spp", "many"), "--spp: 'many'; must be a whole number"),
        (("--quality", "good"), "--quality: 'good'; must be a number"),
        (("--depth", "far.png"), "--depth: 'far.png'; must be a whole number; for a map of depths --depth-map"),
        (("--integrator", "magic"), "magic"),
        (("--method", "guess"), "guess"),
        (("--depth", "0"), "--depth"),
        (("--memory", "lots"), "--memory"),
        (("--memory", "1M"), "raise the limit, or give the output the ending .tif or .zarr"),
        (("--background", "1,2"), "--background"),
        (
            ("--background", "255,255,255"),
            "--background: (255.0, 255.0, 255.0); must be three numbers from 0 to 1, linear: 1,1,1 is white",
        ),
        (("--pop-out", "2"), "pop"),
        (("--scale", "0"), "scale"),
        (("--turn", "a"), "--turn"),
        (("--camera", "nobody"), "unknown camera 'nobody'; known are main"),
        (("--device", "abacus"), "abacus"),
        (("--environment", "gone.exr"), "gone.exr"),
        (("--environment", str(Path(__file__).parent)), "is a folder, no picture; OpenEXR"),
        (("--display", "d" * 300 + ".toml"), "dddd"),
        (("--frobnicate",), "--frobnicate"),
    ],
)
def test_options_that_will_not_do(lippmann, kept, engine, words, named):
    refuse(lippmann("render", "teapot", "--spp", "1", *words, "-o", kept), named)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--eye", "0,0,-600"), "--eye: 0,0,-600; must be in front of the lens plane"),
        (("--pixels", "99999x9"), "--pixels: 99999x9; both sides must be 1 to 65535"),
    ],
)
def test_no_eye_behind_the_display_and_no_endless_preview(lippmann, kept, words, named):
    refuse(lippmann("preview", "no.glb", *words, "-o", kept), named)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--display", "panel-4k"), "--display: is for a display"),
        (("--turn", "30"), "--turn: is for a display"),
        (("--eye", "0,0,600"), "--eye: is for a display"),
    ],
)
def test_a_plain_picture_has_no_options_of_a_display(lippmann, kept, words, named):
    refuse(lippmann("preview", "teapot", "--plain", *words, "-o", kept), named)


def test_an_unknown_output_format(lippmann, tmp_path):
    refuse(lippmann("render", "teapot", *FAST, "-o", tmp_path / "out.bmp"), ".bmp", "png")
    assert list(tmp_path.iterdir()) == []


def test_an_output_folder_that_is_not_there(lippmann, tmp_path):
    refuse(lippmann("render", "teapot", *FAST, "-o", tmp_path / "no" / "out.png"), "no")


def test_an_output_folder_that_cannot_be_written(lippmann, tmp_path):
    if os.geteuid() == 0:
        folder = Path("/proc/self")  # the superuser may write everywhere but here
    else:
        folder = tmp_path / "locked"
        folder.mkdir(mode=0o500)
    refuse(lippmann("render", "teapot", *FAST, "-o", folder / "out.png"), "out.png")


@pytest.mark.slow
@pytest.mark.parametrize("delay", [2.0, pytest.param(4.0, marks=pytest.mark.long)])
def test_ctrl_c_in_the_middle(tmp_path, delay):
    out = tmp_path / "out.png"
    out.write_bytes(b"older")
    command = [sys.executable, "-c", "from lippmann.cli import main; print('begun', flush=True); main()"]
    words = ["render", "teapot", "--spp", "65536", "-o", str(out)]
    process = subprocess.Popen([*command, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    # A busy machine takes its time to get to the command. Early on it meets loading and compiling, later the tracing;
    # all end alike.
    assert process.stdout.readline() == "begun\n"
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=300)
    assert (process.returncode, err) == (130, "lippmann: stopped; nothing was written\n")
    assert out.read_bytes() == b"older"
    assert [entry.name for entry in tmp_path.iterdir()] == ["out.png"]


def test_pictures_that_will_not_do(lippmann, tmp_path, kept):
    from PIL import Image

    plain = tmp_path / "plain.png"
    Image.new("RGB", (8, 8)).save(plain)
    refuse(lippmann("replay", plain, "-o", kept), "plain.png", "--display")
    refuse(lippmann("replay", plain, "--display", "seed-lenticular", "-o", kept), "plain.png", "512")
    cut = tmp_path / "cut.png"
    cut.write_bytes(plain.read_bytes()[:40])
    refuse(lippmann("info", cut), "cut.png")
    refuse(lippmann("info", tmp_path / "gone.png"), "gone.png")
    refuse(lippmann("compose", tmp_path, "-o", kept), str(tmp_path))


@pytest.mark.slow
def test_a_fault_of_the_program_is_one_line_and_exit_code_1(lippmann, picture, monkeypatch):
    import lippmann.image

    def broken(path):
        raise RuntimeError("wheels came off\nbadly")

    monkeypatch.setattr(lippmann.image, "open_file", broken)
    done = lippmann_run("info", str(picture))
    assert done == 1


def lippmann_run(*words):
    from lippmann.cli import run

    return run(list(words))
