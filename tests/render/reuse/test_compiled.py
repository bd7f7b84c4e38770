"""Compiled kernels are kept on disk, and forgotten when any of their sources changes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

KERNEL = """
from lippmann.render.reuse import compiled
compiled.source_stamp = lambda folder: STAMP

@compiled.uncounted
def double(x):
    return 2 * x

assert double(21) == 42
print(len(double.stats.cache_hits), len(double.stats.cache_misses))
"""


def run(tmp_path, stamp, cache):
    path = tmp_path / "kernel.py"
    source = KERNEL.replace("STAMP", repr(stamp))
    if not path.exists() or path.read_text() != source:
        path.write_text(source)
    # Another stamp of the folder alone makes a kernel old: its own file looks as it did.
    os.utime(path, (1e9, 1e9))
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, str(path)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()


def test_a_second_process_does_not_compile_and_a_changed_package_does(tmp_path):
    cache = tmp_path / "cache"
    assert run(tmp_path, "a", cache) == ["0", "1"]
    assert run(tmp_path, "a", cache) == ["1", "0"]
    assert run(tmp_path, "b", cache) == ["0", "1"]


def test_kernels_run_where_nothing_can_be_kept(monkeypatch):
    from numba.core import caching

    from lippmann.render.reuse.compiled import compiled

    monkeypatch.setattr(caching.CompileResultCacheImpl, "_locator_classes", [])

    def triple(x):
        return 3 * x

    assert compiled(triple)(5) == 15


def test_the_stamp_covers_all_modules_of_the_folder(tmp_path):
    from lippmann.render.reuse import compiled

    stamps = []
    for name, text in (("compiled.py", "a"), ("rules.py", "b"), ("rules.py", "c"), ("notes.txt", "d")):
        (tmp_path / name).write_text(text)
        stamps.append(compiled.source_stamp.__wrapped__(tmp_path))
    assert len(set(stamps)) == 3
    assert stamps[2] == stamps[3]


REUSE = ["bridging", "carrying", "drawing", "following", "gathering", "growth", "places", "plain", "tracing", "walking"]


@pytest.mark.parametrize("module", [*(f"render.reuse.{name}" for name in REUSE), "quality.kernels", "weave_kernel"])
def test_no_kernel_is_left_out(module):
    import importlib
    from pathlib import Path

    from lippmann.render.reuse.compiled import source_stamp

    loaded = importlib.import_module(f"lippmann.{module}")
    names, folder = vars(loaded), Path(loaded.__file__).parent
    kept = [value._cache for value in names.values() if hasattr(getattr(value, "_cache", None), "_cache_file")]
    assert kept
    assert {cache._cache_file._source_stamp for cache in kept} == {source_stamp(folder)}
