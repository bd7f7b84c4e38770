"""Tiles of a picture: the same whatever they are cut into, in whatever order, process or number of threads."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from lippmann import api
from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.errors import MemoryLimitError, UsageError
from lippmann.journal import TileGrid, content_hash, encode
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene import bundled
from lippmann.tiles.job import FEWEST_TILES, make_job

SETTINGS = RenderRequest(method="full", integrator="direct", spp=2, memory=1 << 30)
#: A display with lenses that no tile's edge respects.
DISPLAY = load_display("seed-lenticular").resized(128, 64)


def job(scene="small-balls", display=DISPLAY, settings=SETTINGS, stored="float32", **options):
    return make_job(api.load_scene(scene), display, settings, stored=stored, **options)


def rendered(made, order=None):
    from lippmann.tiles.tile_render import pack, prepare, trace_tile

    prepared = prepare(made)
    indices = range(len(made.grid)) if order is None else order
    return {index: pack(prepared, trace_tile(prepared, index)) for index in indices}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "side", "changes"),
    [
        # Tiles that are cut off at the edges; all others fit, to spare the compiler.
        pytest.param("small-balls", 48, {}, marks=pytest.mark.long),
        pytest.param("gears", 64, {"integrator": "path", "depth": 3, "spp": 3}, marks=pytest.mark.long),
        pytest.param(
            "small-balls", 64, {"integrator": "path", "depth": 4, "caustics": "photons"}, marks=pytest.mark.long
        ),
        ("teapot", 64, {"spp": 1, "subpixels": True}),
        ("tree", 64, {"integrator": "classic", "spp": 1, "pixel_filter": "point"}),
    ],
)
def test_tiles_make_the_picture_that_is_rendered_whole(engine, scene, side, changes):
    settings = replace(SETTINGS, **changes)
    names = ("integrator", "depth", "spp", "subpixels", "pixel_filter", "caustics")
    asked = {name: getattr(settings, name) for name in names}
    whole = api.render(scene, DISPLAY, method="full", memory=1 << 30, **asked).pixels
    made = job(scene, settings=settings, side=side)
    pixels = np.full_like(whole, np.nan)
    for index, tile in rendered(made).items():
        pixels[made.grid[index].slices] = tile.pixels
    assert np.array_equal(pixels, whole)


@pytest.mark.slow
def test_a_tile_is_the_same_in_any_order_and_after_pickling(engine):
    made = job(side=64)
    forwards = rendered(made)
    backwards = rendered(pickle.loads(pickle.dumps(made)), reversed(range(len(made.grid))))
    assert all(encode(forwards[index]) == encode(backwards[index]) for index in forwards)


def test_tiles_hold_what_the_file_will(engine):
    made = job(stored="uint16", side=64, keeps_maps=True)
    tile = rendered(made, [0])[0]
    assert tile.pixels.dtype == np.uint16
    assert tile.maps["error"].shape == (64, 64)
    assert tile.sums["pixels"].sum() == 64 * 64
    assert tile.rays["primary"] == 64 * 64 * 2


@pytest.mark.parametrize("layout", ["lenticular", "square", "hexagonal"])
def test_the_sums_of_tiles_give_the_estimate_of_the_whole(engine, layout):
    from lippmann.rendering.estimate.denoised_psnr import PictureEstimator
    from lippmann.rendering.estimate.psnr import ErrorSums, PixelErrors, estimate_plain
    from lippmann.tiles.tile_render import LENSES, SUMS, lens_sums

    display = Display("test", Panel(90, 70, 0.25), LensArray(layout, 1.9), gap=6.8, aperture_distance=5.0)
    rng = np.random.default_rng(0)
    values, outliers = (rng.exponential(0.01, (70, 90)).astype(np.float32) for _ in range(2))
    grid = display.lens_grid
    sums = ErrorSums.none(grid.rows * grid.columns)
    for window in TileGrid(90, 70, 32):
        errors = PixelErrors(values[window.slices], outliers[window.slices] * 0.5)
        found = lens_sums(display, window, errors)
        for name in SUMS:
            getattr(sums, name)[found[LENSES]] += found[name]
    whole = PictureEstimator(display).estimate(PixelErrors(values, outliers * 0.5), 64)
    assert estimate_plain(sums, (grid.rows, grid.columns)).to_dict() == whole.to_dict()


# ---- What a job is made of -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"scene": "gears"}, "the scene"),
        ({"display": replace(DISPLAY, gap=7.0)}, "the display's gap"),
        ({"settings": replace(SETTINGS, spp=3)}, "spp"),
        ({"settings": replace(SETTINGS, seed=1)}, "seed"),
        ({"settings": replace(SETTINGS, depth=2)}, "depth"),
        ({"settings": replace(SETTINGS, integrator="path", caustics="none")}, "caustics"),
        ({"settings": replace(SETTINGS, placement=PlacementOptions(shift=(0.0, 1.0, 0.0)))}, "placement shift"),
        ({"stored": "uint8"}, "values"),
    ],
)
def test_what_changes_the_picture_changes_the_fingerprint(change, name):
    before, after = job().fingerprint("cpu"), job(**change).fingerprint("cpu")
    assert name in {key for key in before if before[key] != after[key]}


def test_every_bundled_scene_has_a_hash_of_its_own():
    hashes = [content_hash(api.load_scene(name)) for name in bundled.names()]
    assert len(set(hashes)) == len(hashes) >= 6


def test_a_new_version_changes_the_fingerprint(monkeypatch):
    before = job().fingerprint("cpu")
    monkeypatch.setattr("lippmann.tiles.job.VERSION", "99.0")
    assert job().fingerprint("cpu") != before
    assert job().fingerprint("a GPU")["the device"] == "a GPU"


def test_threads_and_memory_do_not_change_it():
    other = job(settings=replace(SETTINGS, threads=1, memory=1 << 31))
    assert other.fingerprint("cpu") == job().fingerprint("cpu")
    # Nor do they change how a tile is cut into wavefronts.
    assert other.tile_memory == job().tile_memory


def test_the_content_of_a_scene_file_counts_not_its_place(tmp_path):
    import trimesh

    def saved(name, radius):
        folder = tmp_path / name
        folder.mkdir()
        path = folder / "ball.ply"
        trimesh.creation.icosphere(subdivisions=1, radius=radius).export(path)
        return job(str(path)).scene_hash

    assert saved("a", 1.0) == saved("b", 1.0) != saved("c", 1.1)


MESH = '<shape type="ply"><string name="filename" value="{}"/></shape>'


@pytest.mark.parametrize(
    "body",
    [
        MESH.format("d/ball.ply"),
        '<path value="d"/>' + MESH.format("ball.ply"),
        '<default name="d" value="d"/>' + MESH.format("$d/ball.ply"),
        '<include filename="d/inner.xml"/>',
        '<include filename="d/path.xml"/>',
    ],
    ids=["name", "search path", "parameter", "include", "search path of an included file"],
)
def test_files_of_a_mitsuba_scene_count(tmp_path, body):
    import trimesh

    folder = tmp_path / "d"
    folder.mkdir()
    (folder / "inner.xml").write_text(f'<scene version="3.0.0">{MESH.format("d/ball.ply")}</scene>')
    (folder / "path.xml").write_text(f'<scene version="3.0.0"><path value="."/>{MESH.format("ball.ply")}</scene>')
    sums = []
    for radius in (1.0, 1.0, 1.1):
        (tmp_path / "scene.xml").write_text(f'<scene version="3.0.0">{body}</scene>')
        trimesh.creation.icosphere(subdivisions=1, radius=radius).export(folder / "ball.ply")
        sums.append(job(str(tmp_path / "scene.xml")).scene_hash)
    assert sums[0] == sums[1] != sums[2]


def test_included_files_and_parameters_count(tmp_path):
    sums = []
    for size in ("1", "1", "2"):
        (tmp_path / "inner.xml").write_text(f'<scene version="3.0.0"><default name="s" value="{size}"/></scene>')
        body = '<include filename="inner.xml"/><shape type="sphere"><float name="radius" value="$s"/></shape>'
        (tmp_path / "scene.xml").write_text(f'<scene version="3.0.0">{body}</scene>')
        sums.append(job(str(tmp_path / "scene.xml")).scene_hash)
    assert sums[0] == sums[1] != sums[2]


def test_an_object_of_mitsubas_has_no_content_to_compare(engine):
    made = job({"type": "scene", "ball": {"type": "sphere"}})
    with pytest.raises(UsageError, match="object of Mitsuba's"):
        made.fingerprint("cpu")


@pytest.mark.parametrize(
    ("changes", "parameter"),
    [
        ({"method": "lens-view", "integrator": "path"}, "method"),
        ({"quality_worst": 40.0, "spp": None}, "quality_worst"),
        ({"quality": 40.0, "spp": None}, "quality"),
        ({"max_time": 1.0, "spp": None}, "max_time"),
        ({"layers": True}, "layers"),
    ],
)
def test_what_needs_the_whole_picture_is_refused(changes, parameter):
    with pytest.raises(UsageError, match=f"^{parameter}: .*needs the whole picture"):
        job(settings=replace(SETTINGS, **changes))


def test_pictures_of_too_many_pixels_are_refused():
    with pytest.raises(UsageError, match="fewer than"):
        job(display=DISPLAY.resized(70_000, 70_000))


# ---- How it is cut ---------------------------------------------------------------------------------------------


def test_large_pictures_have_large_tiles():
    assert job(display=DISPLAY.resized(34_000, 22_000), settings=replace(SETTINGS, spp=1)).side == 1024


def test_small_pictures_have_enough_tiles():
    made = job(display=DISPLAY.resized(2048, 2048))
    assert len(made.grid) >= FEWEST_TILES
    assert made.side == 256


def test_many_samples_make_small_tiles():
    assert job(display=DISPLAY.resized(34_000, 22_000), settings=replace(SETTINGS, spp=1024)).side == 128


def test_little_memory_makes_small_tiles():
    display = DISPLAY.resized(34_000, 22_000)
    assert job(display=display, settings=replace(SETTINGS, spp=1, memory=1 << 26)).side == 512
    with pytest.raises(MemoryLimitError, match="too small for a tile"):
        job(display=display, settings=replace(SETTINGS, spp=1, memory=1 << 20))
