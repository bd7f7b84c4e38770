"""A helper process answers, ends by itself, and is replaced where it broke down."""

import subprocess
import sys
import time

import pytest

from lippmann.errors import MemoryLimitError
from lippmann.runtime.helper_process import HelperEndedError, HelperProcess
from lippmann.runtime.machine import limit_inputs

ECHO = """
import os
from lippmann.runtime import helper_process
helper_process._IDLE_SECONDS = {idle}
def answer(data):
    print("what libraries print is no answer")
    if data == b"die": os._exit(3)
    if data == b"hang":
        import time; time.sleep(60)
    if data == b"limit":
        helper_process.limit_memory(64 << 20)
        try: bytearray(1 << 30)
        except MemoryError: return b"refused"
    if data == b"large": return bytes(3 << 20)
    return data[::-1]
helper_process.serve(answer)
"""


@pytest.fixture
def helper():
    def start(seconds=30.0, idle=10.0):
        made.append(HelperProcess(ECHO.format(idle=idle), seconds))
        return made[-1]

    made = []
    yield start
    for one in made:
        one._end()


def test_answers(helper):
    process = helper()
    assert process.ask(b"abc", where="f") == b"cba"
    assert process.ask(b"", where="f") == b""
    assert process.ask(b"large", where="f") == bytes(3 << 20)
    assert process.ask(b"limit", where="f") == b"refused"


def test_an_end_is_told_and_the_next_request_is_answered(helper):
    process = helper()
    with pytest.raises(HelperEndedError, match=r"^exit status 3$"):
        process.ask(b"die", where="f")
    assert process.ask(b"ab", where="f") == b"ba"


def test_a_request_that_takes_too_long_is_given_up(helper):
    process = helper(seconds=5.0)
    process.ask(b"ready", where="f")
    process._most_seconds = 0.2
    with pytest.raises(HelperEndedError, match=r"it takes more than 0\.2 s"):
        process.ask(b"hang", where="f")
    assert process._process is None


def test_a_process_that_had_nothing_to_do_is_started_anew(helper):
    process = helper(idle=0.1)
    assert process.ask(b"ab", where="f") == b"ba"
    first = process._process
    deadline = time.monotonic() + 30
    while first.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    assert process.ask(b"cd", where="f") == b"dc"
    assert process._process is not first


def test_it_ends_with_the_process_that_started_it():
    program = f"""
from lippmann.runtime.helper_process import HelperProcess
process = HelperProcess({ECHO.format(idle=10.0)!r}, 30.0)
assert process.ask(b"ab", where="f") == b"ba"
"""
    ended = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, check=True)
    assert ended.stderr == b""


def test_an_answer_beyond_the_memory_is_refused(helper):
    process = helper()
    process.ask(b"ready", where="f")
    with limit_inputs(1 << 20):
        for _ in range(5):  # what is small is granted without a look
            process.ask(b"large", where="f")
        with pytest.raises(MemoryLimitError):
            process.ask(b"large", where="f")
