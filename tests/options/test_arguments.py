"""Arguments of calls are refused in one line before anything is done, or become what their annotations say."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import lippmann
from lippmann.errors import LippmannError, UsageError
from lippmann.exchange.layouts import export_image, import_image
from lippmann.options.option import checked
from lippmann.quilts.files import read_quilt, write_quilt
from lippmann.quilts.weave import weave
from lippmann.sequences.motion import open_motion


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
        (lambda: write_quilt(IMAGE, "a.png"), "quilt"),
        (lambda: weave(IMAGE, SMALL), "quilt"),
        (lambda: open_motion("teapot", fps="a"), "fps"),
    ],
)
def test_calls_of_the_library_check_theirs(wrong, name):
    with pytest.raises(UsageError) as caught:
        wrong()
    assert caught.value.parameter == name


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: IMAGE.with_pixels("a"),
        lambda: lippmann.IntegralImage.from_views("a", SMALL),
        lambda: lippmann.IntegralImage.from_micro_images("a", SMALL),
    ],
)
def test_what_is_no_array_of_numbers_is_refused(wrong):
    with pytest.raises(LippmannError, match="no array of numbers"):
        wrong()
