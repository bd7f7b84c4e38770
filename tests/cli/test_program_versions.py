"""The programs that a picture's bytes depend on: the part of the fingerprint that names them."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib.metadata import version

import pytest

from lippmann.errors import PictureError
from lippmann.rendering.denoise.oidn import denoiser_version
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime import engine as engines
from lippmann.sequences.files import save_sequence
from lippmann.sequences.motion import open_motion
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


@pytest.fixture
def other_llvm(monkeypatch):
    """Let the engine say that it runs on LLVM 99."""

    def change():
        start = engines.start
        monkeypatch.setattr(engines, "start", lambda *words: replace(start(*words), llvm_version="99.0.0"))

    return change


@pytest.mark.slow
@pytest.mark.parametrize("changed", ["LLVM", "Open Image Denoise"])
def test_a_sequence_begun_with_other_programs_is_refused(
    engine, moving_ball, make_display, tmp_path, other_llvm, monkeypatch, changed
):
    def frames():
        with save_sequence(
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
