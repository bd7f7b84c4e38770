#!/usr/bin/env bash
# Dr.Jit: a frozen dataclass that a loop or a branch only reads ends it with an error; a NamedTuple does not.
#
# Versions: drjit 1.5.0, Python 3, an LLVM library that Dr.Jit finds (or DRJIT_LIBLLVM_PATH).
# Believed: dataclasses and tuples are both loop state. What cannot be written is no trouble where nothing writes it: a
#   NamedTuple, which is immutable too, is taken and made anew.
# What happens: every local of a function under @dr.syntax that a `while` or `if` on Dr.Jit's arrays reads becomes state,
#   and fields of a dataclass are assigned one by one when state goes in and out. Of a frozen one that raises "cannot
#   assign to field", symbolically and evaluated.
# Who is hurt: whoever hands a Mitsuba integrator its settings or tables as a frozen dataclass. The error comes in the
#   first render, from a line that assigns nothing.
# Seen: "NamedTuple: while [4, 10, 18], if [2, 3, 4]; frozen dataclass: while RuntimeError, if RuntimeError"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check drjit==1.5.0
# Dr.Jit reads the source of what @dr.syntax decorates: it must lie in a file.
cat > "$folder/state.py" <<'PYTHON'
import sys
from dataclasses import dataclass
from typing import NamedTuple

import drjit as dr
from drjit.llvm import Float, UInt32


class Tuple(NamedTuple):
    x: Float


@dataclass(frozen=True)
class Frozen:
    x: Float


@dr.syntax
def summed(table, count):
    i, total = UInt32(0), Float(0)
    while i < count:
        total += table.x
        i += 1
    return total


@dr.syntax
def chosen(table, count):
    value = Float(0)
    if count > 3:
        value = table.x + 1
    return value


def tried(function, kind):
    try:
        return [int(value) for value in function(kind(Float(1, 2, 3)), UInt32(4, 5, 6))]
    except Exception as error:
        return type(error).__name__


found = {kind: (tried(summed, kind), tried(chosen, kind)) for kind in (Tuple, Frozen)}
(loop, branch), (frozen_loop, frozen_branch) = found.values()
print(f"NamedTuple: while {loop}, if {branch}; frozen dataclass: while {frozen_loop}, if {frozen_branch}")
sys.exit(0 if found[Frozen] == ("RuntimeError", "RuntimeError") and loop == [4, 10, 18] else 1)
PYTHON
"$folder/venv/bin/python" "$folder/state.py"
