"""The means by which readers are put under fire see what they are there to see."""

from __future__ import annotations

import json
import logging
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import guard
import pytest
from guard import judge, quiet
from hypothesis import given
from hypothesis import strategies as st
from mutation import LONGEST, Mutator, json_tree
from parcels import packed, unpack
from targets import TARGETS, seeds

from lippmann.errors import SceneError

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


def busy() -> None:
    while True:
        pass


def refused() -> None:
    raise SceneError("is damaged", where="x")


def silent_about_memory() -> None:
    try:
        raise MemoryError
    except MemoryError as error:
        raise SceneError("is damaged", where="x") from error


def two_lines() -> None:
    error = SceneError("is damaged", where="x")
    error.__class__ = type("Odd", (SceneError,), {"__str__": lambda self: "one\ntwo"})
    raise error


def swallows() -> None:
    try:
        busy()
    except Exception:  # noqa: BLE001  # as careless readers do
        return


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (lambda: 1, ""),
        (refused, ""),
        (lambda: [][0], "IndexError"),
        (lambda: warnings.warn("careful", RuntimeWarning, stacklevel=1), "RuntimeWarning: careful"),
        (busy, "takes more than"),
        (swallows, "takes more than"),
        (silent_about_memory, "asks for too much memory"),
        (two_lines, "is not one line"),
    ],
)
def test_the_rule_is_held_against_planted_faults(monkeypatch, tmp_path, read, said):
    if said.startswith("takes"):  # all others end at once, but for what else this process may be busy with
        monkeypatch.setattr(guard, "SECONDS", 0.05)
    broken = judge(lambda data, folder: read(), b"", tmp_path).broken
    assert said in broken
    assert bool(said) == bool(broken)


HOG = """
import guard
from pathlib import Path
guard.MEMORY = 100 << 20
for mebibytes in (20, 400):
    print(guard.judge(lambda data, folder: len(bytearray(b"x") * (mebibytes << 20)), b"", Path()).broken)
"""


@pytest.mark.slow
def test_memory_is_held_against_a_planted_fault():
    # In a process of its own: not every system lets go of what the tests before this one took.
    done = subprocess.run([sys.executable, "-c", HOG], cwd=Path(__file__).parent, capture_output=True, text=True)
    little, much = done.stdout.splitlines()
    assert little == ""
    assert re.fullmatch(r"takes \d+ MiB", much)


def test_what_is_printed_is_seen(tmp_path):
    with quiet() as said:
        assert said() == ""
        print("out")
        assert said() == "out\n"
        os.write(1, b"below")
        assert said() == "below"
        logging.getLogger("of.nobody").warning("logged")
        subprocess.run([sys.executable, "-c", "import os; os.write(2, b'err')"], check=True)
        assert "err" in said()
        assert said() == ""


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_inputs_follow_from_the_seed(name):
    target = TARGETS[name]

    def inputs(seed: int) -> list[bytes]:
        mutator = Mutator(seeds(name), target.words, tree=target.tree, repair=target.repair, seed=seed)
        return [mutator.next() for _ in range(20)]

    first = inputs(1)
    assert first == inputs(1)
    assert first != inputs(2)
    assert len(set(first) - set(seeds(name))) > 12
    assert max(map(len, first)) <= LONGEST


def test_trees_are_changed_as_trees():
    tree = b'{"a": [1, 2, {"b": "c"}], "d": null}'
    mutator = Mutator([tree], tree=json_tree)
    changed = [data for data in (mutator.next() for _ in range(300)) if _is_json(data) and data != tree]
    assert len(changed) > 40


def _is_json(data: bytes) -> bool:
    try:
        json.loads(data)
    except ValueError:
        return False
    return True


@given(files=st.dictionaries(st.sampled_from(["a", "b.json", "c/d/0.0"]), st.text("0123456789abcdef\n", max_size=80)))
def test_folders_come_back(tmp_path_factory, files):
    there, back = tmp_path_factory.mktemp("there"), tmp_path_factory.mktemp("back")
    for name, text in files.items():
        (there / name).parent.mkdir(parents=True, exist_ok=True)
        (there / name).write_text(text)
    unpack(packed(there), back)
    assert {str(p.relative_to(back)): p.read_text() for p in back.rglob("*") if p.is_file()} == files


@pytest.mark.parametrize("name", ["../x", "/x", "a/../../x", ".."])
def test_a_folder_never_reaches_outside(tmp_path, name):
    (tmp_path / "in").mkdir()
    unpack(f"=== {name}\nbad\n".encode(), tmp_path / "in")
    assert [path.name for path in tmp_path.rglob("*")] == ["in"]


PLANTED = """
import os, signal, sys, tempfile
from pathlib import Path
import fuzz
from lippmann.errors import SceneError
fuzz.CORPUS = Path(tempfile.mkdtemp())
fuzz._PATIENCE = 0.3

def read(data, folder):
    read.count += 1
    if read.count == 30:
        {fault}
    raise SceneError("no")

read.count = 0
fuzz.TARGETS["quilt-name"] = fuzz.TARGETS["quilt-name"].__class__(read)
found = fuzz.fuzz("quilt-name", 60, 0, 100.0)
saved = len(list(fuzz.CORPUS.rglob("found-*")))
print(found["inputs"], found["finds"], saved, *found["kinds"])
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the long run reads Linux's /proc")
@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        ("os.abort()", "ends the process with status 6"),
        pytest.param(
            "signal.signal(signal.SIGPROF, signal.SIG_IGN)\n        while True: pass",
            "hangs outside Python",
            marks=pytest.mark.long,
        ),
        ("raise KeyError('x')", "KeyError"),
        pytest.param("print('noise', file=sys.stderr)", "prints 'noise", marks=pytest.mark.long),
    ],
)
def test_the_long_run_survives_and_tells_what_a_reader_does(fault, kind):
    code = PLANTED.format(fault=fault)
    done = subprocess.run([sys.executable, "-c", code], cwd=BENCHMARKS, capture_output=True, text=True, check=True)
    inputs, finds, saved, *kinds = done.stdout.split()
    # A process that ended is followed by another one, whose reader counts anew.
    assert int(inputs) >= 60
    assert int(finds) == int(saved) > 0
    assert kind in " ".join(kinds)
