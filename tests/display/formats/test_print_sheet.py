"""Prints behind lens sheets: pitches, gaps, pixels, and what is refused."""

from __future__ import annotations

import math
from contextlib import suppress

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lippmann.display import load_display
from lippmann.display.formats.print_sheet import Print, print_of_texts
from lippmann.errors import DisplayError
from lippmann.optics.first_order import extreme_ray_field
from lippmann.optics.fitting import gap_of

GOOD = {"lpi": "60", "ppi": "720", "size": "200x300mm", "viewing-distance": "500mm"}


def test_the_example():
    display = print_of_texts(GOOD).display()
    assert (display.panel.width, display.panel.height) == (5669, 8504)
    assert display.panel.pixel_pitch == 25.4 / 720
    assert display.panel.subpixel_offsets == ((0, 0),) * 3
    assert display.lens_array.pitch == pytest.approx(25.4 / 60)
    assert display.lens_array.slant == 0
    assert display.viewing_distance == 500
    assert display.field_of_view == pytest.approx(54)
    # p (D + g) / D
    assert display.micro_image_pitch == pytest.approx(25.4 / 60 * (500 + display.gap) / 500)
    assert display.size_mm == pytest.approx((200, 300), abs=25.4 / 720 / 2)
    assert display == load_display("print:lpi=60,ppi=720,size=200x300mm,viewing-distance=500mm")


def test_the_preset_can_be_said_so():
    preset = load_display("print-60lpi")
    same = load_display("print:lpi=60,ppi=720,size=200x150mm,thickness=26mil,index=1.57")
    assert same.lens == preset.lens
    assert same.gap == pytest.approx(preset.gap)
    assert same.panel == preset.panel
    assert same.lens_array == preset.lens_array
    assert same.lattice == preset.lattice


@given(
    lpi=st.floats(10, 200),
    distance=st.just(math.inf) | st.floats(100, 5000),
    field=st.none() | st.floats(15, 80),
    thickness=st.none() | st.floats(0.3, 3),
    measured=st.booleans(),
)
@settings(deadline=None, max_examples=25)
def test_pitches_gaps_and_fields_agree(lpi, distance, field, thickness, measured):
    if thickness:
        # Thick sheets of fine lenses have no field to speak of, and thin ones no focus on the print.
        field = None
        assume(5.1 < math.degrees(2 * math.atan(25.4 / lpi / 2 * 1.57 / thickness)) < 90)
    stated = {"print_lpi" if measured else "lpi": lpi, "field": field, "thickness": thickness}
    sheet = Print(ppi=20 * lpi, size=(50, 20), viewing_distance=distance, **stated)
    display = sheet.display()
    assert 25.4 / display.micro_image_pitch == pytest.approx(sheet.pitch_on_print)
    assert 25.4 / display.lens_array.pitch == pytest.approx(sheet.pitch_of_sheet)
    assert (sheet.pitch_on_print if measured else sheet.pitch_of_sheet) == pytest.approx(lpi)
    assert sheet.pitch_of_sheet == pytest.approx(sheet.pitch_on_print * (1 + display.gap / distance))
    if thickness:
        assert display.gap == pytest.approx(gap_of(display.lens, display.lens_array))
        # The smaller, the larger a part of its circle a crest is.
        assert 0.5 < display.gap * 1.57 / thickness < 1.0
    else:
        assert display.lens is None
        assert display.field_of_view == pytest.approx(field or 54)


def test_a_thickness_makes_a_lens():
    best = print_of_texts({**GOOD, "thickness": "26mil"}).display()
    assert best.lens.radius == pytest.approx(1.108 * 0.6604 * 0.57 / 1.57, rel=1e-3)
    stated = print_of_texts({**GOOD, "thickness": "26mil", "radius": "0.3mm", "conic": "-0.4", "blur": "9um"}).display()
    assert (stated.lens.radius, stated.lens.conic, stated.pixel.blur) == pytest.approx((0.3, -0.4, 0.009))
    maker = print_of_texts({**GOOD, "thickness": "26mil", "field": "54"}).display()
    assert extreme_ray_field(maker.lens, 25.4 / 60) == pytest.approx(54)
    assert best.pixel is None


def test_typical_sheets_are_known_by_name():
    values = {key: text for key, text in GOOD.items() if key != "lpi"}
    display = print_of_texts({**values, "sheet": "75lpi"}).display()
    assert display.lens_array.pitch == pytest.approx(25.4 / 75)
    assert (display.lens.radius, display.lens.thickness, display.lens.index) == (0.2279, 0.5281, 1.6357)
    measured = print_of_texts({**values, "sheet": "75lpi", "print-lpi": "74.6"})
    assert measured.pitch_on_print == 74.6
    assert measured.lens == display.lens


def test_lengths_have_units():
    one = print_of_texts({**GOOD, "thickness": "26mil", "viewing-distance": "20in", "size": "8x10in"})
    assert (one.thickness, one.viewing_distance, *one.size) == pytest.approx((0.6604, 508, 203.2, 254))
    assert print_of_texts({**GOOD, "viewing-distance": "infinite"}).pitch_on_print == 60
    without = {key: text for key, text in GOOD.items() if key != "viewing-distance"}
    assert print_of_texts(without).viewing_distance == 500


@pytest.mark.parametrize(
    ("texts", "where", "said"),
    [
        ({"lpi": "0"}, "lpi", "lpi is 0; it must lie between 1 and 1000 lenses per inch"),
        ({"lpi": "-60"}, "lpi", "lpi is -60"),
        ({"lpi": "sixty"}, "lpi", "'sixty' is not a number"),
        ({"lpi": "1e999"}, "lpi", "'1e999' is not a number"),
        ({"lpi": "60 lpi"}, "lpi", "it must be a number without a unit"),
        ({"ppi": "0"}, "ppi", "ppi is 0"),
        ({"ppi": "-720"}, "ppi", "ppi is -720"),
        ({"ppi": "1e9"}, "ppi", "it must lie between 10 and 20000 pixels per inch"),
        ({"ppi": "90"}, "ppi", "a lens covers 1.501 pixels; two are the least"),
        ({"size": "0x300mm"}, "size", "a side of 0 mm is 0 pixels"),
        ({"size": "-200x300mm"}, "size", "a side of -200 mm"),
        ({"size": "200mm"}, "size", "'200mm' is not a size"),
        ({"size": "200x300km"}, "size", "unknown unit 'km'"),
        ({"size": "1e9x1mm"}, "size", "it must be 1 to 1000000 pixels"),
        ({"size": "0.2x300mm"}, "size", "a lens covers 12.01 pixels; the print has only 6"),
        ({"viewing-distance": "0mm"}, "viewing-distance", "it must be a length of at least 10 mm, or infinite"),
        ({"viewing-distance": "-500mm"}, "viewing-distance", "viewing_distance is -500 mm"),
        (
            {"viewing-distance": "500"},
            "viewing-distance",
            "'500' has no unit; say 500mm, 500cm, 500mil or 500in",
        ),
        ({"viewing-distance": "far"}, "viewing-distance", "'far' is not a length"),
        *(
            ({"thickness": text}, "thickness", "above zero; sheets are 1.2 to 4 pitches thick")
            for text in ("0mm", "-1mm", "1e400mm")
        ),
        ({"thickness": "nan"}, "thickness", 'such as "6.8 mm"; sheets are 1.2 to 4 pitches thick'),
        ({"thickness": "26mm"}, "thickness", "5 to 150 degrees; sheets are 1.2 to 4 pitches thick; look at its unit"),
        ({"thickness": "0.66mm", "radius": "-0.3mm"}, "radius", "above zero; sheets have 0.53 to 1.7 pitches"),
        ({"thickness": "0.66mm", "radius": "inf"}, "radius", 'such as "6.8 mm"; sheets have 0.53 to 1.7 pitches'),
        ({"thickness": "0.66mm", "radius": "0.3mm", "field": "54"}, "radius", "radius and field are both given"),
        ({"thickness": "0.66mm", "field": "20"}, "field", "field is 20 degrees; crests on 0.66 mm of index 1.57 have"),
        (
            {"thickness": "0.66mm", "radius": "0.2mm"},
            "radius",
            "radius is 0.2 mm; lenses 0.4233 mm wide need more",
        ),
        ({"thickness": "0.15mm"}, "thickness", "thickness is 0.15 mm; the crest alone is 0.1532 mm high"),
        ({"thickness": "0.05mm"}, "thickness", "thickness is 0.05 mm; the crest alone is 0.1532 mm high"),
        (
            {"thickness": "0.05mm", "radius": "2mm"},
            "thickness",
            "such lenses must have a field of view of 5 to 150 degrees",
        ),
        ({"radius": "0.3mm"}, "radius", "radius is given without a thickness; it means nothing alone"),
        ({"conic": "-0.4"}, "conic", "conic is given without a thickness"),
        ({"thickness": "0.66mm", "conic": "99"}, "conic", "conic is 99; it must lie between -10 and 10"),
        ({"thickness": "0.66mm", "index": "2.5"}, "index", "index is 2.5; it must lie between 1.3 and 2; sheets have"),
        ({"blur": "1mm"}, "blur", "blur is 1 mm; it must not exceed a pixel of 0.03528 mm"),
        ({"blur": "-1um"}, "blur", "blur is -0.001 mm; it must be a length of zero or more; prints have a fifth"),
        ({"sheet": "60lpi", "lpi": None}, "sheet", "unknown sheet '60lpi'"),
        ({"sheet": "50lpi"}, "lpi", "sheet and lpi are both given; a typical sheet has its own"),
        ({"sheet": "50lpi", "lpi": None, "radius": "1mm"}, "radius", "sheet and radius are both given"),
        ({"index": "1.5"}, "index", "index is given without a thickness"),
        ({"thickness": "0.66mm", "index": "0"}, "index", "index is 0"),
        ({"field": "0"}, "field", "field is 0"),
        ({"field": "180"}, "field", "field is 180; it must lie between 5 and 150 degrees; makers state 25 to 60"),
        ({"print-lpi": "59.9"}, "print-lpi", "print_lpi and lpi are both given"),
        ({"lpi": "1", "ppi": "72", "viewing-distance": "60mm"}, "viewing-distance", "look from farther away"),
        ({"paper": "A4"}, "paper", "unknown key 'paper'"),
        ({"bleed": "3mm"}, "bleed", "bleed is no number of the lens sheet; say it beside the print: bleed=..."),
        ({"ppi": None, "size": None}, "ppi", "ppi, size are missing; a print needs lpi"),
    ],
)
def test_nonsense_is_refused(texts, where, said):
    with pytest.raises(DisplayError) as caught:
        print_of_texts({key: text for key, text in {**GOOD, **texts}.items() if text is not None}).display()
    assert caught.value.where == where
    assert said in str(caught.value)


@pytest.mark.parametrize("missing", ["lpi", "ppi", "size"])
def test_what_is_missing_is_named(missing):
    with pytest.raises(DisplayError, match=f"{missing} is missing"):
        print_of_texts({key: text for key, text in GOOD.items() if key != missing})


@given(st.dictionaries(st.sampled_from([*GOOD, "thickness", "index", "field", "radius", "blur"]), st.text(max_size=8)))
@settings(deadline=None)
def test_whatever_is_typed_is_a_print_or_refused(texts):
    with suppress(DisplayError):
        assert print_of_texts({**GOOD, **texts}).display().gap > 0


def test_a_print_is_named_by_the_pitch_that_was_given():
    sheet = Print(ppi=360, size=(60.0, 45.0), print_lpi=60.05).display()
    assert sheet.name == "print-60.05lpi"
    assert sheet.title.startswith("60.0999-lpi lenticular print (print pitch 60.05 lpi), 60x45 mm")
