"""Operations in their fast form: the same numbers, and the fast code."""

from __future__ import annotations

import ctypes
import mmap
import sys
from dataclasses import dataclass

import numpy as np
import pytest

from lippmann.color.transfer import encode
from lippmann.device.kernel_ops import arrays_of

pytestmark = pytest.mark.usefixtures("engine")


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int64, np.uint32])
def test_upload_keeps_the_values(dtype):
    from lippmann.device.kernel_ops import upload

    values = np.array([[0, 1], [2**24 - 1, 3]], dtype)
    np.testing.assert_array_equal(np.array(upload(values)), values.ravel())


def test_upload_of_nothing():
    from lippmann.device.kernel_ops import upload

    assert len(upload(np.zeros((0, 4)))) == 0


@pytest.mark.parametrize("count", [1, 2, 3, 8])
def test_a_binary_search_answers_an_array_for_any_range(count):
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import binary_search

    table, wanted = np.arange(1, count + 1, dtype=np.float32), np.linspace(0.5, count + 1.5, 32, dtype=np.float32)
    found = binary_search(0, count - 1, lambda place: dr.gather(mi.Float, mi.Float(table), place) < mi.Float(wanted))
    assert isinstance(found, mi.UInt32)
    expected = np.minimum(np.searchsorted(table, wanted), count - 1)
    np.testing.assert_array_equal(np.broadcast_to(np.array(found), 32), expected)


def test_uploaded_tables_do_not_follow_the_array():
    from lippmann.device.kernel_ops import upload

    values = np.arange(64, dtype=np.float32)
    table = upload(values)
    values[:] = -1
    np.testing.assert_array_equal(np.array(table), np.arange(64))


def test_rows_of_uploaded_tables_are_fetched_in_packets():
    """One packet of loads, no masked gather of single columns."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import upload

    if not mi.variant().startswith("llvm"):
        pytest.skip("packets of loads are for the CPU")
    table = upload(np.arange(4096, dtype=np.float32))
    index = dr.arange(mi.UInt32, 512) * 3 % 1024
    dr.eval(index)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.eval(dr.gather(mi.Vector4f, table, index))
        (kernel,) = [k for k in dr.kernel_history() if "ir" in k]
    assert "masked.gather" not in str(kernel["ir"].getvalue() if hasattr(kernel["ir"], "getvalue") else kernel["ir"])


def test_smaller_and_larger():
    import mitsuba as mi

    from lippmann.device.kernel_ops import larger, smaller

    a, b = mi.Float([1, 5, np.nan]), mi.Float([2, -3, 7])
    assert np.array(smaller(a, b)).tolist() == [1, -3, 7]
    assert np.array(larger(a, b)).tolist() == [2, 5, 7]


@pytest.mark.skipif(sys.platform != "linux", reason="pages are protected by Linux' own call")
@pytest.mark.parametrize("number", [1, 15, 1021, 1024])
def test_nothing_is_read_beyond_the_end_of_a_table(number):
    """The values end where a page does, and the next page cannot be read."""
    from lippmann.device.kernel_ops import upload

    page = mmap.PAGESIZE
    memory = mmap.mmap(-1, 3 * page)
    start = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    protect = ctypes.CDLL(None, use_errno=True).mprotect
    assert protect(ctypes.c_void_p(start + 2 * page), page, 0) == 0
    values = np.frombuffer((ctypes.c_char * (4 * number)).from_address(start + 2 * page - 4 * number), np.float32)
    values[:] = np.arange(number)
    np.testing.assert_array_equal(np.array(upload(values)), np.arange(number))
    assert protect(ctypes.c_void_p(start + 2 * page), page, mmap.PROT_READ | mmap.PROT_WRITE) == 0


pytestmark = pytest.mark.usefixtures("engine")


@dataclass(eq=False)
class Part:
    value: object
    name: str = "a"
    count: int = 3
    more: object = None


def test_arrays_and_textures_of_all_parts_are_found_once():
    import mitsuba as mi

    number, color, texels = mi.Float(1), mi.Color3f(1), mi.UInt32([1, 2])
    texture = mi.load_dict({"type": "checkerboard"})
    whole = Part((number, Part(color, more=Part(texture))), more=Part(number, more=(texels, None, 1.5)))
    found = arrays_of(whole)
    assert [id(each) for each in found] == [id(each) for each in (number, color, texture, texels)]


def test_plugins_show_their_arrays_and_hide_their_models():
    from lippmann.device.pbr.gltf_bsdf import surface_bsdf
    from lippmann.device.pbr.gltf_bsdf_parameters import SurfaceModel
    from lippmann.device.pbr.textures import Signal, numbers

    def signal(value):
        return Signal(numbers([value]))

    bsdf = surface_bsdf(SurfaceModel(Signal(numbers([(0.5, 0.2, 0.1)])), signal(0.5), signal(1.5)))
    assert list(vars(bsdf)) == ["arrays"]
    assert len(bsdf.arrays) == 3


pytestmark = pytest.mark.usefixtures("engine")


@pytest.mark.parametrize("coding", ["srgb", "linear", "pbr-neutral"])
def test_codes_are_those_of_the_host(coding):
    import mitsuba as mi

    from lippmann.device.kernel_ops import encode as encode_on_device

    linear = np.concatenate([[-1, 0, 0.0031308, 1, 2], np.geomspace(1e-6, 100, 499)]).astype(np.float32)
    colors = np.stack([linear, linear[::-1], 0.3 * linear], axis=1)
    color = np.array(encode_on_device(mi.Color3f(colors.T), coding))
    np.testing.assert_allclose(color.T, encode(colors, coding), atol=2e-6)
