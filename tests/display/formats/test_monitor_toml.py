"""Monitors as display files and in one word."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import Panel, load_display
from lippmann.display.formats.monitor import Monitor
from lippmann.display.formats.monitor_toml import monitor_of_texts, text_of_monitor
from lippmann.errors import DisplayError

GOOD = """title = "A panel"

[monitor]
width = 384
height = 216
pixel_pitch = "282.4 dpi"
subpixel_offsets = "bgr"
pitch = 45.5
slope = -6.0
center = 0.37
view_cone = 40
viewing_distance = "60 cm"
"""

MEANT = Monitor(
    "own",
    Panel(384, 216, 25.4 / 282.4, ((1 / 3, 0.0), (0.0, 0.0), (-1 / 3, 0.0))),
    pitch=45.5,
    slope=-6.0,
    center=0.37,
    view_cone=40.0,
    viewing_distance=600.0,
    title="A panel",
)

SHORT = "monitor:size=384x216,dpi=282.4,pitch=45.5,slope=-6,center=0.37,subpixels=bgr,cone=40,viewing-distance=60cm"


@pytest.fixture
def load(tmp_path):
    def loaded(text):
        path = tmp_path / "own.toml"
        path.write_text(text, encoding="utf-8")
        return load_display(path)

    return loaded


def test_the_file_gives_the_monitor_s_display(load):
    assert load(GOOD) == MEANT.display()


def test_the_short_form_gives_the_same(load):
    named = replace(MEANT, name="monitor", title="")
    assert load_display(SHORT) == named.display()


@pytest.mark.parametrize("pitch", ['"45.5 lpi"', '"45.5"', '"0.5582417582417582 mm"', '"6.206593406593407 px"'])
def test_a_pitch_has_many_units(load, pitch):
    again = Monitor.of_display(load(GOOD.replace("45.5", pitch)))
    assert again.pitch == pytest.approx(45.5)


def test_upright_lenses_and_parallel_views(load):
    for slope in ("inf", '"infinite"'):
        text = GOOD.replace("-6.0", slope).replace('"60 cm"', '"infinite"')
        display = load(text)
        assert display.lens_array.slant == 0
        assert math.isinf(display.viewing_distance)
    upright = load_display(SHORT.replace("-6", "infinite").replace("60cm", "infinite"))
    assert (upright.lens_array.slant, upright.viewing_distance) == (0, math.inf)


def test_what_has_a_default_may_be_left_out(load):
    short = "\n".join(line for line in GOOD.splitlines() if not line.startswith(("view", "subpixel", "title")))
    display = load(short)
    assert display.viewing_distance == 600
    assert display.panel.subpixel_offsets == ((-1 / 3, 0), (0, 0), (1 / 3, 0))
    assert Monitor.of_display(display).view_cone == pytest.approx(35)


@given(
    pitch=st.floats(10, 100),
    slope=st.just(math.inf) | st.floats(0.2, 50) | st.floats(-50, -0.2),
    center=st.floats(-10, 10),
    cone=st.floats(5, 100),
    distance=st.just(math.inf) | st.floats(50, 5000),
    title=st.text(st.characters(codec="utf-8", exclude_categories=("Cs",)), max_size=20),
    cells=st.booleans(),
)
@settings(deadline=None, max_examples=25)
def test_what_is_saved_comes_back_exactly(tmp_path_factory, pitch, slope, center, cone, distance, title, cells):
    panel = Panel(3840, 2160, 0.0899, subpixel_cells=((MEANT.panel.subpixel_offsets,),) if cells else None)
    monitor = Monitor("own", panel, pitch, slope, center, cone, distance, title)
    path = tmp_path_factory.getbasetemp() / "saved.toml"
    path.write_text(text_of_monitor(monitor), encoding="utf-8")
    assert load_display(path) == monitor.display()


@pytest.mark.parametrize(
    ("good", "bad", "line", "said"),
    [
        ("pitch = 45.5", "pitch = 0", 8, "pitch is 0; it must lie between"),
        ("pitch = 45.5", "pitch = -1", 8, "pitch is -1"),
        ("pitch = 45.5", 'pitch = "0 px"', 8, "pitch is '0 px'; it must be above zero"),
        ("pitch = 45.5", 'pitch = "45.5 parsec"', 8, "known are um, µm, mm"),
        ("pitch = 45.5", "pitch = 900", 8, "it must cover at least one"),
        ("slope = -6.0", "slope = 0", 9, "slope is 0; it must be at least 0.18"),
        ("slope = -6.0", 'slope = "steep"', 9, "slope is 'steep'"),
        ("slope = -6.0", "slope = nan", 9, "slope is nan"),
        ("center = 0.37", "center = true", 10, "center is True"),
        ("width = 384", "width = 0", 4, "width is 0; it must be a whole number"),
        ("width = 384", 'width = "384"', 4, "width is '384'"),
        ('"282.4 dpi"', '"-3 dpi"', 6, "'-3 dpi' is no length; dpi must be above zero"),
        ('"282.4 dpi"', '"282.4 lpi"', 6, "unknown unit 'lpi'"),
        ('"bgr"', '"bgg"', 7, "subpixel_offsets is 'bgg'"),
        ('"bgr"', "3", 7, "subpixel_offsets holds 3"),
        ("view_cone = 40", "view_cone = 0", 11, "view_cone is 0"),
        ('"60 cm"', '"60 km"', 12, "unknown unit 'km'"),
        ('"60 cm"', "-1", 12, "viewing_distance is -1"),
        ("center = 0.37", "centre = 0.37", 10, "unknown key 'centre'"),
        ('title = "A panel"', "title = 3", 1, "title is 3"),
        ('title = "A panel"', "gap = 3", 1, "unknown key 'gap'"),
    ],
)
def test_bad_values_are_named_with_their_line(load, good, bad, line, said):
    assert good in GOOD
    with pytest.raises(DisplayError) as caught:
        load(GOOD.replace(good, bad, 1))
    assert caught.value.where.endswith(f"own.toml:{line}"), str(caught.value)
    assert said in str(caught.value)


def test_a_missing_key_is_named(load):
    with pytest.raises(DisplayError, match=r"own\.toml:3: the key 'slope' is missing"):
        load(GOOD.replace("slope = -6.0\n", ""))
    with pytest.raises(DisplayError, match="monitor is 3"):
        load("monitor = 3")


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("monitor", "monitor: size: size is missing"),
        ("monitor:", "size is missing"),
        (SHORT.replace("384x216", "384"), "'384' is no number of pixels; width x height"),
        (SHORT.replace("384x216", "-384x216"), "is no number of pixels"),
        (SHORT.replace("384x216", "0x216"), "monitor: size: width is 0"),
        (SHORT.replace("282.4", "0"), "monitor: dpi: '0.0 dpi' is no length; dpi must be above zero"),
        (SHORT.replace("282.4", "fine"), "monitor: dpi: 'fine' is not a number"),
        (SHORT.replace("45.5", "0"), "monitor: pitch: '0' is no length; lpi must be above zero"),
        (SHORT.replace("slope=-6", "slope=0"), "monitor: slope: slope is 0"),
        (SHORT.replace("0.37", "x"), "monitor: center: 'x' is not a number"),
        (SHORT.replace("bgr", "rgbw"), "monitor: subpixels: subpixel_offsets is 'rgbw'"),
        (SHORT.replace("cone=40", "cone=400"), "monitor: cone: view_cone is 400"),
        (SHORT.replace("60cm", "near"), "monitor: viewing-distance: 'near' is not a length"),
        (SHORT + ",dpi=3", "dpi is given twice"),
        (SHORT + ",colour=3", "unknown key 'colour'"),
        (SHORT + ",slope", "'slope' is no pair"),
    ],
)
def test_bad_short_forms_are_refused(word, said):
    with pytest.raises(DisplayError) as caught:
        load_display(word)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@given(st.dictionaries(st.sampled_from(["size", "dpi", "pitch", "slope", "center", "cone"]), st.text(max_size=8)))
@settings(deadline=None)
def test_whatever_is_typed_is_a_monitor_or_refused(texts):
    values = {"size": "384x216", "dpi": "282", "pitch": "45", "slope": "6", "center": "0"} | texts
    with suppress(DisplayError):
        assert monitor_of_texts(values).display().panel.width >= 1
