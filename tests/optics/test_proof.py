"""Proofs of displays: figures against formulas, advice, and that every display can be proved."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from lippmann.display import list_displays, load_display
from lippmann.display.lens_profile import LensProfile
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.optics.fitting import gap_of
from lippmann.optics.moire import _spread, moire_waves
from lippmann.optics.proof import is_print, prove

SHORT = "print:lpi=60,ppi=720,size=50x30mm,thickness=26mil"


def finite(value):
    """Whether a value of JSON holds no number that is none."""
    if isinstance(value, dict):
        return all(map(finite, value.values()))
    if isinstance(value, list):
        return all(map(finite, value))
    return not isinstance(value, float) or math.isfinite(value)


@pytest.mark.parametrize("name", [display.name for display in list_displays() if not display.stereo])
def test_every_display_of_native_pixels_has_a_proof(name):
    display = load_display(name)
    proof = prove(display)
    assert finite(json.loads(json.dumps(proof.to_dict(), allow_nan=False)))
    assert 0.5 * proof.pixels <= proof.directions <= 3 * proof.pixels + 1
    assert proof.zone.nearest > 0
    assert "nan" not in " ".join(proof.in_words().values())
    assert (proof.lens is None) == (display.lens is None) == (proof.thicker is None)


def test_a_pinhole_is_proved_by_the_formulas_of_displays():
    display = load_display("seed-lenticular")
    proof = prove(display)
    assert proof.field == pytest.approx(display.field_of_view)
    # 8 directions x 6.8 mm on both sides.
    assert proof.depth == pytest.approx(2 * 8 * 6.8)
    assert proof.depth == pytest.approx(display.resolvable_depth[0] - display.resolvable_depth[1])
    assert proof.zone.farthest == math.inf
    assert proof.to_dict()["viewing_distance"] == "infinite"
    assert proof.advice.startswith("keep the scene within 54.4 mm")
    assert proof.in_words()["lens"] == "none is given: an ideal pinhole at the gap"
    assert ">none is given: an ideal pinhole at the gap<" in proof._repr_html_()


def test_a_slanted_panels_zone_is_its_cone():
    proof = prove(load_display("panel-4k"))
    assert 2 * math.degrees(math.atan(proof.zone.slope)) == pytest.approx(35, abs=0.6)
    assert proof.zone.width_at(600) == pytest.approx(2 * 600 * proof.zone.slope)


def test_a_thicker_sheet_narrows_the_field():
    display = load_display(SHORT)
    proof = prove(display)
    thick = replace(display.lens, thickness=1.03 * display.lens.thickness)
    assert proof.thicker.gap == pytest.approx(gap_of(thick, display.lens_array))
    assert proof.thicker.field < proof.field
    assert proof.thicker.crosstalk > proof.crosstalk
    # Half a picture of 50 mm from its middle, seen from 500 mm, in pixels of 1/720 inch.
    expected = 25 * (proof.thicker.gap - display.gap) / (500 + display.gap) * 720 / 25.4
    assert proof.thicker.shift == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("share", "mark"), [(0.01, "1 %"), (0.02, "2 % (visible)"), (0.07, "7 % (annoying)")])
def test_crosstalk_says_by_which_mark_it_is_seen(share, mark):
    words = replace(prove(load_display(SHORT)), crosstalk=share).in_words()
    assert words["crosstalk"].startswith(f"{mark} straight ahead, ")


def test_prints_have_tolerances():
    proof = prove(load_display(SHORT))
    pixel, gap = 25.4 / 720, load_display(SHORT).gap
    tolerances = proof.tolerances
    assert tolerances.misregistration == pytest.approx(math.degrees(math.atan(pixel / gap)))
    # At half the usable depth, 12 x gap away, the light of one pixel is a lens wide.
    assert tolerances.misregistration_depth == pytest.approx(25.4 / 60, rel=0.01)
    assert tolerances.pitch_drift == pytest.approx(pixel / 25, rel=0.01)
    assert tolerances.dot_gain > 0.25
    assert prove(load_display("panel-4k")).tolerances is None
    assert is_print(load_display("print-60lpi"))
    unknown = prove(load_display(SHORT.replace(",thickness=26mil", ""))).in_words()
    assert unknown["strips"] == "an ideal lens shows any number apart"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("", "the lens could show 23 strips, at 1379 ppi"),
        (
            ",radius=0.2398mm",
            "use 4 strips a lens in place of 12 (240 ppi), or a sheet with a crest radius of 0.2656 mm",
        ),
        (",blur=20um", "print finer than 720 ppi with less blur"),
    ],
)
def test_advice_names_what_to_change(more, said):
    advice = prove(load_display(SHORT + more)).advice
    assert said in advice or ("blur" in more and "strips a lens in place of" in advice)
    assert "keep the scene within" in advice


def test_advice_tells_how_deep_scenes_are_fitted_on_large_pictures():
    """A point at z spreads over z d / g: 13.75 mm x 0.04233 mm / 0.4158 mm."""
    large, small = (prove(load_display(f"print:lpi=60,ppi=600,size={size}")).advice for size in ("A4", "60x45mm"))
    start = "keep the scene within 4.16 mm in front of and behind the lenses"
    assert large.startswith(f"{start} (scenes are fitted to 13.8 mm, where points are 1.4 mm wide)")
    assert small.startswith(f"{start};")


def test_a_print_is_named_with_its_size_and_resolution():
    proof = prove(load_display("print:lpi=60,ppi=600,size=A4"))
    assert proof.in_words()["display"] == (
        "print-60lpi: 60-lpi lenticular print, 210x297 mm at 600 ppi, seen from 500 mm"
    )
    assert replace(proof, title="").in_words()["display"] == "print-60lpi"


def test_dark_lines_make_moire():
    display = load_display("seed-lenticular")
    assert moire_waves(display) == []  # of full pixels behind upright lenses nothing is left
    panel = load_display("panel-4k")
    upright = replace(panel.lens_array, slant=0.0)
    panel = replace(panel, lens_array=upright, pixel=PixelAperture(black_matrix=0.02))
    waves = moire_waves(panel)
    assert waves == sorted(waves, key=lambda wave: -wave.period)
    assert all(wave.period > panel.lens_array.pitch and wave.contrast >= 0.01 for wave in waves)
    # 6.2 pixels a lens: of a wave a pixel a fifth of one is left over from lens to lens.
    across = panel.pixels_per_lens[0]
    periods = {wave.order: wave.period for wave in waves}
    assert periods[1, 0] == pytest.approx(panel.lattice.pitch / abs(across - round(across)), rel=1e-6)
    # A Gaussian of a fifth of a pixel's width leaves exp(-2 (pi / 5)^2) of a wave a pixel.
    inked = moire_waves(replace(panel, pixel=replace(panel.pixel, blur=panel.panel.pixel_pitch / 5)))
    plain, bled = ({wave.order: wave.contrast for wave in each}[1, 0] for each in (waves, inked))
    assert bled / plain == pytest.approx(math.exp(-2 * (math.pi / 5) ** 2))
    blurred = moire_waves(replace(panel, lens=LensProfile(2.0, 1.5)))
    assert max((wave.contrast for wave in blurred), default=0) < max(wave.contrast for wave in waves)


def test_micro_lenses_blur_waves_alike_up_and_across():
    array = replace(load_display("mla-square"), lens=LensProfile(1.2, 3.0, 1.5))
    share = _spread(array)
    frequency = 0.3 / array.panel.pixel_pitch
    assert 0.1 < share(frequency, 0.0) < 0.9
    assert share(0.0, frequency) == pytest.approx(share(frequency, 0.0), abs=1e-3)


@pytest.mark.parametrize("layout", ["mla-square", "mla-hexagonal"])
def test_micro_lenses_over_dark_lines(layout):
    """Lenses of 15.02 pixels: a wave of one pixel is seen once in 15.02 / 0.02 lenses."""
    display = load_display(layout)
    lenses = replace(display.lens_array, pitch=15.02 * display.panel.pixel_pitch, row_pitch=None, offset=(0.0, 0.0))
    display = replace(display, lens_array=lenses, pixel=PixelAperture(black_matrix=0.01))
    slowest = moire_waves(display)[0]
    assert slowest.period == pytest.approx(lenses.pitch / 0.02, rel=0.02) or layout == "mla-hexagonal"
    assert slowest.period > 10 * lenses.pitch


def test_no_share_is_written_as_a_power_of_ten():
    # Small lit spots behind ideal pinholes: bars of more than twice the mean.
    said = prove(load_display("mla-hexagonal")).in_words()["moire"]
    assert "170 % of contrast" in said
