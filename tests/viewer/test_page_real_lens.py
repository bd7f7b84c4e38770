"""The switch *Real lens*: the page shows what ``lippmann replay --optics`` shows of the same picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pages import VIEWER, noise, opened, page_of, psnr, put_eye, shown

from lippmann.color.transfer import quantize
from lippmann.display import load_display
from lippmann.display.lens_profile import LensProfile
from lippmann.viewing.optical_replay import replay_optics
from lippmann.viewing.replay import default_eye

SLANTED = replace(load_display("panel-4k").resized(160, 90), lens=LensProfile(radius=1.9, thickness=4.6, index=1.57))
IDEAL = load_display("seed-lenticular").resized(96, 64)
ROUND = LensProfile(radius=2.3, thickness=6.0, index=1.5)
DISPLAYS = {
    "print": load_display("print:lpi=60,ppi=360,size=8x5mm,thickness=0.6604mm,index=1.57,blur=9um"),
    # More lenses than pixels of the page, and more rows.
    "fine print": load_display("print:lpi=100,ppi=600,size=250x10mm,thickness=16mil,index=1.57"),
    "slanted": SLANTED,
    "square": replace(load_display("mla-square").resized(96, 80), lens=ROUND, viewing_distance=300.0),
    "hexagonal": replace(load_display("mla-hexagonal").resized(96, 80), lens=ROUND, viewing_distance=300.0),
}


def through_lens(image, eye, size):
    return quantize(replay_optics(image, eye, size=size), 8, image.provenance.transfer)


def switched_on(open_tab, path, **options):
    tab = opened(open_tab, path, **options)
    tab.evaluate(f"{VIEWER}.setReal(true)")
    return tab


@pytest.mark.long_cases(but=["print"])
@pytest.mark.slow
@pytest.mark.parametrize("name", DISPLAYS)
def test_page_shows_what_replay_shows_through_the_real_lens(open_tab, tmp_path, name):
    display = DISPLAYS[name]
    image = noise(display, subpixels=True)
    tab = switched_on(open_tab, page_of(tmp_path / "page.html", image))
    x, y, z = default_eye(display)
    # In the middle; aside, high and farther; and near, where the pupil blurs most.
    for eye in ((x, y, z), (-0.25 * z, 0.1 * z, 1.2 * z), (0.02 * z, 0.0, 0.3 * z)):
        put_eye(tab, eye)
        codes = shown(tab)
        # The page knows fewer directions of round lenses.
        least = 40 if display.lens_array.layout == "lenticular" else 30
        assert psnr(codes, through_lens(image, eye, codes.shape[1::-1])) >= least, eye
    tab.assert_clean()


@pytest.mark.slow
def test_the_switch_is_there_for_displays_with_a_lens_only(open_tab, tmp_path):
    buttons = "[...document.querySelectorAll('button')].filter((b) => b.textContent === 'Real lens')"
    ideal, real = noise(IDEAL), noise(DISPLAYS["print"])
    tab = opened(open_tab, page_of(tmp_path / "ideal.html", ideal))
    assert tab.evaluate(f"{buttons}.length") == 0
    tab.page.keyboard.press("r")
    assert tab.evaluate(f"{VIEWER}.view.isReal") is False
    # Of two pictures one has a lens: the other is seen through ideal ones.
    tab = opened(open_tab, page_of(tmp_path / "both.html", real, ideal))
    off = shown(tab)
    tab.evaluate(f"{buttons}[0].click()")
    tab.wait_for(f"{VIEWER}.pictures[0].light !== null")
    assert tab.evaluate(f"{buttons}[0].getAttribute('aria-pressed')") == "true"
    on, half = shown(tab), off.shape[1] // 2
    assert psnr(on[:, : half - 1], off[:, : half - 1]) < 30
    assert np.array_equal(on[:, half + 1 :], off[:, half + 1 :])
    tab.evaluate(f"{buttons}[0].click()")
    assert np.array_equal(shown(tab), off)
    tab.assert_clean()


@pytest.mark.long
@pytest.mark.slow
def test_layers_lie_over_what_real_lenses_show(open_tab, tmp_path):
    display = DISPLAYS["print"]
    status = np.full((display.panel.height, display.panel.width), -1, np.float32)
    image = noise(display, maps={"status": status})
    tab = switched_on(open_tab, page_of(tmp_path / "page.html", image))
    plain = shown(tab)
    tab.evaluate(f"{VIEWER}.setOverlay('status')")
    tab.evaluate(f"{VIEWER}.setOverlayShare(1)")
    assert len(np.unique(shown(tab).reshape(-1, 3), axis=0)) < 5
    tab.evaluate(f"{VIEWER}.setOverlay(null)")
    assert np.array_equal(shown(tab), plain)
