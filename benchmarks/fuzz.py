"""Every reader under fire: damaged files, names and requests; each has to end in a result or a LippmannError.

Time on two cores: about 4 hours with 100 000 inputs a target.

python benchmarks/fuzz.py                          # 100 000 inputs a target, or as many as --minutes allow
python benchmarks/fuzz.py ply stl --inputs 2000 --seed 7

Each target runs in a process of its own, so that one that crashes or hangs is told apart and the next input goes on.
What breaks the rule is saved in tests/fuzz/corpus, which the plain suite replays. Writes results/fuzz.json; runs with
other seeds, and of other targets, keep their figures there.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import mmap
import os
import re
import resource
import shutil
import signal
import struct
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from harness import save, saved

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "fuzz"))

from guard import MEMORY, SECONDS, judge, quiet
from mutation import LONGEST, Mutator
from targets import CORPUS, TARGETS, emptied, seeds

#: Cases of one kind that are saved: of more the first tell enough.
_CASES_SAVED = 2

#: CPU seconds after which an input that never comes back to Python is ended from outside.
_PATIENCE = 10.0

#: With which a run's process ends that failed by no reader's fault: those are judged, and cannot raise anything.
_OWN_FAULT = 70

#: Number of the input in hand and its length, before the input itself.
_HEAD = struct.Struct("<QI")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", choices=[*TARGETS, []], help="all by default")
    parser.add_argument("--inputs", type=int, default=100_000, help="per target")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="of the clock, for all targets together")
    options = parser.parse_args()
    names = options.targets or list(TARGETS)
    end = time.monotonic() + 60 * options.minutes
    for left, name in zip(range(len(names), 0, -1), names, strict=True):
        # Time that a target leaves over goes to those after it.
        share = max(1.0, (end - time.monotonic()) / left)
        found = fuzz(name, options.inputs, options.seed, share)
        print(f"{name}: {found}", file=sys.stderr, flush=True)
        # Read anew each time: another process may have written of other targets meanwhile.
        results: dict[str, Any] = saved("fuzz").get("targets", {})
        results[name] = [run for run in results.get(name, []) if run["seed"] != options.seed] + [found]
        limits = {"seconds": SECONDS, "bytes": MEMORY}
        save("fuzz", {"limits": limits, "targets": {key: results[key] for key in TARGETS if key in results}})


def fuzz(name: str, inputs: int, seed: int, seconds: float) -> dict[str, Any]:
    """Run one target; its figures."""
    kinds: dict[str, int] = {}
    done, spent, places, start = 0, 0.0, 0, time.monotonic()
    while done < inputs and (left := seconds - (time.monotonic() - start)) > 0:
        # After a crash other numbers: the same would lead to the same crash.
        for report in _child(name, inputs - done, seed + len(kinds) * 1_000_003 + done, left):
            if "broken" in report:
                kind = _kind(report["broken"])
                kinds[kind] = kinds.get(kind, 0) + 1
                if kinds[kind] <= _CASES_SAVED:
                    _keep(name, bytes.fromhex(report["data"]), report["broken"])
            done += report.get("inputs", 0)
            spent += report.get("cpu", 0.0)
            places = max(places, report.get("places", 0))
    return {
        "inputs": done,
        "seed": seed,
        "cpu_seconds": round(spent, 1),
        "places": places,
        "finds": sum(kinds.values()),
        "kinds": kinds,
    }


def _child(name: str, inputs: int, seed: int, seconds: float) -> Iterator[dict[str, Any]]:
    """Reports of a process that runs inputs, and one about the input that it died of."""
    shared = mmap.mmap(-1, _HEAD.size + LONGEST)
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        status = _OWN_FAULT
        try:
            with os.fdopen(writing, "w") as reports:
                _run(name, inputs, seed, seconds, shared, reports)
            status = 0
        except BaseException:
            traceback.print_exc()
            raise
        finally:
            os._exit(status)
    os.close(writing)
    os.set_blocking(reading, False)
    text, before, since = "", -1, 0.0
    while True:
        time.sleep(0.2)
        while part := _available(reading):
            text += part
        number, length = _HEAD.unpack_from(shared)
        cpu = _cpu_of(child)
        if number != before:
            before, since = number, cpu
        ended, status = os.waitpid(child, os.WNOHANG)
        hangs = not ended and cpu - since > max(_PATIENCE, 2 * TARGETS[name].seconds)
        if hangs:
            os.kill(child, signal.SIGKILL)
            ended, status = os.waitpid(child, 0)
        if ended:
            break
    while part := _available(reading):
        text += part
    os.close(reading)
    yield from map(json.loads, text.splitlines())
    if status != 0 and os.waitstatus_to_exitcode(status) == _OWN_FAULT:
        raise RuntimeError(f"the run of {name} with the seed {seed} failed; see above")
    if status != 0:
        number, length = _HEAD.unpack_from(shared)
        how = "hangs outside Python" if hangs else f"ends the process with status {status}"
        data = shared[_HEAD.size : _HEAD.size + length]
        yield {"broken": how, "data": data.hex(), "inputs": number, "cpu": cpu}


def _run(name: str, inputs: int, seed: int, seconds: float, shared: mmap.mmap, reports: Any) -> None:
    target, end = TARGETS[name], time.monotonic() + seconds
    sound = seeds(name)
    mutator = Mutator(sound, target.words, tree=target.tree, repair=target.repair, seed=seed)
    base = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    folder = Path(tempfile.mkdtemp(dir=base))
    done, start = 0, time.process_time()
    seen: set[tuple[str, ...]] = set()
    try:
        with quiet() as said:
            for data in sound:  # libraries are loaded, and say what they say of themselves
                judge(target.read, data, emptied(folder), target.seconds)
            said()
            bound = _memory_in_use() + MEMORY
            _bound_memory(bound)
            while done < inputs and time.monotonic() < end:
                data = mutator.next()
                shared[_HEAD.size : _HEAD.size + len(data)] = data
                _HEAD.pack_into(shared, 0, done + 1, len(data))
                outcome = judge(target.read, data, emptied(folder), target.seconds)
                done += 1
                broken = outcome.broken
                if printed := said():
                    broken += f"; prints {printed[:200]!r}"
                if broken:
                    print(
                        json.dumps({"broken": broken.removeprefix("; "), "data": data.hex()}), file=reports, flush=True
                    )
                elif outcome.site not in seen:
                    seen.add(outcome.site)
                    if len(data) < 8 * max(map(len, sound)):
                        mutator.keep(data)
        cpu = time.process_time() - start
        print(json.dumps({"inputs": done, "cpu": cpu, "places": len(seen)}), file=reports)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _memory_in_use() -> int:
    """Bytes that the process may write to."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmData:"))


def _bound_memory(most: int) -> None:
    """Who asks for more gets a MemoryError, and the machine lives."""
    resource.setrlimit(resource.RLIMIT_DATA, (most, resource.RLIM_INFINITY))


def _available(descriptor: int) -> str:
    try:
        return os.read(descriptor, 1 << 16).decode("ascii")
    except BlockingIOError:
        return ""


def _cpu_of(process: int) -> float:
    """CPU seconds that a process has used."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _kind(broken: str) -> str:
    """What finds of one cause have in common: the type and the line."""
    broken = re.sub(r"(?:/[\w.+-]+)+/", "", broken)  # folders differ from run to run
    head = broken.partition(":")[0]
    return f"{head} at {broken.rpartition(' at ')[2]}" if " at " in broken else broken[:80]


def _keep(name: str, data: bytes, broken: str) -> None:
    digest = hashlib.sha256(data).hexdigest()[:12]
    path = CORPUS / name / f"found-{digest}"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    print(f"  {name} {path.name}: {broken}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
