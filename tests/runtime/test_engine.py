"""Starting the engine is tested in processes of their own: Dr.Jit takes one LLVM library for the life of a process, and
a bad one ends it."""

import os
import subprocess
import sys
import typing

import pytest

from lippmann.errors import UsageError
from lippmann.runtime import engine, llvm, machine

OLD = [library for library in llvm.installed() if library.version and library.version[0] < llvm.OLDEST]
GOOD = [library for library in llvm.installed() if not library.problem]

needs_good = pytest.mark.skipif(not GOOD, reason="no LLVM library that would do is installed")
needs_cpu_only = pytest.mark.skipif(machine.find_gpu() is not None, reason="the GPU would be used")

#: The package manager takes long to ask.
QUICKLY = "from lippmann.runtime import llvm; llvm.install_command = lambda: 'install LLVM'\n"
NOTHING_FOUND = QUICKLY + "llvm.listed_files = lambda: iter(()); llvm.search_folders = lambda: []\n"


def python(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run ``code`` in a process that lacks the caller's choice of a library."""
    inherited = {key: value for key, value in os.environ.items() if key != llvm.PATH_VARIABLE}
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={**inherited, **environment},
    )


def start_fails(before: str = "", device: str = "cpu", **environment: str) -> str:
    """The one-line message with which ``start`` fails, after it was seen that nothing was loaded."""
    code = before + (
        "import sys; from lippmann.runtime import engine\n"
        "from lippmann.errors import EngineError\n"
        f"try: engine.start({device!r})\n"
        "except EngineError as error: print(error)\n"
        "else: print('no error')\n"
        "print('loaded', sorted({'drjit', 'mitsuba'} & set(sys.modules)))\n"
    )
    run = python(code, **environment)
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    message, loaded = run.stdout.splitlines()
    assert loaded == "loaded []"
    assert message != "no error"
    return message


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ({"device": "tpu"}, "unknown device 'tpu'"),
        ({"threads": 0}, "threads: 0 is out of range"),
        ({"threads": -3}, "threads: -3 is out of range"),
    ],
)
def test_arguments_out_of_range(arguments, problem):
    with pytest.raises(UsageError, match=problem):
        engine.start(**arguments)


@pytest.mark.slow
def test_no_library_found():
    message = start_fails(NOTHING_FOUND)
    assert "no usable LLVM library is installed" in message
    assert "install LLVM" in message


@pytest.mark.slow
@needs_cpu_only
def test_no_library_found_on_the_device_of_choice():
    assert "no usable LLVM library is installed" in start_fails(NOTHING_FOUND, device="auto")


@pytest.mark.slow
def test_named_library_is_missing_and_a_gpu_does_not_excuse_it(tmp_path):
    before = QUICKLY + "from lippmann.runtime import machine; machine.find_gpu = lambda: 'Test GPU'\n"
    path = str(tmp_path / "libLLVM.so.19.1")
    assert f"'{path}' not found" in start_fails(before, device="auto", **{llvm.PATH_VARIABLE: path})


@pytest.mark.slow
def test_library_states_a_good_version_and_cannot_be_loaded(tmp_path):
    path = tmp_path / "libLLVM.so.19.1"
    path.write_text("no library" * 100)
    code = QUICKLY + (
        "from pathlib import Path; from lippmann.runtime import engine, llvm; from lippmann.errors import EngineError\n"
        f"llvm.choose = lambda: llvm.Library(Path({str(path)!r}), (19, 1))\n"
        "try: engine.start('cpu')\n"
        "except EngineError as error: print(error)\n"
    )
    run = python(code)
    assert run.returncode == 0, run.stderr
    assert f"the LLVM library '{path}' could not be used" in run.stdout
    assert "ELF" in run.stdout or not sys.platform.startswith("linux")  # the loader's own words
    assert "install LLVM" in run.stdout


@needs_good
def test_library_that_mitsuba_misses_is_named(tmp_path):
    # Dr.Jit's own report of it ends in a NameError.
    (tmp_path / "drjit.py").write_text(
        "try: raise ImportError('libatomic.so.1: cannot open shared object file: No such file or directory')\n"
        "except ImportError: undefined_name\n"
    )
    code = (
        "from lippmann.runtime import engine; from lippmann.errors import EngineError\n"
        "try: engine.start('cpu')\n"
        "except EngineError as error: print(error)\n"
    )
    run = python(code, PYTHONPATH=str(tmp_path))
    assert run.returncode == 0, run.stderr
    assert "libatomic.so.1: cannot open" in run.stdout
    assert "sudo apt-get install libatomic1" in run.stdout


@needs_good
def test_start_is_whole_and_can_be_repeated():
    code = (
        "import os, sys; from lippmann.runtime import engine\n"
        "one = engine.start('cpu', threads=1); two = engine.start('cpu', threads=1)\n"
        "assert one == two, (one, two)\n"
        "import drjit as dr, mitsuba as mi\n"
        "assert mi.variant() == one.variant == 'llvm_ad_rgb'\n"
        "assert dr.thread_count() == one.threads == 1\n"
        "assert engine.start('cpu').threads == dr.thread_count()\n"
        "assert mi.log_level() == mi.LogLevel.Error\n"
        "assert dr.log_level() == dr.LogLevel.Error\n"
        "assert float(dr.sum(mi.Float(1, 2, 3))[0]) == 6\n"
        "print(os.environ['DRJIT_LIBLLVM_PATH'], one.llvm_version, engine.start('cpu').threads)\n"
    )
    run = python(code)
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    path, version, threads = run.stdout.split()
    assert path == str(GOOD[0].path)
    assert version.startswith(GOOD[0].version_text)
    assert int(threads) == machine.usable_cores()


@needs_good
def test_kernels_of_mitsuba_are_transformed_when_they_are_first_called():
    code = (
        "from lippmann.runtime import engine; engine.start('cpu')\n"
        "import drjit as dr, drjit.ast, mitsuba as mi\n"
        "print(drjit.ast._syntax_counter, dr.syntax is drjit.ast.syntax)\n"
        "scene = {**mi.cornell_box(), 'integrator': {'type': 'prb'}}\n"
        "scene['sensor']['film'] |= {'width': 8, 'height': 8}\n"
        "picture = mi.render(mi.load_dict(scene), spp=4)\n"
        "print(drjit.ast._syntax_counter, 0.1 < float(dr.mean(picture, axis=None).array[0]) < 1)\n"
    )
    run = python(code)
    assert run.returncode == 0, run.stderr
    assert run.stdout.split() == ["0", "True", "1", "True"]


@needs_good
@needs_cpu_only
def test_type_hints_are_compiled_when_they_are_evaluated(monkeypatch):
    monkeypatch.setattr("builtins.compile", lambda *_: pytest.fail("a hint is compiled"))
    with engine._hints_compiled_at_use():
        hint = typing.Union["First", None]  # noqa: F821
    monkeypatch.undo()
    assert "compile" not in vars(typing)

    def takes(value): ...

    takes.__annotations__["value"] = hint
    assert typing.get_type_hints(takes, {"First": int}) == {"value": int | None}


def test_device_of_choice_without_a_gpu_is_the_cpu_and_the_gpu_is_an_error():
    code = (
        "from lippmann.runtime import engine; from lippmann.errors import EngineError\n"
        "assert engine.start('auto').device == 'cpu'\n"
        "try: engine.start('gpu')\n"
        "except EngineError as error: print(error)\n"
    )
    run = python(code)
    assert run.returncode == 0, run.stderr
    assert "no NVIDIA GPU" in run.stdout
    assert "device 'cpu'" in run.stdout


@pytest.mark.skipif(not any(library.version[0] in (15, 16) for library in OLD), reason="LLVM 15 or 16 is not installed")
def test_old_library_loaded_by_someone_else_before_is_never_put_to_work():
    library = next(library for library in OLD if library.version[0] in (15, 16))
    code = (
        f"import mitsuba; import os; del os.environ[{llvm.PATH_VARIABLE!r}]\n"
        "from lippmann.runtime import engine; engine.start('cpu')\n"
    )
    run = python(code, **{llvm.PATH_VARIABLE: str(library.path)})
    assert run.returncode == 1, run.stderr
    last = run.stderr.splitlines()[-1]
    assert f"Dr.Jit has loaded LLVM {library.version[0]}, which is too old" in last


@needs_good
def test_variant_chosen_by_the_caller_is_kept(monkeypatch):
    code = (
        "import mitsuba as mi; mi.set_variant('llvm_ad_rgb')\n"
        "from lippmann.runtime import engine, machine\n"
        "machine.gpu_obstacle = lambda dr: ''\n"  # as if there were a GPU
        "assert engine.start('auto').variant == 'llvm_ad_rgb'\n"
        "assert engine.start('auto').variant == 'llvm_ad_rgb'\n"
    )
    run = python(code, **{llvm.PATH_VARIABLE: str(GOOD[0].path)})
    assert run.returncode == 0, run.stderr


@needs_good
def test_diagnosis_of_a_machine_that_can_render():
    diagnosis = engine.diagnose("cpu")
    assert diagnosis.ok
    assert diagnosis.engine is not None
    assert diagnosis.engine.device == "cpu"
    by_name = {check.name: check for check in diagnosis.checks}
    assert GOOD[0].version_text in by_name["LLVM"].value
    for old in OLD:
        assert old.version_text in by_name["LLVM"].value
    assert by_name["test render"].ok


def test_extras_are_installed_or_say_how(monkeypatch):
    lines = ["numpy>=1", "h5py>=3; extra == 'exchange'", "no-such-package>=1; extra == 'usd'", "ruff; extra == 'dev'"]
    monkeypatch.setattr("importlib.metadata.requires", lambda name: lines)
    exchange, usd = engine._check_extras()
    assert (exchange.name, exchange.ok, exchange.fix) == ("extra exchange", True, "")
    assert (usd.ok, usd.needed, usd.value) == (False, False, "without no-such-package")
    assert usd.fix == "pip install 'lippmann[usd]'"


@pytest.mark.long
def test_diagnosis_of_a_machine_that_cannot(monkeypatch, tmp_path):
    monkeypatch.setenv(llvm.PATH_VARIABLE, str(tmp_path / "none.so"))
    diagnosis = engine.diagnose("cpu")
    assert not diagnosis.ok
    assert diagnosis.engine is None
    failed = {check.name: check for check in diagnosis.checks if not check.ok and check.needed}
    assert set(failed) == {"variant", "LLVM", "test render"}
    for check in failed.values():
        assert llvm.install_command() in check.fix
    assert "none.so" in failed["LLVM"].value


def test_diagnosis_survives_an_engine_that_ends_its_process(monkeypatch, tmp_path):
    # The other process starts a Python whose Mitsuba does what LLVM 15 does.
    (tmp_path / "mitsuba.py").write_text(
        "import os, sys; print('LLVM ERROR: Cannot select: fminimum', file=sys.stderr); sys.stderr.flush(); os.abort()"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    diagnosis = engine.diagnose("gpu")
    assert not diagnosis.ok
    render = diagnosis.checks[-1]
    assert not render.ok
    assert "signal 6" in render.value
    assert "Cannot select" in render.value


@pytest.mark.slow
def test_diagnosis_survives_an_engine_that_never_ends(monkeypatch, tmp_path):
    (tmp_path / "mitsuba.py").write_text("import time; time.sleep(60)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(engine, "_PROBE_SECONDS", 1)
    diagnosis = engine.diagnose("gpu")
    assert not diagnosis.ok
    assert "did not finish" in diagnosis.checks[-1].value


def test_diagnosis_tells_a_wrong_picture(monkeypatch, tmp_path):
    # A Mitsuba that starts and renders nothing but black.
    (tmp_path / "mitsuba.py").write_text(
        "import numpy\n"
        "class Anything:\n"
        "    def __getattr__(self, name): return Anything()\n"
        "    def __call__(self, *arguments, **options): return Anything()\n"
        "    def numpy(self): return numpy.zeros((16, 16, 3))\n"
        "ScalarTransform4f = LogLevel = file_resolver = Anything()\n"
        "variant = lambda: 'llvm_ad_rgb'\n"
        "set_log_level = load_dict = render = Anything()\n"
    )
    (tmp_path / "drjit.py").write_text(
        "from mitsuba import Anything\n"
        "class detail:\n"
        "    llvm_version = staticmethod(lambda: (19, 1, 0))\n"
        "has_backend = lambda which: True\n"
        "JitBackend = LogLevel = set_log_level = set_thread_count = syntax = Anything()\n"
        "thread_count = lambda: 1\n"
    )
    if not GOOD:
        pytest.skip("no LLVM library that would do is installed")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    diagnosis = engine.diagnose("cpu")
    assert not diagnosis.ok
    assert "the picture is wrong: 0 and 0" in diagnosis.checks[-1].value
