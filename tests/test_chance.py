"""The suite passes or fails the same way each time: no test draws numbers without a seed or heeds a busy machine."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

TESTS = Path(__file__).resolve().parent
FILES = sorted(TESTS.rglob("*.py"))

#: Makers of random numbers, whose first argument is the seed.
SEEDED = ("default_rng", "Random", "RandomState")
#: Code without any of these words has no such call: the long part is to parse it.
SUSPECT = re.compile(
    r"\b(default_rng|Random|RandomState)\(\s*\)|np\.random\.(?!default_rng|RandomState)\w|^\s*import random\b"
    r"|suppress_health_check|deadline|derandomize|database",
    re.MULTILINE,
)


def dotted(node: ast.expr) -> str:
    """The name of a function that is called; empty for what only a value of the run holds."""
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def faults(code: str) -> Iterator[str]:
    """What makes a test depend on chance, each with its line."""
    if not SUSPECT.search(code):
        return
    tree = ast.parse(code)
    modules = {
        alias.asname or alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names
    }
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        called = dotted(node.func)
        holder, _, name = called.rpartition(".")
        if name in SEEDED:
            if not node.args and not node.keywords:
                yield f"{node.lineno}: {called} without a seed"
        elif holder == "np.random" or (holder == "random" and "random" in modules):
            yield f"{node.lineno}: {called} of a state that all share"
        for keyword in node.keywords if name == "settings" else ():
            value = ast.unparse(keyword.value)
            if keyword.arg == "suppress_health_check" and HealthCheck.too_slow.name not in value:
                yield f"{node.lineno}: generation of examples is timed"
            if (keyword.arg, value) != ("deadline", "None") and keyword.arg in ("deadline", "derandomize", "database"):
                yield f"{node.lineno}: {keyword.arg} is the profile's to set"


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("rng = np.random.default_rng()", "default_rng without a seed"),
        ("import random\nrandom.shuffle(order)", "random.shuffle of a state that all share"),
        ("np.random.uniform(0, 1)", "np.random.uniform of a state that all share"),
        ("settings(deadline=200)", "deadline is the profile's to set"),
        ("settings(suppress_health_check=[HealthCheck.function_scoped_fixture])", "timed"),
        ("random = np.random.default_rng(3)\nrandom.uniform(0, 1)", ""),
        ("import random\nrandom.Random(2)", ""),
        ("settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])", ""),
    ],
)
def test_chance_is_seen(code, found):
    seen = list(faults(code))
    assert len(seen) == bool(found)
    assert found in "".join(seen)


@pytest.mark.slow
def test_no_test_depends_on_chance():
    conftest = TESTS / "conftest.py"
    seen = {path: list(faults(path.read_text(encoding="utf-8"))) for path in FILES if path != conftest}
    assert [f"{path.relative_to(TESTS)}:{fault}" for path, here in seen.items() for fault in here] == []


def test_property_tests_take_the_same_examples_each_time(request):
    if request.config.getoption("--hypothesis-profile") is not None:
        pytest.skip("another profile was asked for")
    plain = settings.default
    assert plain.derandomize
    assert plain.database is None
    assert plain.deadline is None
    assert HealthCheck.too_slow in plain.suppress_health_check
