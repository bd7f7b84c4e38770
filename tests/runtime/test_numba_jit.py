"""Compiled kernels are kept on disk, and forgotten when any of their sources changes."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.runtime import numba_jit

KERNEL = """
from lippmann.runtime import numba_jit as compiled
compiled.source_stamp = lambda folder: STAMP

@compiled.uncounted
def double(x):
    return 2 * x

assert double(21) == 42
print(len(double.stats.cache_hits), len(double.stats.cache_misses))
"""


@pytest.mark.slow
def test_a_second_process_does_not_compile_and_a_changed_package_does(tmp_path, monkeypatch, capsys):
    from numba.core import config

    path, cache = tmp_path / "kernel.py", str(tmp_path / "cache")
    monkeypatch.setenv("NUMBA_CACHE_DIR", cache)
    monkeypatch.setattr(config, "CACHE_DIR", cache)
    monkeypatch.setattr(numba_jit, "source_stamp", numba_jit.source_stamp)  # the kernels' file sets it

    def run(stamp):
        source = KERNEL.replace("STAMP", repr(stamp))
        path.write_text(source)
        # Another stamp of the folder alone makes a kernel old: its own file looks as it did.
        os.utime(path, (1e9, 1e9))
        exec(compile(source, str(path), "exec"), {"__name__": "__main__"})
        return capsys.readouterr().out.split()

    assert run("a") == ["0", "1"]
    second = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, check=True)
    assert second.stdout.split() == ["1", "0"]
    assert run("b") == ["0", "1"]


def test_kernels_run_where_nothing_can_be_kept(monkeypatch):
    from numba.core import caching

    from lippmann.runtime.numba_jit import compiled

    monkeypatch.setattr(caching.CompileResultCacheImpl, "_locator_classes", [])

    def triple(x):
        return 3 * x

    assert compiled(triple)(5) == 15


def test_the_stamp_covers_all_modules_of_the_folder(tmp_path):
    from lippmann.runtime import numba_jit as compiled

    stamps = []
    for name, text in (("compiled.py", "a"), ("rules.py", "b"), ("rules.py", "c"), ("notes.txt", "d")):
        (tmp_path / name).write_text(text)
        stamps.append(compiled.source_stamp.__wrapped__(tmp_path))
    assert len(set(stamps)) == 3
    assert stamps[2] == stamps[3]


SOURCE = Path(numba_jit.__file__).parents[1]
#: Modules with kernels of their own that are kept on disk.
KERNELS = sorted(
    ".".join(path.relative_to(SOURCE).with_suffix("").parts)
    for path in SOURCE.rglob("*.py")
    if re.search(r"^@(compiled|uncounted)$", path.read_text(encoding="utf-8"), re.MULTILINE)
)


def test_there_are_kernels():
    assert {"metrics.kernels", "quilts.weave_kernel", "rendering.reprojection.paper_order"} <= set(KERNELS)


@pytest.mark.parametrize("module", KERNELS)
def test_no_kernel_is_left_out(module):
    import importlib

    from lippmann.runtime.numba_jit import source_stamp

    loaded = importlib.import_module(f"lippmann.{module}")
    names, folder = vars(loaded), Path(loaded.__file__).parent
    kept = [value._cache for value in names.values() if hasattr(getattr(value, "_cache", None), "_cache_file")]
    assert kept
    assert {cache._cache_file._source_stamp for cache in kept} == {source_stamp(folder)}


FORK = """
import os, threading, time
from numba.core.compiler_lock import global_compiler_lock
from lippmann.runtime.numba_jit import compiled

def double(x):
    return 2 * x

ready = compiled(double)
assert ready(2) == 4
begun = threading.Event()

def compile_for_a_while():
    with global_compiler_lock:
        begun.set()
        time.sleep(1)

threading.Thread(target=compile_for_a_while).start()
begun.wait()
child = os.fork()
if child == 0:
    print(compiled(lambda x: 3 * x)(7), ready(2.5), ready._cache._cache_file._data_name(1), flush=True)
    os._exit(0)
for _ in range(600):
    ended, status = os.waitpid(child, os.WNOHANG)
    if ended:
        break
    time.sleep(0.05)
else:
    os.kill(child, 9)
print(ready(2.5), ready._cache._cache_file._data_name(1))
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_child_forked_while_a_kernel_is_compiled_compiles_and_keeps_kernels_under_its_own_name(tmp_path):
    path = tmp_path / "kernels.py"
    path.write_text(FORK)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-W", "ignore:This process:DeprecationWarning", str(path)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=100)
    child, parent = (line.split() for line in done.stdout.splitlines())
    assert child[:2] == ["21", "5.0"]
    assert parent[0] == "5.0"
    assert child[-1] != parent[-1]


DEFERRED = """
import sys
from lippmann.runtime.numba_jit import inlined, uncounted

@inlined
def double(x):
    return 2 * x

@uncounted
def fourfold(x):
    return double(double(x))

@uncounted
def eightfold(x):
    return fourfold(double(x))

print("numba" in sys.modules, eightfold.__name__)
print(eightfold(1), fourfold(1.5), "numba" in sys.modules)
"""


def test_numba_is_loaded_when_a_kernel_is_first_called(tmp_path):
    path = tmp_path / "kernels.py"
    path.write_text(DEFERRED)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, str(path)], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["False eightfold", "8 6.0 True"]
