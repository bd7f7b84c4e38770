"""What child Python processes import: nothing that lies in the working directory."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.runtime import child_python

#: Modules that a spawned process imports before it has this process's path, and some that programs import first.
STAND_INS = ("multiprocessing", "random", "socket", "json", "pickle", "ctypes", "subprocess", "numpy")

SPAWN = """
import multiprocessing, os, sys
from contextlib import nullcontext

def report(queue):
    queue.put((sys.path, os.environ.get("HELLO")))

if __name__ == "__main__":
    sys.path.append(sys.argv[1])
    if sys.argv[2] == "safely":
        from lippmann.runtime.child_python import spawn_safely as how
    else:
        how = nullcontext
    with how():
        context = multiprocessing.get_context("spawn")
        queue = context.Queue()
        child = context.Process(target=report, args=(queue,))
        child.start()
        child.join(60)
        # A child that runs a stand-in instead of multiprocessing ends without an answer.
        path, hello = queue.get() if child.exitcode == 0 else ([], "")
    assert "PYTHONSAFEPATH" not in os.environ
    print(path == sys.path, os.getcwd() in path, "" in path, hello)
"""


@pytest.fixture
def hostile(tmp_path, monkeypatch) -> Path:
    """A working directory full of stand-ins, each of which leaves a mark: a file ``NAME.ran``."""
    folder = tmp_path / "hostile"
    folder.mkdir()
    for name in STAND_INS:
        (folder / f"{name}.py").write_text(f"open({str(folder / name)!r} + '.ran', 'w').close()\nraise SystemExit(3)\n")
    monkeypatch.delenv(child_python.VARIABLE, raising=False)
    monkeypatch.chdir(folder)
    return folder


def marks(folder: Path) -> set[str]:
    return {path.stem for path in folder.glob("*.ran")}


def test_the_stand_ins_run_where_nothing_forbids_it(hostile):
    subprocess.run([sys.executable, "-c", "import json"], check=False)
    assert marks(hostile) == {"json"}


def test_code_imports_nothing_from_the_working_directory(hostile, tmp_path, monkeypatch):
    own = tmp_path / "own"
    own.mkdir()
    (own / "of_the_user.py").write_text("")
    monkeypatch.setenv("PYTHONPATH", str(own))
    code = "import json, sys, of_the_user\nprint(json.dumps([sys.argv[1:], sys.path]))"
    command, environment = child_python.python_command(code, "one", "two words")
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    arguments, path = json.loads(run.stdout)
    assert arguments == ["one", "two words"]
    assert str(own) in path
    assert not {"", str(hostile)} & set(path)
    assert marks(hostile) == set()


def test_where_python_does_not_know_the_variable_the_code_removes_the_entry(hostile, monkeypatch):
    monkeypatch.setattr(child_python, "_KNOWS_VARIABLE", False)
    command, environment = child_python.python_command("import json; print(json.dumps(sys.path))")
    del environment[child_python.VARIABLE]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert not {"", str(hostile)} & set(json.loads(run.stdout))
    assert marks(hostile) == set()


@pytest.mark.slow
@pytest.mark.parametrize("flags", [[], ["-E"]], ids=["by the variable", "by the code"])
@pytest.mark.parametrize("how", ["safely", "plainly"])
def test_spawned_processes(hostile, tmp_path, flags, how):
    """Safely spawned ones run none of the stand-ins and have the path of their parent."""
    script = tmp_path / "spawn.py"
    script.write_text(SPAWN)
    source = Path(child_python.__file__).parents[2]
    run = subprocess.run(
        [sys.executable, *flags, script, source, how],
        env={**os.environ, "HELLO": "there"},
        capture_output=True,
        text=True,
        check=True,
    )
    if how == "safely":
        assert run.stdout == "True False False there\n", run.stderr
        assert marks(hostile) == set()
    else:
        assert "multiprocessing" in marks(hostile)


def test_the_setting_ends_with_the_last_user(monkeypatch):
    monkeypatch.setenv(child_python.VARIABLE, "")
    with child_python.spawn_safely():
        with child_python.spawn_safely():
            pass
        assert os.environ[child_python.VARIABLE] == "1"
    assert os.environ[child_python.VARIABLE] == ""


@pytest.mark.skipif(os.name == "nt", reason="there are no signal masks")
def test_spawned_processes_do_not_hear_interrupts():
    context = multiprocessing.get_context("spawn")
    with child_python.spawn_safely(), context.Pool(1) as pool:
        assert pool.apply(signal.pthread_sigmask, (signal.SIG_BLOCK, ())) == {signal.SIGINT}
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


#: A process that leaves without a word while a child's semaphore is not released.
LEAKS = """
import multiprocessing, os
from lippmann.runtime.child_python import end_children, spawn_safely
context = multiprocessing.get_context("spawn")
if __name__ == "__main__":
    with spawn_safely():
        semaphore = context.Semaphore()
        child = context.Process(target=print, args=("never",))
        child.start()
        end_children(for_good=True)
        assert not child.is_alive()
        try:
            context.Process(target=print).start()
        except OSError as error:
            print(error, flush=True)
        os._exit(3)
"""


@pytest.mark.slow
def test_children_that_are_ended_leave_nothing_to_say():
    done = subprocess.run([sys.executable, "-c", LEAKS], capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout.splitlines()[-1:], done.stderr) == (3, ["this process is ending"], "")
