"""PFM: every float comes back, and what is no whole PFM is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from lippmann.codecs.pfm import read_pfm, write_pfm
from lippmann.errors import PictureError


@settings(deadline=None, max_examples=20)
@given(arrays.arrays(np.float32, arrays.array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.floats(width=32)))
def test_floats_come_back_bit_by_bit(tmp_path_factory, values):
    path = tmp_path_factory.getbasetemp() / "x.pfm"
    write_pfm(path, values)
    assert read_pfm(path).tobytes() == values.tobytes()


def test_the_lowest_row_comes_first(tmp_path):
    write_pfm(tmp_path / "x.pfm", np.array([[1, 2], [3, 4]], dtype=np.float32))
    content = (tmp_path / "x.pfm").read_bytes()
    assert content.startswith(b"Pf\n2 2\n-1.0\n")
    assert np.frombuffer(content[-16:], "<f4").tolist() == [3, 4, 1, 2]


def test_big_endian_is_read(tmp_path):
    (tmp_path / "x.pfm").write_bytes(b"Pf\n1 2\n1.000000\n" + np.array([5, -6], ">f4").tobytes())
    assert read_pfm(tmp_path / "x.pfm").tolist() == [[-6], [5]]


def test_values_are_as_they_stand_whatever_the_size_of_the_scale(tmp_path):
    (tmp_path / "x.pfm").write_bytes(b"Pf\n2 1\n-0.003922\n" + np.array([5, -6], "<f4").tobytes())
    assert read_pfm(tmp_path / "x.pfm").tolist() == [[5, -6]]


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"", "is no PFM"),
        (b"P6\n1 1\n255\n123", "is no PFM"),
        (b"Pf\n1\n-1.0\n1234", "is no PFM"),
        (b"PF\n1 1\n-1.0\n" + bytes(12), "is a PFM in colour"),
        (b"Pf\n2 2\n-1.0\n" + bytes(15), "is cut short: 15 bytes follow its header; 2 x 2 values take 16 bytes"),
        (b"Pf\n2 2\n-1.0\n" + bytes(17), "is too long"),
        (b"Pf\n999999999 999999999\n-1.0\n" + bytes(16), "is cut short"),
    ],
)
def test_what_is_no_whole_pfm_is_refused_by_name(tmp_path, content, what):
    (tmp_path / "x.pfm").write_bytes(content)
    with pytest.raises(PictureError, match=r"x\.pfm") as refused:
        read_pfm(tmp_path / "x.pfm")
    assert what in str(refused.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(PictureError, match=r"x\.pfm: no such file"):
        read_pfm(tmp_path / "x.pfm")
