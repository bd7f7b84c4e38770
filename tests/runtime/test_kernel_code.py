"""Kernels run without Numba once they have been compiled, with the same results."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from lippmann.runtime import kernel_code

needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Numba runs its kernels itself")

KERNEL = """
import sys
import numpy as np
from lippmann.runtime.numba_jit import uncounted

@uncounted
def weight(value, turned):
    return -(value ** 1.5) if turned else value ** 1.5

@uncounted
def fill(first, last, values, scale, turned, result):
    for row in range(first, last):
        for column in range(values.shape[1]):
            result[row, column] += scale * weight(values[row, column], turned)

def run(values, scale, turned):
    result = np.ones(values.shape)
    fill(1, len(values), values, scale, turned, result)
    wanted = np.ones(values.shape)
    wanted[1:] += (-1 if turned else 1) * float(scale) * values[1:].astype(float) ** 1.5
    np.testing.assert_allclose(result, wanted, rtol=1e-6)

whole = np.linspace(0, 1, 24, dtype=np.float32).reshape(4, 6)
run(whole, 2.0, True)
run(whole[:, ::2], np.float64(3), False)
print("numba" in sys.modules)
"""


@pytest.fixture
def loads_numba(tmp_path):
    """Runs the program in a process of its own; whether that loads Numba."""

    def program(**more):
        path = tmp_path / "kernel.py"
        if not path.exists():
            path.write_text(KERNEL)
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        environment = {**kept, "XDG_CACHE_HOME": str(tmp_path / "cache"), **more}
        done = subprocess.run([sys.executable, str(path)], env=environment, capture_output=True, text=True, check=True)
        return done.stdout.strip() == "True"

    return program


@pytest.mark.slow
@needs_linux
def test_a_second_process_runs_what_the_first_has_compiled(loads_numba, tmp_path):
    assert loads_numba()
    assert not loads_numba()
    assert not (tmp_path / "cache").exists()
    for file in (tmp_path / "__pycache__").glob("*.fill.*.kernel"):
        file.write_bytes(file.read_bytes()[:100])
    assert loads_numba()
    (tmp_path / "kernel.py").write_text(KERNEL.replace("1.5", "2.5"))
    assert loads_numba()


@needs_linux
def test_code_is_kept_for_the_user_where_the_source_cannot_have_it_beside(loads_numba, tmp_path):
    (tmp_path / "file").write_text("")
    nowhere = str(tmp_path / "file" / "folder")
    assert loads_numba(PYTHONPYCACHEPREFIX=nowhere)
    assert list((tmp_path / "cache" / "lippmann" / "kernels").glob("*.kernel"))
    assert not loads_numba(PYTHONPYCACHEPREFIX=nowhere)


def test_other_arguments_than_numbers_and_arrays_are_left_to_numba():
    picture = np.zeros((2, 3), np.float32)
    assert kernel_code.variant_of((1, 2.0, True, np.int32(3), picture)) is not None
    for other in ("text", None, (1, 2), [1], 1j, np.float16(1), picture.astype(">f4"), picture.astype(complex)):
        assert kernel_code.variant_of((1, other)) is None


def test_arrays_of_other_layouts_are_other_variants():
    whole = np.zeros((4, 6))
    locked = np.zeros((4, 6))
    locked.flags.writeable = False
    arrays = (whole, whole.astype(np.float32), whole.T, whole[:, ::2], whole[0], locked)
    assert len({kernel_code.variant_of((each,)) for each in arrays}) == len(arrays)


@needs_linux
def test_code_that_calls_what_is_not_there_is_not_run():
    from numba import njit, types

    def power(value, result):
        result[0] = value**1.5

    kernel = njit(_nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)(power)
    signature = (types.float64, types.float64[::1])
    kernel.compile(signature)
    made = kernel.overloads[signature]
    content = made.library._get_compiled_object()
    variant = kernel_code.variant_of((1.0, np.zeros(1)))
    parameters = ("ptr", "ptr", "double", "ptr", "ptr", "i64", "i64", "ptr", "i64", "i64")
    code = kernel_code.MachineCode(made.fndesc.llvm_func_name, parameters, content)
    result = np.zeros(1)
    kernel_code._link(code, variant)(4.0, result)
    assert result[0] == 8
    assert kernel_code._missing(content) == ["pow"]
    unknown = kernel_code.MachineCode(code.symbol, parameters, content.replace(b"\0pow\0", b"\0pox\0"))
    assert kernel_code._link(unknown, variant) is None
    assert kernel_code._link(kernel_code.MachineCode(code.symbol, parameters[:-1], content), variant) is None
