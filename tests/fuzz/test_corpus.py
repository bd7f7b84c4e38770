"""Every input that ever broke a reader, and every sound one, ends as it should."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from guard import judge, quiet
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutation import Mutator
from targets import CORPUS, TARGETS, emptied, found, named_seeds, seeds

from lippmann.errors import LippmannError

#: Sound inputs that are refused for what they lack.
REFUSED = {
    ("layout-lftoolbox", "seed-5"): "has no display in it",
    ("layout-lftoolbox", "seed-5-packed"): "has no display in it",
    # Their pixels are read first.
    **{("photograph", seed): "needs a depth map" for seed in named_seeds("photograph") if seed.endswith(".tif")},
}


#: All tests of a target run one after the other, by one process of its library.
each_target = pytest.mark.parametrize("name", TARGETS, scope="module")


@cache
def warmed(name: str) -> bool:
    """Loads the libraries of a reader, which is not to count as an input's time."""
    with tempfile.TemporaryDirectory() as folder, suppress(LippmannError):
        TARGETS[name].read(seeds(name)[0], Path(folder))
    return True


@pytest.fixture
def looked_at(tmp_path):
    """What is wrong with an input's end, printed lines included; empty if nothing is."""

    def look(name: str, data: bytes) -> str:
        assert warmed(name)
        with quiet() as said:
            broken = judge(TARGETS[name].read, data, emptied(tmp_path), TARGETS[name].seconds).broken
            return broken + said()

    return look


def test_the_corpus_is_that_of_the_targets():
    assert {path.name for path in CORPUS.iterdir()} <= set(TARGETS)
    size = sum(path.stat().st_size for path in CORPUS.rglob("*") if path.is_file())
    assert size < 500_000


@pytest.mark.long_cases("rendered-gltf", "rendered-obj", "rendered-mitsuba-xml")
@pytest.mark.slow
@each_target
def test_sound_inputs_are_read(name, tmp_path):
    sound = named_seeds(name)
    assert sound
    for seed, data in sound.items():
        try:
            TARGETS[name].read(data, emptied(tmp_path))
        except Exception as error:
            if REFUSED.get((name, seed), "nothing") not in str(error):
                raise


@pytest.mark.slow
@each_target
def test_what_broke_a_reader_once_does_so_no_more(name, looked_at):
    assert {path.name: broken for path in found(name) if (broken := looked_at(name, path.read_bytes()))} == {}


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("obj", b"=== s.obj\n" + b"".join(b"mtllib %d.mtl\n" % number for number in range(40_000)) + b"f 1 2 3\n"),
        ("obj", b"=== s.obj\n" + b"mtllib none.mtl\n" * 100_000 + b"f 1 2 3\n"),
        ("obj", b"=== s.obj\nmtllib " + b"none.mtl " * 50_000 + b"\nf 1 2 3\n"),
        ("obj", b"=== s.obj\nmtllib " + b"a/" * 200_000 + b"\nf 1 2 3\n"),
        ("stl", b"solid" + b"\n" * 200_000 + b"facet"),
        ("parameters-cfg", b"[intrinsics]\nfocal_length_mm = 1\n" + b" f\n" * 150_000),
    ],
    ids=["libraries", "one library", "one line of libraries", "folders", "blank lines", "lines"],
)
def test_long_inputs_end_in_time(name, data, looked_at):
    assert looked_at(name, data) == ""


@pytest.mark.long_cases("rendered-obj")
@pytest.mark.slow
@each_target
def test_damaged_inputs_end_in_a_result_or_an_error(name, looked_at):
    target = TARGETS[name]
    mutator = Mutator(seeds(name), target.words, tree=target.tree, repair=target.repair, seed=20)
    for _ in range(25):
        data = mutator.next()
        assert looked_at(name, data) == "", data


@pytest.mark.slow
@each_target
@settings(
    deadline=None, max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(data=st.binary(max_size=120) | st.text(max_size=60).map(lambda text: text.encode("utf-8", "surrogatepass")))
def test_foreign_inputs_end_in_a_result_or_an_error(name, looked_at, data):
    assert looked_at(name, data) == ""
