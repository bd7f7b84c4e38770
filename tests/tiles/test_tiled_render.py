"""Pictures rendered tile by tile into files: byte for byte the same, whatever came between."""

from __future__ import annotations

import errno
import random
import shutil
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from lippmann import api
from lippmann.codecs import tiff
from lippmann.display import load_display
from lippmann.errors import EngineError, MemoryLimitError, OutputError, PictureError
from lippmann.image import read_picture
from lippmann.journal import journal_of
from lippmann.progress import Progress
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.tiles import job as tiles
from lippmann.tiles import tiled_render
from lippmann.tiles.tiled_render import render_to_file

#: 12 tiles of 32 x 32 pixels, all alike.
DISPLAY = load_display("seed-lenticular").resized(128, 96)
SIDE = 32
SETTINGS = RenderRequest(method="full", integrator="direct", spp=2, memory=1 << 30, tone_map="none")
TILES = 12


@pytest.fixture(scope="module", autouse=True)
def small_tiles():
    """As small pictures, cut into as many tiles, as a test can do with."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiles, "SIDES", (SIDE,))
        patch.setattr(tiled_render, "SIDES", (SIDE,))
        yield


@pytest.fixture(scope="module")
def scene(engine, tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "ball.ply"
    trimesh.creation.icosphere(subdivisions=2).export(path)
    return api.load_scene(path)


@pytest.fixture(scope="module")
def render(scene):
    def call(output, settings=SETTINGS, display=DISPLAY, **options):
        return render_to_file(scene, display, settings, output, **options)

    return call


@pytest.fixture(scope="module")
def unbroken(render, small_tiles, tmp_path_factory):
    """The file of a run that nothing interrupted."""
    path = tmp_path_factory.mktemp("unbroken") / "a.tif"
    assert render(path).tiles == TILES
    return path.read_bytes()


def content(path: Path) -> dict[str, bytes]:
    files = path.rglob("*") if path.is_dir() else [path]
    return {file.relative_to(path.parent).as_posix(): file.read_bytes() for file in files if file.is_file()}


class StopError(Exception):
    """Ends a run in a test."""


def stopping_after(count: int):
    """A runner that renders so many tiles, in any order, and fails."""

    def run(prepared, missing, put):
        order = list(missing)
        random.Random(count).shuffle(order)
        tiled_render.render_here(prepared, order[:count], put)
        raise StopError

    return run


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.png", "a.exr", "a.tif", "a.zarr"])
def test_tiles_and_one_piece_give_the_same_file(render, scene, tmp_path, name):
    folders = tmp_path / "tiles", tmp_path / "whole"
    for folder in folders:
        folder.mkdir()
    render(folders[0] / name)
    api.render(scene, DISPLAY, method="full", integrator="direct", spp=2, tone_map="none").save(folders[1] / name)
    assert content(folders[0] / name) == content(folders[1] / name)
    assert {path.name for path in folders[0].iterdir()} == {name}


def test_large_tiffs_are_tiled_and_the_same_too(render, scene, tmp_path, monkeypatch):
    monkeypatch.setattr(tiff, "TILED_FROM", 1000)
    monkeypatch.setattr(tiff, "TILE", 64)
    one, two = tmp_path / "tiles.tif", tmp_path / "whole.tif"
    render(one)
    image = api.render(scene, DISPLAY, method="full", integrator="direct", spp=2, tone_map="none")
    image.save(two)
    assert one.read_bytes() == two.read_bytes()
    import tifffile

    with tifffile.TiffFile(one) as file:
        assert file.is_bigtiff
        assert (file.pages[0].tilewidth, file.pages[0].tilelength) == (64, 64)
    again = read_picture(one)
    assert again.provenance == replace(image.provenance, seconds={})
    assert np.abs(again.pixels - image.pixels.clip(0, 1)).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "stops", [pytest.param((0,), marks=pytest.mark.long), pytest.param((5, 4), marks=pytest.mark.long), (TILES,)]
)
def test_an_interrupted_run_gives_the_same_file(render, unbroken, tmp_path, stops):
    output = tmp_path / "a.tif"
    done = 0
    for count in stops:
        with pytest.raises(StopError):
            render(output, runner=stopping_after(count), resume=True)
        done += count
    assert not output.exists()
    finished = render(output, resume=True)
    assert finished.resumed == min(done, TILES)
    assert output.read_bytes() == unbroken
    assert list(tmp_path.iterdir()) == [output]


def test_the_order_of_tiles_and_threads_of_a_runner_do_not_matter(render, unbroken, tmp_path):
    from lippmann.tiles.tile_render import pack, trace_tile

    def backwards(prepared, missing, put):
        with ThreadPoolExecutor(3) as pool:
            for index in reversed(missing):
                pool.submit(put, pack(prepared, trace_tile(prepared, index))).result()

    render(tmp_path / "a.tif", runner=backwards)
    assert (tmp_path / "a.tif").read_bytes() == unbroken


def test_an_existing_picture_stays_until_the_new_one_is_whole(render, unbroken, tmp_path):
    output = tmp_path / "a.tif"
    output.write_bytes(b"old")
    with pytest.raises(StopError):
        render(output, runner=stopping_after(3), resume=True)
    assert output.read_bytes() == b"old"
    render(output, resume=True)
    assert output.read_bytes() == unbroken


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["truncated", "flipped"])
def test_a_damaged_tile_is_rendered_anew(render, unbroken, tmp_path, damage):
    output = tmp_path / "a.tif"
    with pytest.raises(StopError):
        render(output, runner=stopping_after(TILES), resume=True)
    path = sorted(journal_of(output).glob("*.tile"))[7]
    data = path.read_bytes()
    path.write_bytes(data[:100] if damage == "truncated" else data[:-50] + bytes([data[-50] ^ 8]) + data[-49:])
    render(output, resume=True)
    assert output.read_bytes() == unbroken


def test_a_tile_of_unknown_rays_is_damaged_and_rendered_anew(render, unbroken, tmp_path):
    output, calls = tmp_path / "a.tif", []

    def run(prepared, missing, put):
        calls.append(list(missing))

        def spoilt(tile):
            put(replace(tile, rays={"sideways": 1}) if tile.index == 7 and len(calls) == 1 else tile)

        tiled_render.render_here(prepared, missing, spoilt)

    render(output, runner=run)
    assert calls == [list(range(TILES)), [7]]
    assert output.read_bytes() == unbroken


def test_a_runner_that_forgets_tiles_makes_no_file(render, tmp_path):
    with pytest.raises(EngineError, match="again and again"):
        render(tmp_path / "a.tif", runner=lambda prepared, missing, put: None)
    assert not (tmp_path / "a.tif").exists()


def test_a_disk_that_fills_while_the_file_is_written_harms_nothing(render, unbroken, tmp_path, monkeypatch):
    output = tmp_path / "a.tif"

    def full(path, *others, **options):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(tiled_render, "encode_values", full)
    with pytest.raises(OutputError, match="no space is left"):
        render(output)
    monkeypatch.undo()
    assert list(tmp_path.iterdir()) == [journal_of(output)]
    assert render(output, resume=True).resumed == TILES
    assert output.read_bytes() == unbroken


@pytest.mark.slow
def test_a_copy_of_the_folder_taken_at_a_random_moment_can_be_finished(render, unbroken, tmp_path):
    output = tmp_path / "first" / "a.tif"
    output.parent.mkdir()
    copies: list[Path] = []

    def copy(report: Progress) -> None:
        if report.stage == "tiles" and report.done in (1, 6, 11):
            copies.append(tmp_path / f"copy{len(copies)}")
            shutil.copytree(output.parent, copies[-1], copy_function=copy_what_is_there)

    def copy_what_is_there(source: str, target: str) -> None:
        # Another thread may just have renamed its temporary file.
        with suppress(FileNotFoundError):
            shutil.copy2(source, target)

    render(output, progress=copy)
    for number, folder in enumerate(copies):
        # A power cut may leave the last file cut short, too.
        last = max(journal_of(folder / "a.tif").glob("*.tile"), key=lambda path: path.stat().st_mtime)
        if number:
            last.write_bytes(last.read_bytes()[: 37 * number])
        render(folder / "a.tif", resume=True)
        assert (folder / "a.tif").read_bytes() == unbroken


@pytest.mark.long
def test_another_picture_is_refused_by_what_differs(render, tmp_path):
    output = tmp_path / "a.tif"
    with pytest.raises(StopError):
        render(output, runner=stopping_after(1), resume=True)
    with pytest.raises(PictureError, match=r"seed \(was 0, is 1\)"):
        render(output, settings=replace(SETTINGS, seed=1), resume=True)
    with pytest.raises(PictureError, match=r"the display's gap \(was 6.8, is 7.0\)"):
        render(output, display=replace(DISPLAY, gap=7.0), resume=True)
    with pytest.raises(PictureError, match="values"):
        render(output, bits=16, resume=True)
    with pytest.raises(OutputError, match="unfinished"):
        render(output)
    # What a tile's side was chosen by may be different now.
    assert render(output, settings=replace(SETTINGS, memory=1 << 40), resume=True).resumed == 1


def test_formats_that_are_written_whole_have_to_fit(render, tmp_path):
    large = DISPLAY.resized(16_000, 8_000)
    settings = replace(SETTINGS, memory=1 << 28)
    with pytest.raises(MemoryLimitError, match=r"ending \.tif or \.zarr"):
        render(tmp_path / "a.png", display=large, settings=settings)
    assert list(tmp_path.iterdir()) == []
