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


def run(device, picture):
    clean = np.empty_like(picture)
    with library.open_filter(device) as work:
        work.set_image("color", picture)
        work.set_image("output", clean)
        work.set_option("hdr", True)
        work.run()
    assert not device.error()
    return clean


def test_filters_close_after_their_run_or_with_the_block_that_keeps_memory(device, closed):
    picture = np.random.default_rng(3).random(SIZE, dtype=np.float32)
    alone = run(device, picture)
    assert len(closed) == 1
    with library.keep_memory():
        runs = [run(device, picture) for _ in range(2)]
        assert len(closed) == 1
    assert len(closed) == 3
    assert all(np.array_equal(each, alone) for each in runs)
    run(device, picture)
    assert len(closed) == 4


def test_filters_close_after_an_error_too(device, closed):
    def fails():
        with library.keep_memory(), library.open_filter(device):
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert len(closed) == 1


def test_errors_are_told_once(device):
    with library.open_filter(device) as work:
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
