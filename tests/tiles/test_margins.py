"""What is rendered around tiles: enough, in windows that fit the lenses, and never beyond the panel."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.journal import TileGrid
from lippmann.rendering.denoise.oidn import NETWORK_STEP
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.tiles.margins import DENOISER_REACH, SHARED_LENSES, surroundings_of

DENOISED = RenderRequest(denoise="oidn")
SHARED = RenderRequest(method="pooled", denoise="oidn")
DISPLAYS = ("seed-lenticular", "print-60lpi", "mla-square", "mla-hexagonal", "looking-glass-portrait")


def test_denoised_tiles_have_what_the_network_looks_at():
    for settings in (DENOISED, SHARED):
        found = surroundings_of(load_display("seed-lenticular"), settings)
        assert found.margin >= DENOISER_REACH
        assert found.step == NETWORK_STEP


def test_shared_light_has_more_lenses_around_it_where_they_are_large():
    panel = Panel(960, 64, 0.05)
    display = Display("large", panel, LensArray("lenticular", 2.4), 6.8)
    assert surroundings_of(display, SHARED).margin >= 48 * SHARED_LENSES > surroundings_of(display, DENOISED).margin


def test_pixels_that_stand_for_themselves_have_nothing_around_them():
    assert surroundings_of(load_display("seed-lenticular"), RenderRequest()) is None


@given(
    name=st.sampled_from(DISPLAYS),
    settings=st.sampled_from([DENOISED, SHARED]),
    width=st.integers(130, 3000),
    height=st.integers(130, 3000),
    side=st.sampled_from([128, 256, 512, 1024]),
)
def test_windows_hold_their_tiles_with_the_margin(name, settings, width, height, side):
    around = surroundings_of(load_display(name), settings)
    grid = TileGrid(width, height, side)
    sizes = set()
    for tile in grid:
        window = around.window(tile, side, (width, height))
        for first, length, begin, count, whole in (
            (tile.top, tile.height, window.top, window.height, height),
            (tile.left, tile.width, window.left, window.width, width),
        ):
            assert begin == max(0, begin) <= max(0, first - around.margin)
            assert begin % around.step == 0
            assert min(whole, first + length + around.margin) <= begin + count <= whole
            assert count <= around.longest(side)
            if begin > 0 and begin + count < whole:
                sizes.add(count)
    # Those that no edge cuts share their kernels.
    assert len(sizes) <= 1
