"""What the page is told of a picture."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pages import CELLS, DISPLAYS, lenticular, noise

from lippmann.display import Display, LensArray, Panel, list_displays
from lippmann.image import IntegralImage, Provenance
from lippmann.viewer.manifest import MAX_TILES, VERSION, facts, manifest, optics, tile_size
from lippmann.viewer.tiles import Tiles
from lippmann.viewing.replay import default_eye


def described(image, **options):
    return manifest(image, Tiles(image), **options)


@pytest.mark.parametrize("name", DISPLAYS)
def test_manifest_is_plain_json(name):
    told = described(noise(DISPLAYS[name]), name="a.png")
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert told["lippmann"] == VERSION
    assert told["name"] == "a.png"


@pytest.mark.parametrize("display", list_displays(), ids=lambda display: display.name)
def test_numbers_are_those_in_effect(display):
    told = optics(display, subpixels=False)
    lattice, lenses = display.lattice, told["lenses"]
    assert lenses["origin"] == [lattice.origin_x, lattice.origin_y]
    assert lenses["pitch"] == lattice.pitch
    assert (lenses["row_pitch"] is None) == (display.lens_array.layout == "lenticular")
    assert [lenses["columns"], lenses["rows"]] == [display.lens_grid.columns, display.lens_grid.rows]
    assert (told["viewing_distance"] is None) == math.isinf(display.viewing_distance)
    assert told["eye"] == list(default_eye(display))
    assert told["micro_image_pitch"] == pytest.approx(lattice.pitch * told["magnification"], rel=1e-5)


def test_pitch_in_effect_is_told_not_the_one_given():
    display = Display("x", Panel(96, 8, 0.1), LensArray("lenticular", 0.8 * (1 + 1e-8)), gap=2.5)
    assert optics(display, subpixels=False)["lenses"]["pitch"] == pytest.approx(0.8, rel=1e-12)
    assert display.lens_array.pitch != optics(display, subpixels=False)["lenses"]["pitch"]


def test_subpixels_have_places_only_if_the_picture_was_rendered_so():
    even, uneven = lenticular(), lenticular(subpixel_cells=CELLS)
    flat = [[[[0.0, 0.0]] * 3]]
    for display in (even, uneven):
        panel = optics(display, subpixels=False)["panel"]
        assert panel["cells"] == flat
        assert not panel["uneven"]
        assert not panel["subpixels"]
    stripe = optics(even, subpixels=True)["panel"]
    assert stripe["cells"] == [[[[-1 / 3, 0.0], [0.0, 0.0], [1 / 3, 0.0]]]]
    assert not stripe["uneven"]
    cells = optics(uneven, subpixels=True)["panel"]
    assert cells["cells"] == [[[list(pair) for pair in cell] for cell in row] for row in CELLS]
    assert cells["uneven"]


def test_manifest_follows_the_provenance():
    display = lenticular()
    assert described(noise(display, subpixels=True))["panel"]["subpixels"]
    assert described(noise(display))["transfer"] == "linear"
    image = IntegralImage(noise(display).pixels, display, provenance=Provenance(scene="teapot", method="full", spp=4))
    assert described(image)["name"] == "teapot"
    rows = dict(map(tuple, facts(image)))
    assert rows["Method"] == "full"
    assert rows["Samples per pixel"] == "4"
    assert rows["Pixels per lens"] == "8"
    assert "Rays traced" not in rows
    assert "Estimated quality" not in rows


def test_facts_tell_what_is_known():
    made = Provenance(traced_fraction=0.1234, estimate={"psnr": 41.26}, version="9.9")
    rows = dict(map(tuple, facts(IntegralImage(noise(DISPLAYS["square"]).pixels, DISPLAYS["square"], provenance=made))))
    assert rows["Rays traced"] == "12.3 %"
    assert rows["Estimated quality"] == "41.3 dB"
    assert rows["Rendered by"] == "Lippmann 9.9"
    assert rows["Lenses"] == "12 x 10"
    assert rows["Viewing distance"] == "infinite"


def test_tiles_are_told_with_their_format():
    image = noise(DISPLAYS["square"])
    assert described(image)["tiles"] == {**Tiles(image).description(), "format": "rgb"}
    assert described(image, tile_format="png")["tiles"]["format"] == "png"


@given(st.integers(1, 60_000), st.integers(1, 60_000))
def test_tiles_are_few_enough_for_an_array_texture(width, height):
    display = Display("x", Panel(width, height, 0.1), LensArray("lenticular", 0.1), gap=1.0)
    size = tile_size(display)
    assert size & (size - 1) == 0
    assert math.ceil(width / size) * math.ceil(height / size) <= MAX_TILES
    half = size // 2
    assert size == 1024 or math.ceil(width / half) * math.ceil(height / half) > MAX_TILES
