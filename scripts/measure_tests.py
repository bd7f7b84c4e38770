"""Measures the processor time of every test of the plain suite, and writes down which ones `make check` leaves out.

The list is ``tests/slow.txt``: tests that take longest, so many that all others together keep to :data:`BUDGET`. Times
are processor seconds of the test with its fixtures and child processes, so that a busy machine gives the same list.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "tests" / "slow.txt"

#: Processor seconds of the tests that stay: of three minutes on two cores what lint, types and collection leave.
BUDGET = 210.0

_HEAD = """\
# Tests that `make check` leaves out, by processor seconds; a test that is not listed here is run.
# Written by `make measure-tests`.
"""


class Stopwatch:
    """A plugin of pytest that adds up the processor time of each test function."""

    def __init__(self) -> None:
        self.seconds: Counter[str] = Counter()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        before = sum(os.times()[:4])
        try:
            return (yield)
        finally:
            self.seconds[function_of(item.nodeid)] += sum(os.times()[:4]) - before


def function_of(nodeid: str) -> str:
    """A test without its parameters: ``tests/a/test_b.py::test_c``."""
    return nodeid.partition("[")[0]


def slow_list(seconds: dict[str, float]) -> str:
    """The text of the list: the slowest tests, until all others keep to the budget."""
    rest, lines = sum(seconds.values()), []
    for name, spent in sorted(seconds.items(), key=lambda pair: (-pair[1], pair[0])):
        if rest <= BUDGET:
            break
        rest -= spent
        lines.append(f"{spent:.1f} {name}\n")
    return f"{_HEAD}# All others together: {rest:.0f} s.\n{''.join(lines)}"


def main() -> int:
    """Run the suite and write the list."""
    stopwatch = Stopwatch()
    code = pytest.main(["-m", "not long", "-p", "no:xdist", *sys.argv[1:]], plugins=[stopwatch])
    if code == pytest.ExitCode.OK:
        LIST.write_text(slow_list(stopwatch.seconds), encoding="utf-8")
    return int(code)


if __name__ == "__main__":
    raise SystemExit(main())
