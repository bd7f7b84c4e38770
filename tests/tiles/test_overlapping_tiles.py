"""Tiles of pooled and denoised pictures: no seam, and the same bytes whoever renders them in whatever order."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from lippmann import api
from lippmann.codecs import tiff
from lippmann.display import load_display
from lippmann.errors import MemoryLimitError
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.tiles import job as tiles
from lippmann.tiles import tiled_render
from lippmann.tiles.job import make_job
from lippmann.tiles.margins import surroundings_of
from lippmann.tiles.tiled_render import render_to_file

#: Four tiles.
DISPLAY, SIDE = load_display("seed-lenticular").resized(128, 128), 64
SHARED = RenderRequest(method="pooled", denoise="oidn-fast", integrator="direct", spp=2, threads=2, tone_map="none")
DENOISED = replace(SHARED, method="full")
SUBPIXELS = replace(SHARED, subpixels=True)
WAYS = [
    pytest.param(SHARED, id="shared"),
    pytest.param(DENOISED, id="denoised"),
    pytest.param(SUBPIXELS, id="sub-pixels"),
]


def coded(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def job(settings, scene="teapot", side=SIDE, display=DISPLAY, **options):
    return make_job(api.load_scene(scene), display, settings, stored="float32", side=side, **options)


def in_tiles(settings):
    from lippmann.tiles.tile_render import prepare, trace_tile

    prepared = prepare(job(settings))
    pixels = np.full((128, 128, 3), np.nan, np.float32)
    for index, window in enumerate(prepared.job.grid):
        pixels[window.slices] = trace_tile(prepared, index).pixels
    return coded(pixels)


def in_one_piece(settings):
    asked = ("method", "denoise", "integrator", "spp", "seed", "threads", "subpixels", "tone_map")
    options = {name: getattr(settings, name) for name in asked}
    return coded(api.render("teapot", DISPLAY, memory=1 << 30, **options).pixels)


def steps(picture):
    """Mean absolute differences of neighbours across the borders of tiles, and at the same place of lenses inside."""
    found = []
    for axis, period in ((0, 1), (1, 8)):
        means = np.abs(np.diff(picture, axis=axis)).mean(axis=(1 - axis, 2))
        at = np.arange(1, len(means) + 1)
        border = at % SIDE == 0
        found.append((means[border].mean(), means[(at % period == 0) & ~border].mean()))
    return np.array(found)


# ---- Seams -------------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize("settings", WAYS)
def test_no_seam_is_measurable(settings, monkeypatch):
    asked = [replace(settings, seed=seed) for seed in range(3)]
    whole, tiled = ([steps(render(each)) for each in asked] for render in (in_one_piece, in_tiles))
    of_whole, of_tiled = np.mean(whole, axis=0), np.mean(tiled, axis=0)
    # Rows of the panel are all alike: there no border may show beside the inside.
    assert of_tiled[0, 0] <= of_tiled[0, 1]
    # Lenses are not: borders are to be what they are in a picture that has none, as are all other places.
    excess = of_tiled / of_whole - 1
    assert excess[:, 0].max() < 0.03
    assert np.abs(excess[:, 1]).max() < 0.01
    # Where tiles have nothing around them the same measure finds the seam.
    monkeypatch.setattr(tiles, "surroundings_of", lambda *of: replace(surroundings_of(*of), margin=0))
    assert (steps(in_tiles(asked[0])) / whole[0] - 1)[:, 0].max() > 0.1


@pytest.mark.long
@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize("settings", WAYS)
def test_tiles_have_the_samples_of_the_whole_picture(settings):
    one, other, tiled = in_one_piece(settings), in_one_piece(replace(settings, seed=5)), in_tiles(settings)
    # Had each tile random numbers of its own, it would differ as another seed does.
    assert np.square(tiled - one).mean() < 0.1 * np.square(other - one).mean()


@pytest.mark.slow
@pytest.mark.usefixtures("engine")
def test_a_window_has_the_pixels_of_the_whole():
    from lippmann.display.panel import PixelWindow
    from lippmann.rendering.film.sample_batches import BatchedRender
    from lippmann.tiles.tile_render import prepare

    prepared = prepare(job(replace(DENOISED, denoise="none"), side=128))
    window = PixelWindow(40, 25, 48, 33)
    pictures = []
    for source in (prepared.source, prepared.source.of_window(window)):
        batches = BatchedRender(prepared.integrator, source, memory=1 << 28)
        batches.add(2)
        pictures.append(batches.picture())
    assert np.array_equal(pictures[0][25:58, 40:88], pictures[1])


# ---- The same bytes ----------------------------------------------------------------------------------------------


@pytest.mark.long
def test_neither_threads_nor_order_matter(engine):
    code = """if True:
    import hashlib, sys
    sys.path.insert(0, sys.argv[3])
    from dataclasses import replace
    import test_overlapping_tiles as t
    from lippmann.tiles.tile_render import pack, prepare, trace_tile
    from lippmann.journal import encode
    threads, backwards = int(sys.argv[1]), sys.argv[2] == "backwards"
    for way in t.WAYS:
        prepared = prepare(t.job(replace(way.values[0], threads=threads)))
        order = range(3, -1, -1) if backwards else range(4)
        tiles = {index: encode(pack(prepared, trace_tile(prepared, index))) for index in order}
        print(way.id, hashlib.sha256(b"".join(tiles[index] for index in range(4))).hexdigest())
    """
    folder = str(__file__).rpartition("/")[0]
    said = {
        subprocess.run([sys.executable, "-c", code, *how, folder], capture_output=True, text=True, check=True).stdout
        for how in (("1", "forwards"), ("2", "backwards"))
    }
    assert len(said) == 1
    assert "shared" in said.pop()


class StopError(Exception):
    """Ends a run in a test."""


def stopping_after(count):
    def run(prepared, missing, put):
        tiled_render.render_here(prepared, missing[::-1][:count], put)
        raise StopError

    return run


@pytest.mark.slow
@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize(
    ("settings", "ending"), [(DENOISED, "tif"), pytest.param(SHARED, "zarr", marks=pytest.mark.long)]
)
def test_an_interrupted_run_gives_the_same_file(settings, ending, tmp_path, monkeypatch):
    for module in (tiles, tiled_render):
        monkeypatch.setattr(module, "SIDES", (SIDE, 32))
    monkeypatch.setattr(tiff, "TILED_FROM", 1000)
    monkeypatch.setattr(tiff, "TILE", SIDE)
    scene = api.load_scene("teapot")

    def render(name, memory=1 << 30, **options):
        asked = replace(settings, memory=memory)
        return render_to_file(scene, DISPLAY, asked, tmp_path / name, **options)

    def content(name):
        path = tmp_path / name
        files = sorted(path.rglob("*")) if path.is_dir() else [path]
        return [(file.relative_to(path), file.read_bytes()) for file in files if file.is_file()]

    assert render(f"one.{ending}").tiles == 4
    with pytest.raises(StopError):
        render(f"two.{ending}", runner=stopping_after(2), resume=True)
    # With so little memory another run would have begun with smaller tiles; this one goes on as it was begun.
    little = tiles.bytes_of_tile(32, DISPLAY, settings)
    assert render(f"two.{ending}", memory=little, resume=True).resumed == 2
    assert content(f"one.{ending}") == content(f"two.{ending}")
    assert job(settings, side=None).grid.side == SIDE


# ---- What the file says ------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("engine")
def test_the_sums_of_tiles_give_the_estimate_of_the_whole():
    from lippmann.rendering.estimate.denoised_psnr import PictureEstimator, estimate_denoised
    from lippmann.rendering.estimate.psnr import ErrorSums, PixelErrors
    from lippmann.tiles.tile_render import LENSES, OF_SAMPLES, SUMS, lens_sums

    random = np.random.default_rng(0)
    values, noisy, outliers, halves_variance = (
        random.exponential(0.01, (128, 128)).astype(np.float32) for _ in range(4)
    )
    errors = PixelErrors(values - 0.005, None, PixelErrors(noisy, outliers * 0.1), halves_variance * 0.1)
    made, lenses = job(DENOISED), DISPLAY.lens_grid
    sums = {before: ErrorSums.none(lenses.columns) for before in ("", OF_SAMPLES)}
    for window in made.grid:
        found = lens_sums(DISPLAY, window, errors.part(window.slices))
        for before, each in sums.items():
            for name in SUMS:
                getattr(each, name)[found[LENSES]] += found[before + name]
    whole = PictureEstimator(DISPLAY).estimate(errors, 64)
    assert estimate_denoised(sums[""], sums[OF_SAMPLES], (1, lenses.columns)).to_dict() == whole.to_dict()


@pytest.mark.slow
@pytest.mark.usefixtures("engine")
def test_the_file_says_how_it_was_made(tmp_path):
    from lippmann.image import read_picture

    found = render_to_file(api.load_scene("teapot"), DISPLAY, SHARED, tmp_path / "a.exr", runner=None)
    image = read_picture(tmp_path / "a.exr")
    made = image.provenance
    assert made.method == "pooled"
    assert {name: made.options[name] for name in ("denoise", "denoise_effort")} == {
        "denoise": "oidn",
        "denoise_effort": "fast",
    }
    assert made.options["tile_side"] >= 128
    assert made.options["tile_margin"] == surroundings_of(DISPLAY, SHARED).margin
    assert 20 < made.estimate["psnr"] < 60
    assert set(image.maps) == {"error", "samples"}
    assert found.provenance.rays == made.rays


# ---- How it is cut -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("settings", WAYS[:2])
def test_memory_chooses_the_side(settings):
    wide = DISPLAY.resized(34_000, 22_000)
    sides = [
        job(replace(settings, memory=memory << 20), display=wide, side=None).side for memory in (2000, 900, 300, 100)
    ]
    assert sides == sorted(sides, reverse=True)
    assert sides[0] == 1024
    assert sides[-1] < 512
    for side, memory in zip(sides, (2000, 900, 300, 100), strict=True):
        assert tiles.bytes_of_tile(side, wide, settings) <= memory << 20
    with pytest.raises(MemoryLimitError, match="too small for a tile"):
        job(replace(settings, memory=4 << 20), display=wide, side=None)


def test_sub_pixels_take_thrice_the_memory_under_cylinders():
    array = load_display("mla-square").resized(128, 128)
    under = [tiles.bytes_of_tile(SIDE, display, SUBPIXELS) for display in (DISPLAY, array)]
    assert under[0] == 3 * tiles.bytes_of_tile(SIDE, DISPLAY, SHARED)
    assert under[1] == tiles.bytes_of_tile(SIDE, array, SHARED)


def test_without_a_limit_free_memory_does_not_matter(monkeypatch):
    wide = DISPLAY.resized(34_000, 22_000)
    sides = []
    for free in (8 << 30, 64 << 30):
        monkeypatch.setattr(tiles, "memory_limit", lambda _, free=free: free)
        sides.append(job(SHARED, display=wide, side=None).side)
    assert sides == [1024, 1024]


def test_small_pictures_have_few_tiles():
    # Small tiles would be mostly what lies around them.
    assert job(SHARED, display=DISPLAY.resized(512, 512), side=None).side == 256


def test_how_it_is_cut_counts():
    prints = [job(SHARED, side=side).fingerprint("cpu") for side in (64, 128)]
    assert {name for name in prints[0] if prints[0][name] != prints[1][name]} == {"the tiles"}


@pytest.mark.long
def test_memory_does_not_grow_with_the_picture(tmp_path):
    code = """if True:
    import resource, sys
    from pathlib import Path
    from lippmann import api
    from lippmann.display import load_display
    display = load_display("seed-lenticular").resized(int(sys.argv[1]), 512)
    api.render_to_file("teapot", Path(sys.argv[2]), display, method="pooled", denoise="oidn-fast",
                       integrator="direct", spp=1, memory=200 << 20)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    """
    small, large = (
        int(
            subprocess.run(
                [sys.executable, "-c", code, str(width), str(tmp_path / f"{width}.tif")],
                capture_output=True,
                text=True,
                check=True,
            ).stdout
        )
        for width in (512, 2048)
    )
    # In KiB. The smaller one's windows are cut by its edges; in one piece the larger one would take 200 MiB more.
    assert large < small + (120 << 10)
