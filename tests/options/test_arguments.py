"""Arguments of calls are refused in one line before anything is done, or become what their annotations say."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import lippmann
from lippmann.calibration.patterns import draw
from lippmann.errors import LippmannError, UsageError
from lippmann.exchange.layouts import export_image, import_image
from lippmann.optics.crosstalk import crosstalk, independent_directions
from lippmann.optics.directions import true_directions
from lippmann.optics.eye_light import eye_light
from lippmann.optics.lens import Lens
from lippmann.optics.light_table import light_table
from lippmann.optics.proof import prove
from lippmann.options.option import checked
from lippmann.quilts.files import read_quilt, write_quilt
from lippmann.quilts.quilt import Quilt, QuiltLayout
from lippmann.quilts.weave import weave
from lippmann.scene.scene import Scene
from lippmann.sequences.frames import FrameRange, render_sequence
from lippmann.sequences.motion import open_motion
from lippmann.viewer.export import export_page


@checked
def call(
    scene: object,
    file: Path = Path("a"),
    size: tuple[int, int] | None = None,
    *,
    count: int = 1,
    share: float = 0.0,
    resume: bool = False,
    planes: Sequence[float] = (0.0,),
    word: str | Path = "",
) -> dict[str, object]:
    """Its arguments."""
    return dict(locals())


SMALL = lippmann.load_display("seed-lenticular").resized(16, 8)
IMAGE = lippmann.IntegralImage(np.zeros((8, 16, 3), np.float32), SMALL)
PRINT = lippmann.load_display("print-60lpi")
LENS = Lens.of(PRINT)
QUILT = Quilt(IMAGE.pixels, QuiltLayout(2, 1, 1.0))


def test_values_become_what_annotations_say():
    values = call(
        5, "b", np.array([4, 2]), count=np.int64(3), share=1, resume=np.True_, planes=np.float32([0.5]), word=Path("c")
    )
    assert values == {
        "scene": 5, "file": Path("b"), "size": (4, 2), "count": 3, "share": 1.0, "resume": True, "planes": [0.5],
        "word": Path("c"),
    }  # fmt: skip
    assert [type(values[name]) for name in ("count", "share", "resume")] == [int, float, bool]
    assert call.__doc__ == "Its arguments."


@pytest.mark.parametrize(
    ("name", "value", "rule"),
    [
        ("file", 5, "a path"),
        ("size", "4x2", "two whole numbers or None"),
        ("size", (4, 2, 1), "two whole numbers or None"),
        ("size", (4.5, 2), "two whole numbers or None"),
        ("count", 1.5, "a whole number"),
        ("count", None, "a whole number"),
        ("share", "1", "a number"),
        ("resume", "no", "True or False"),
        ("resume", [], "True or False"),
        ("planes", [], "numbers, at least one"),
        ("planes", "12", "numbers, at least one"),
        ("word", 5, "a text or a path"),
    ],
)
def test_other_values_are_refused(name, value, rule):
    with pytest.raises(UsageError) as caught:
        call("scene", **{name: value})
    assert str(caught.value) == f"{name}: {value!r}; must be {rule}"


def test_what_is_given_by_place_is_checked_and_python_counts():
    with pytest.raises(UsageError, match="file: 5; must be a path"):
        call("scene", 5)
    with pytest.raises(TypeError, match="positional"):
        call("scene", "a", (1, 2), 4)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        (lambda: lippmann.render("teapot", 5), "display"),
        (lambda: lippmann.render("teapot", SMALL, progress=5), "progress"),
        (lambda: lippmann.render_to_file("teapot", 5, SMALL), "output"),
        (lambda: lippmann.render_to_file("teapot", "a.png", SMALL, runner=5), "runner"),
        (lambda: lippmann.render_to_file("teapot", "a.png", SMALL, resume="a"), "resume"),
        (lambda: lippmann.render_quilt("teapot", views="a"), "views"),
        (lambda: lippmann.render_turntable("teapot", SMALL, "a"), "frames"),
        (lambda: lippmann.render_turntable("teapot", SMALL, swing="a"), "swing"),
        (lambda: lippmann.load_scene("teapot", environment=5), "environment"),
        (lambda: lippmann.load_scene("teapot", allow_outside="no"), "allow_outside"),
        (lambda: lippmann.read_picture(5), "path"),
        (lambda: lippmann.focal_stack(IMAGE, []), "planes"),
        (lambda: lippmann.replay_stereo(5), "image"),
        (lambda: IMAGE.save(5), "path"),
        (lambda: export_image(IMAGE, 5, "views"), "path"),
        (lambda: import_image(5), "path"),
        (lambda: read_quilt(5), "path"),
        (lambda: QUILT.save(5), "path"),
        (lambda: write_quilt(IMAGE, "a.png"), "quilt"),
        (lambda: weave(IMAGE, SMALL), "quilt"),
        (lambda: open_motion("teapot", fps="a"), "fps"),
        (lambda: lippmann.IntegralImage(IMAGE.pixels, 5), "display"),
        (lambda: lippmann.IntegralImage(IMAGE.pixels, SMALL, maps=5), "maps"),
        (lambda: lippmann.IntegralImage(IMAGE.pixels, SMALL, provenance=5), "provenance"),
        (lambda: lippmann.RenderRequest(fixed_noise="a"), "fixed_noise"),
        (lambda: lippmann.load_scene("a.glb", variants=5), "variants"),
        (lambda: Quilt(5, QuiltLayout(3, 1, 1.5)), "values"),
        (lambda: Quilt(IMAGE.pixels, 5), "layout"),
        (lambda: FrameRange("a"), "first"),
        (lambda: FrameRange(0, 10, 2.5), "step"),
        (lambda: render_sequence("teapot", SMALL), "motion"),
        (lambda: export_page([IMAGE], "a.html"), "pictures"),
        (lambda: export_page(IMAGE, "a.html"), "pictures"),
        (lambda: draw("stripes", SMALL), "pattern"),
    ],
)
def test_calls_of_the_library_check_theirs(wrong, name):
    with pytest.raises(UsageError) as caught:
        wrong()
    assert caught.value.parameter == name


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: weave(QUILT, "portrait"), "display: 'portrait'; must be a Display; lippmann.load_display gives one"),
        (lambda: prove("portrait"), "display: 'portrait'; it must be a Display; lippmann.load_display gives one"),
        (lambda: Lens.of(5), "display: 5; it must be a Display; lippmann.load_display gives one"),
        (lambda: crosstalk(5, 0.0), "display: 5; it must be a Display; lippmann.load_display gives one"),
        (lambda: independent_directions(5), "display: 5; it must be a Display; lippmann.load_display gives one"),
        (lambda: eye_light(5, (0.0, 0.1), (0.0, 0.0)), "display: 5; it must be a Display; lippmann.load_display gives"),
        (lambda: eye_light(PRINT, 5, (0.0, 0.0)), "slopes_x: 5; must be two finite numbers"),
        (lambda: eye_light(PRINT, (0.0, 0.1), ("a", 0.0)), "slopes_y: ('a', 0.0); must be two finite numbers"),
        (lambda: Scene(5), "name: 5; must be a text"),
        (lambda: Scene("mine", 5), "description: 5; must be a SceneDescription, a MitsubaSource or None"),
        (lambda: Scene("mine"), "mine: a scene without any content; lippmann.load_scene gives one"),
        (lambda: light_table(5, 0.0), "lens: 5; it must be a Lens; Lens.of(display) gives one"),
        (lambda: light_table(LENS, "a"), "slopes: 'a'; must be a finite number, or a row of them"),
        (lambda: light_table(LENS, [[0.0]]), "slopes: [[0.0]]; must be a finite number"),
        (lambda: light_table(LENS, math.nan), "slopes: nan; must be a finite number"),
        (lambda: true_directions(5), "lens: 5; it must be a Lens; Lens.of(display) gives one"),
        (lambda: replace(SMALL, panel=5), "panel: 5; it must be a Panel"),
        (lambda: replace(SMALL, lens_array=5), "lens_array: 5; it must be a LensArray"),
    ],
)
def test_what_is_of_another_kind_is_told_where_one_comes_from(wrong, said):
    with pytest.raises(LippmannError) as caught:
        wrong()
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: IMAGE.with_pixels("a"),
        lambda: IMAGE.with_pixels(1j * IMAGE.pixels),
        lambda: lippmann.IntegralImage.from_views("a", SMALL),
        lambda: lippmann.IntegralImage.from_micro_images("a", SMALL),
    ],
)
def test_what_is_no_array_of_numbers_is_refused(wrong):
    with pytest.raises(LippmannError, match="no array of numbers"):
        wrong()
