"""What is the same has the same sum, everywhere; what differs is named."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.journal import content_hash, differences
from lippmann.scene import bundled
from lippmann.scene.readers.load import load_scene

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=8,
)


@dataclass(frozen=True)
class Thing:
    name: str
    values: object
    _cache: object = None


@settings(deadline=None)
@given(a=PLAIN, b=PLAIN)
def test_only_equal_values_have_equal_sums(a, b):
    # 1, 1.0 and True are equal in Python and different in a file; repr tells them apart.
    assert (content_hash(a) == content_hash(b)) == (repr(_sorted(a)) == repr(_sorted(b)))


def _sorted(value):
    if isinstance(value, dict):
        return {key: _sorted(value[key]) for key in sorted(value, key=repr)}
    return [_sorted(item) for item in value] if isinstance(value, list) else value


@pytest.mark.parametrize(
    "other",
    [
        np.arange(6, dtype=np.float64).reshape(2, 3),
        np.arange(6, dtype=np.float32).reshape(3, 2),
        np.arange(1, 7, dtype=np.float32).reshape(2, 3),
    ],
)
def test_type_shape_and_values_of_arrays_count(other):
    array = np.arange(6, dtype=np.float32).reshape(2, 3)
    assert content_hash(array) == content_hash(np.asfortranarray(array))
    assert content_hash(array) != content_hash(other)


def test_fields_count_but_not_those_of_its_own_nor_the_order_of_a_mapping():
    assert content_hash({"a": 1, "b": 2}) == content_hash({"b": 2, "a": 1})
    assert content_hash(Thing("a", 1, "x")) == content_hash(Thing("a", 1, "y"))
    assert content_hash(Thing("a", 1)) != content_hash(Thing("a", 2))


def test_of_a_path_its_content_counts(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_bytes(b"same")
    two.write_bytes(b"same")
    assert content_hash(one) == content_hash(two)
    two.write_bytes(b"other")
    assert content_hash(one) != content_hash(two)


def test_what_is_no_plain_value_is_refused():
    with pytest.raises(TypeError, match="object"):
        content_hash([object()])


@pytest.mark.parametrize("name", sorted(bundled.names()))
def test_scenes_have_sums(name):
    scene = load_scene(name)
    assert content_hash(scene) == content_hash(load_scene(name))
    assert content_hash(scene) != content_hash(replace(scene, name="another"))


@pytest.mark.slow
def test_sums_are_the_same_in_another_process():
    code = "from lippmann.scene.readers.load import load_scene; from lippmann.journal import content_hash; "
    code += "print(content_hash(load_scene('teapot')), content_hash({'a', 'b', 'c'}))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == [content_hash(load_scene("teapot")), content_hash({"a", "b", "c"})]


def test_differences_are_named():
    old = {"spp": "4", "the scene": "0" * 64, "gone": "x", "same": "1"}
    new = {"spp": "8", "the scene": "1" * 64, "same": "1", "more": "y"}
    assert differences(old, new) == ["spp (was 4, is 8)", "the scene", "gone (is gone)", "more (is new)"]
    assert differences(old, old) == []
