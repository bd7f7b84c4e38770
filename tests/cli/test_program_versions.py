"""The programs that a picture's bytes depend on: the part of the fingerprint that names them."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib.metadata import version

import pytest

from lippmann.errors import PictureError
from lippmann.journal import journal_of
from lippmann.rendering.denoise.oidn import denoiser_version
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime import engine as engines
from lippmann.sequences.files import saved_sequence
from lippmann.sequences.motion import open_motion
from lippmann.tiles import tiled_render
from lippmann.tiles.job import made_by


def test_llvm_and_the_denoiser_are_named_only_where_they_are_used():
    assert not {"LLVM", "Open Image Denoise"} & set(made_by("a GPU"))
    found = made_by("cpu", llvm="17.0.6", denoiser="2.5.1")
    assert found["LLVM"] == "17.0.6"
    assert found["Open Image Denoise"] == "2.5.1"


def test_the_denoisers_version_names_the_library_and_its_package():
    said = denoiser_version()
    assert said is not None
    library, _, package = said.partition(" ")
    assert package == f"(pyoidn {version('pyoidn')})"
    assert [part.isdigit() for part in library.split(".")] == [True] * 3


def test_without_the_denoiser_there_is_no_version(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    assert denoiser_version() is None


def test_a_denoiser_whose_library_does_not_load_has_no_version(monkeypatch):
    def fails():
        raise OSError("cannot load library 'libOpenImageDenoise.so'")

    monkeypatch.setattr("lippmann.runtime.open_image_denoise.load", fails)
    assert denoiser_version() is None


class Stopped(Exception):  # noqa: N818 - stands for whatever ends a run
    """Ends a run after its first tile."""


@pytest.fixture
def stopping(monkeypatch):
    """Run a function that renders in tiles; it ends after the first tile."""
    render_here = tiled_render.render_here

    def stop(prepared, missing, put):
        render_here(prepared, missing[:1], put)
        raise Stopped

    def run(function, *words, **options):
        with monkeypatch.context() as patch:
            patch.setattr(tiled_render, "render_here", stop)
            return function(*words, **options)

    return run


@pytest.fixture
def other_llvm(monkeypatch):
    """Let the engine say that it runs on LLVM 99."""

    def change():
        start = engines.start
        monkeypatch.setattr(engines, "start", lambda *words: replace(start(*words), llvm_version="99.0.0"))

    return change


@pytest.fixture
def begun(lippmann, engine, cut_display, tmp_path, stopping):
    """The words of a command that was interrupted after its first tile, and its output."""

    def begin(*more):
        output = tmp_path / "out" / "a.tif"
        output.parent.mkdir()
        words = ("render", "small-balls", "-d", cut_display(160, 128), "--device", "cpu", "--integrator", "direct")
        words = (*words, "--spp", 1, "--resume", *more, "-o", output)
        assert stopping(lippmann, *words).code == 1
        assert len(list(journal_of(output).glob("r*.tile"))) == 1
        return words, output

    return begin


@pytest.mark.long
def test_a_picture_begun_with_another_llvm_is_refused(lippmann, engine, begun, other_llvm):
    words, output = begun()
    other_llvm()
    done = lippmann(*words)
    assert done.code == 2
    assert f"the unfinished picture is another one: LLVM (was {engine.llvm_version}, is 99.0.0)" in done.err
    assert not output.exists()


@pytest.mark.long
def test_a_picture_begun_with_another_denoiser_is_refused(lippmann, begun, monkeypatch):
    words, output = begun("--denoise", "oidn-fast")
    monkeypatch.setattr("lippmann.rendering.denoise.oidn.denoiser_version", lambda: "99.0.0 (pyoidn 99.0.0)")
    done = lippmann(*words)
    assert done.code == 2
    assert "the unfinished picture is another one: Open Image Denoise (was 2." in done.err
    assert "is 99.0.0 (pyoidn 99.0.0))" in done.err
    assert not output.exists()


@pytest.mark.long
def test_a_picture_without_a_denoiser_is_gone_on_with_by_another_one(lippmann, begun, monkeypatch):
    words, output = begun("--denoise", "none")
    monkeypatch.setattr("lippmann.rendering.denoise.oidn.denoiser_version", lambda: "99.0.0 (pyoidn 99.0.0)")
    assert lippmann(*words).code == 0
    assert output.exists()


@pytest.mark.slow
@pytest.mark.parametrize("changed", ["LLVM", "Open Image Denoise"])
def test_a_sequence_begun_with_other_programs_is_refused(
    engine, moving_ball, make_display, tmp_path, other_llvm, monkeypatch, changed
):
    def frames():
        with saved_sequence(
            open_motion(moving_ball),
            tmp_path / "f_%d.png",
            lambda number: tmp_path / f"f_{number}.png",
            make_display(lenses=(4, 3)),
            range(2),
            RenderRequest(integrator="direct", spp=1, device="cpu"),
            resume=True,
        ) as saved:
            next(iter(saved))

    frames()
    if changed == "LLVM":
        other_llvm()
    else:
        monkeypatch.setattr("lippmann.rendering.denoise.oidn.denoiser_version", lambda: "99.0.0")
    with pytest.raises(PictureError, match=rf"the unfinished sequence is another one: {changed} \(was [2-9.]*"):
        frames()
