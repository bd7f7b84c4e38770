"""The C interface of Open Image Denoise: errors are told, and filters are closed when their memory may go."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import re

import numpy as np
import pytest

from lippmann.runtime import open_image_denoise as library

pytest.importorskip("pyoidn")

SIZE = (160, 160, 3)


@pytest.fixture(scope="module")
def device():
    device = library.Device(library.DEVICE_TYPE_CPU, numThreads=1, setAffinity=False)
    assert not device.error()
    yield device
    device.close()


@pytest.fixture
def closed(monkeypatch):
    """The filters that were closed so far."""
    filters = []

    class Noted(library.Filter):
        def close(self):
            super().close()
            filters.append(self)

    monkeypatch.setattr(library, "Filter", Noted)
    return filters


def run(device, picture, is_hdr=True):
    clean = np.empty_like(picture)
    with library.open_filter(device, ["color"], {"hdr": is_hdr}) as work:
        work.set_image("color", picture)
        work.set_image("output", clean)
        work.run()
    assert not device.error()
    return clean


def test_filters_close_after_their_run_or_with_the_block_that_keeps_them(device, closed):
    pictures = np.random.default_rng(3).random((3, *SIZE), dtype=np.float32)
    alone = [run(device, picture) for picture in pictures]
    plain = run(device, pictures[0], is_hdr=False)
    assert len(closed) == 4
    with library.keep_filters():
        # One for three pictures, of which none is mistaken for another, and one for other options.
        assert np.array_equal([run(device, picture) for picture in pictures], alone)
        assert np.array_equal(run(device, pictures[0], is_hdr=False), plain)
        assert not np.array_equal(plain, alone[0])
        assert len(closed) == 4
    assert len(closed) == 6
    run(device, pictures[0])
    assert len(closed) == 7


def test_filters_close_after_an_error_too(device, closed):
    def fails():
        with library.keep_filters(), library.open_filter(device, ["color"], {}):
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert len(closed) == 1


def test_errors_are_told_once(device):
    with library.open_filter(device, ["color"], {}) as work:
        work.run()  # without any picture
    assert "image" in device.error()
    assert device.error() == ""


@pytest.mark.parametrize(
    "package", [None, importlib.machinery.ModuleSpec("pyoidn", None, origin="/nowhere/__init__.py")]
)
def test_a_library_that_is_not_there_is_an_error_of_the_system(monkeypatch, package):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: package)
    with pytest.raises(OSError, match=re.compile("not installed|nowhere")):
        library.load.__wrapped__()
