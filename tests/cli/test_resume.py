"""``lippmann render --resume``: real processes, really killed."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from lippmann.image import read_picture
from lippmann.journal import TileGrid, TileResult, TileStore, journal_of

#: 32 tiles of 128 x 128 pixels; a run takes a few seconds, most of them for starting.
WORDS = ("--integrator", "direct", "--method", "full", "--spp", "1", "--resume", "--quiet", "--threads", "1")


@pytest.fixture(scope="module")
def display(tmp_path_factory):
    path = tmp_path_factory.mktemp("display") / "wide.toml"
    text = "[panel]\nwidth = 1024\nheight = 512\npixel_pitch = 0.25\n[lens_array]\nlayout = 'lenticular'\npitch = 2.0\n"
    path.write_text('name = "wide"\ngap = 6.8\naperture_distance = 10.0\n' + text)
    return path


def command(display, output, *more):
    words = ("render", "small-balls", "--display", display, *WORDS, *more, "-o", output)
    return [sys.executable, "-c", "from lippmann.cli import main; main()", *(str(word) for word in words)]


@pytest.fixture(scope="module", params=["a.tif", "a.zarr"])
def unbroken(request, display, tmp_path_factory):
    """The file of a run that nothing interrupted."""
    path = tmp_path_factory.mktemp("unbroken") / request.param
    subprocess.run(command(display, path), check=True)
    return path


def content(path: Path) -> dict[str, bytes]:
    files = path.rglob("*") if path.is_dir() else [path]
    return {file.relative_to(path.parent).as_posix(): file.read_bytes() for file in files if file.is_file()}


@dataclass
class Harness:
    """Kills runs of one picture at random moments, and begins it anew whenever it was finished.

    ``finished``: pictures that were whole in the end. ``tiles``: how many there were after each kill.
    """

    display: Path
    output: Path
    expected: dict[str, bytes]
    random: random.Random
    finished: int = 0
    kills: int = 0
    tiles: list[int] = field(default_factory=list)

    def run_and_kill(self) -> None:
        before = self._tiles()
        process = subprocess.Popen(command(self.display, self.output), stderr=subprocess.PIPE)
        if self.random.random() < 0.8:
            # Starting is most of a run; it is the tiles that are to be hit.
            self._wait_for_work(process, before)
            pause = self.random.uniform(0, 1.5)
        else:
            pause = self.random.uniform(0, 4)
        try:
            process.wait(pause)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            self.kills += 1
        error = process.communicate()[1].decode()
        assert process.returncode in (0, -signal.SIGKILL), error
        if process.returncode == 0:
            self._check_finished()
            return
        after = self._tiles()
        self.tiles.append(len(after))
        if self.output.exists():
            # It was killed between putting the file in its place and leaving: what is there is whole.
            assert content(self.output) == self.expected
            self.finish()
            return
        assert before <= after

    def finish(self) -> None:
        """What the kills have left is made into the same picture."""
        subprocess.run(command(self.display, self.output), check=True)
        self._check_finished()

    def _check_finished(self) -> None:
        assert content(self.output) == self.expected
        # Nothing half is left beside it.
        assert [path.name for path in self.output.parent.iterdir()] == [self.output.name]
        self.finished += 1
        for path in sorted(self.output.rglob("*"), reverse=True) if self.output.is_dir() else ():
            path.rmdir() if path.is_dir() else path.unlink()
        self.output.rmdir() if self.output.is_dir() else self.output.unlink()

    def _tiles(self) -> set[str]:
        folder = journal_of(self.output)
        return {path.name for path in folder.glob("r*.tile")} if folder.is_dir() else set()

    def _wait_for_work(self, process: subprocess.Popen[bytes], before: set[str]) -> None:
        while process.poll() is None and self._tiles() == before and not self.output.exists():
            time.sleep(0.02)


@pytest.fixture
def harness(display, unbroken, tmp_path):
    return Harness(display, tmp_path / unbroken.name, content(unbroken), random.Random(unbroken.name))


@pytest.mark.long
def test_two_hundred_random_kills_harm_nothing(harness):
    while harness.kills < 100:  # for each of two formats
        harness.run_and_kill()
    harness.finish()
    assert harness.finished > 3
    assert len(set(harness.tiles)) > 10


@pytest.mark.long
def test_an_interrupted_run_says_what_is_kept(display, tmp_path):
    output = tmp_path / "a.tif"
    words = [word for word in command(display, output, "--integrator", "path", "--spp", "64") if word != "--quiet"]
    process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not list(journal_of(output).glob("r*.tile")):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    error = process.communicate()[1]
    assert process.returncode == 130
    assert "finished tiles are kept in a.tif.parts: with --resume the command goes on" in error
    assert not output.exists()
    assert os.listdir(tmp_path) == ["a.tif.parts"]


# ---- In this process ---------------------------------------------------------------------------------------------


@pytest.mark.long
def test_the_command_says_how_much_was_found(lippmann, engine, tmp_path):
    words = ("render", "small-balls", "--integrator", "direct", "--method", "full", "--spp", 1, "--resume", "--json")
    done = lippmann(*words, "-o", tmp_path / "a.png")
    assert done.code == 0
    assert done.json["tiles"] == {"made": 16, "found": 0}
    assert done.json["size"] == [512, 512]
    assert read_picture(tmp_path / "a.png").provenance.spp == 1


@pytest.mark.slow
def test_pictures_beyond_the_memory_go_to_tiles(lippmann, engine, display, tmp_path):
    words = ("render", "small-balls", "-d", display, "--integrator", "normal", "--spp", 1, "--memory", "16M", "-o")
    done = lippmann(*words, tmp_path / "a.tif", "--json")
    assert done.code == 0
    assert done.json["tiles"]["made"] == 32


def test_what_is_made_from_neighbours_goes_to_tiles_sooner():
    from lippmann.cli.commands.render import is_tiled
    from lippmann.display import load_display
    from lippmann.rendering.request.render_request import RenderRequest

    def asked(**more):
        request = RenderRequest(**{"memory": 1 << 30} | more)
        return is_tiled("tiff", load_display("panel-4k"), request, resume=False)

    assert not asked()
    assert asked(method="pooled", denoise="auto")
    assert asked(denoise="oidn")
    assert not asked(method="auto", denoise="auto")
    # Sub-pixels keep three times as much, where they are denoised.
    assert not asked(memory=5 << 29, denoise="oidn")
    assert asked(memory=5 << 29, denoise="oidn", subpixels=True)
    assert not asked(memory=5 << 29, subpixels=True)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--method", "lens-view"), "--method: lens-view needs the whole picture"),
        (("--maps", "m"), "--maps: needs the whole picture at once"),
        (("--layers",), "--layers"),
        (("--quality-worst", 40), "--quality-worst: 40.0 needs the whole picture"),
        (("--order", "paper"), "--order: paper needs the whole picture"),
        (("--bits", 12), "12 bits per channel are not possible"),
    ],
)
def test_what_tiles_cannot_do_is_refused_before_anything_is_rendered(lippmann, tmp_path, words, said):
    done = lippmann("render", "small-balls", "--resume", *words, "-o", tmp_path / "a.tif")
    assert done.code == 2
    assert said in done.err
    assert list(tmp_path.iterdir()) == []


def test_a_changed_command_is_refused_by_what_differs(lippmann, engine, tmp_path):
    output = tmp_path / "a.tif"
    with TileStore.open(output, {"spp": "9"}, TileGrid(512, 512, 128), resume=False) as store:
        store.put(TileResult(0, np.zeros((128, 128, 3), np.uint8)))
    done = lippmann("render", "small-balls", "--spp", 1, "--resume", "-o", output)
    assert done.code == 2
    assert "the unfinished picture is another one" in done.err
    assert "spp (was 9, is 1)" in done.err
    assert lippmann("render", "small-balls", "--spp", 1, "--memory", "10M", "-o", output).code == 2


# ---- Links and foreign files beside the output -------------------------------------------------------------------


@pytest.fixture
def small(cut_display):
    """The words of a quick command, but for its output: two tiles."""
    words = ("render", "small-balls", "-d", cut_display(160, 128), "--integrator", "normal", "--spp", 1)
    return (*words, "--device", "cpu", "--resume", "-o")


@pytest.fixture
def begun(lippmann, engine, small, tmp_path, monkeypatch):
    """The output of a command that was interrupted after the first of its two tiles."""
    from lippmann.tiles import tiled_render

    render_here, output = tiled_render.render_here, tmp_path / "out" / "a.png"
    output.parent.mkdir()

    def stop(prepared, missing, put):
        render_here(prepared, missing[:1], put)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(tiled_render, "render_here", stop)
        assert lippmann(*small, output).code == 130
    assert sorted(os.listdir(journal_of(output))) == ["job.json", "lock", "r0000_c0000.tile"]
    return output


@pytest.mark.slow
def test_a_journal_that_is_a_link_is_refused_in_one_line(lippmann, begun, small):
    journal_of(begun).rename(begun.parent / "elsewhere")
    journal_of(begun).symlink_to(begun.parent / "elsewhere")
    done = lippmann(*small, begun)
    assert done.code == 2
    (line,) = done.err.splitlines()
    assert "this is no journal of an unfinished picture: it is a symbolic link; " in line
    assert sorted(os.listdir(begun.parent / "elsewhere")) == ["job.json", "lock", "r0000_c0000.tile"]


def test_a_folder_of_the_users_is_refused_before_anything_is_rendered(lippmann, small, tmp_path):
    folder = journal_of(tmp_path / "a.png")
    folder.mkdir(mode=0o755)
    (folder / "notes.txt").write_text("mine")
    done = lippmann(*small, tmp_path / "a.png")
    assert done.code == 2
    (line,) = done.err.splitlines()
    assert "it holds 'notes.txt' and no job.json; " in line
    assert "choose another name for the picture, or move what lies there" in line
    assert (folder / "notes.txt").read_text() == "mine"
    assert not (tmp_path / "a.png").exists()


@pytest.mark.slow
def test_what_the_user_puts_into_a_journal_stays(lippmann, begun, small):
    (journal_of(begun) / "notes.txt").write_text("mine")
    done = lippmann(*small, begun)
    assert done.code == 0
    assert "the folder a.png.parts stays: it holds 'notes.txt', which is no part of the journal" in done.err
    assert os.listdir(journal_of(begun)) == ["notes.txt"]
    assert begun.exists()


def test_a_sequences_journal_that_is_a_link_is_refused_in_one_line(lippmann, engine, moving_ball, small, tmp_path):
    (tmp_path / "precious.txt").write_text("mine")
    (tmp_path / "f_%d.png.journal").symlink_to(tmp_path / "precious.txt")
    words = [moving_ball if word == "small-balls" else word for word in small if word != "--resume"]
    done = lippmann(*words, tmp_path / "f_%d.png", "--frames", "0:2")
    assert done.code == 2
    (line,) = done.err.splitlines()
    assert "this is no journal of an unfinished sequence: it is a symbolic link; " in line
    assert (tmp_path / "precious.txt").read_text() == "mine"
