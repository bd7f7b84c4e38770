"""The cursor over the words of a text scene file."""

import re

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.parsing.tokens import Words


def words(text: str, **options) -> Words:
    return Words(text, "file.dat", comment=re.compile(r"#[^\n]*"), **options)


def test_reads_in_turn():
    run = words("Sphere 1 -2.5 .5e1\n 7 # the rest\n tail")
    run.keyword("SPHERE")
    assert run.vector() == (1.0, -2.5, 5.0)
    assert run.integer(0, 9) == 7
    assert run.left == 1
    assert not run.has("OTHER")
    assert run.name("a name") == "tail"
    assert run.left == 0


@pytest.mark.parametrize(
    "text", ["nan", "inf", "-Infinity", "1e39", "1e999", "0x1p3", "1_0", "1.2.3", "e5", "", "1,5", "\u0661", "--1"]
)
def test_only_finite_numbers_of_single_precision(text):
    with pytest.raises(SceneError, match="expected a finite number"):
        words(text).number()
    for count in (1, 3):
        with pytest.raises(SceneError, match="expected a finite number"):
            words(" 1" * (count - 1) + " " + text).floats(count)
    with pytest.raises(SceneError, match="expected a finite number"):
        words(f"0 {text} 0").vector()


def test_single_precision_is_kept_where_asked():
    assert words("0.1", single=True).number() == float(np.float32(0.1))
    assert words("0.1").number() == 0.1
    assert words("0.1 0.2 0.3", single=True).vector() == tuple(np.float32([0.1, 0.2, 0.3]).astype(float).tolist())
    np.testing.assert_array_equal(words("0.1 0.2", single=True).numbers(1, 2), np.float32([[0.1, 0.2]]))


@pytest.mark.parametrize(("text", "line"), [("x", 1), ("\n\n x", 3), ("a b # x x\nc\n\nx", 4), ("a\r\nx", 2)])
def test_errors_know_the_line(text, line):
    run = words(text)
    while run.peek() != "x":
        run.take()
    with pytest.raises(SceneError, match=rf"^file\.dat:{line}: found 'x'; expected END$"):
        run.keyword("END")


def test_end_of_the_file_is_the_line_of_its_last_word():
    run = words("a\nb\n\n\n")
    run.take(), run.take()
    assert run.take() == ""
    with pytest.raises(SceneError, match=r"^file\.dat:2: the file ends too early; expected MORE$"):
        run.keyword("MORE")


def test_long_and_unprintable_words_are_shown_short_and_plain():
    with pytest.raises(SceneError) as caught:
        words("\x1b[2J" + "x" * 5000).number()
    assert len(str(caught.value)) < 120
    assert str(caught.value).isprintable()


def test_counts_must_fit_in_the_file():
    with pytest.raises(SceneError, match="found '2000000000'; expected a count that the file can hold"):
        words("2000000000 1 2 3").count(3)
    with pytest.raises(SceneError, match="expected a whole number"):
        words("99999999999999999999999 1 2 3").count(3)
    assert words("1 1 2 3").count(3) == 1


@pytest.mark.parametrize("text", ["1 2 3 -1", "1 2 3 4", "1 2 3 1.0", "1 2 3"])
def test_indices_are_checked(text):
    with pytest.raises(SceneError, match="expected a whole number from 0 to 3"):
        words(text).indices(2, 2, 4)
    assert words("0 1 2 3").indices(2, 2, 4).tolist() == [[0, 1], [2, 3]]
