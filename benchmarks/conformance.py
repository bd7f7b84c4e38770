"""Every scene file below folders, rendered small: rendered, refused by which reason, over time, over memory, died.

Time on two cores: about a second a file.

python benchmarks/conformance.py FOLDER --set assimp                 # a set of conformance_sets.py, or any name
python benchmarks/conformance.py FOLDER --set assimp --limit 50 --seconds 30 --memory 2
python benchmarks/conformance.py FOLDER --set magnum --validator DIR --details all.jsonl --pictures seen/

A worker process renders one file after the other; one that dies, or is ended for its time or memory, is replaced.
Seconds are those of the processor, for the clock measures what else runs. A refusal is one line; a traceback, a warning
or a signal is a fault. Khronos' own validator (``npm install gltf-validator`` in DIR) says which glTF files are valid.
Without it, and for other formats, every file counts as valid but those that their set names otherwise.

Writes results/conformance.json; runs of other sets keep their figures there. ``--details`` gets a line of JSON a file,
``--pictures`` a PNG of each as its camera sees it. The exit status is 1 if anything was a fault.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path, PureWindowsPath
from typing import Any

from conformance_sets import INCOMPLETE, SETS, Validity, scene_files, validities
from harness import save, saved

WORKER = Path(__file__).with_name("conformance_worker.py")

#: A display that shows so little of a scene that something must be wrong: share of its pixels.
SHOWN = 0.01
#: A mesh whose width or height is a smaller share of its longest side is flat, and seen from its edge.
FLAT = 0.05
#: Files that one worker renders; its compiled kernels and textures are gone with it.
FILES_A_WORKER = 150
#: Seconds between looks at what the worker takes.
_TICK = 0.05
_PAGE = os.sysconf("SC_PAGE_SIZE")
_CLOCK = os.sysconf("SC_CLK_TCK")

FAULTS = ("fault", "died")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--set", default="", help=f"name of the set; known are {', '.join(SETS)}")
    parser.add_argument("--limit", type=int, help="files at most, evenly spread over the set")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the processor, per file")
    parser.add_argument("--memory", type=float, default=4.0, help="GB, per file")
    parser.add_argument("--jobs", type=int, default=1, help="files at a time")
    parser.add_argument("--validator", type=Path, help="folder with node_modules/gltf-validator")
    parser.add_argument("--details", type=Path, help="a line of JSON a file")
    parser.add_argument("--pictures", type=Path, help="folder of a PNG a file")
    options = parser.parse_args()
    results: dict[str, Any] = saved("conformance").get("sets", {})
    faults = 0
    for folder in options.folders:
        name = options.set or folder.resolve().name
        files = scene_files(folder)
        if options.limit and len(files) > options.limit:
            files = [files[len(files) * index // options.limit] for index in range(options.limit)]
        if not files:
            parser.error(f"no scene files below {folder}")
        valid = validities(folder, files, name, options.validator)
        reports = list(_reports(folder, name, files, options))
        valid |= _incomplete(folder, reports)
        results[name] = summarise(reports, valid)
        faults += sum(results[name]["outcomes"].get(kind, 0) for kind in FAULTS)
        if options.details is not None:
            with options.details.open("a") as lines:
                for report in reports:
                    judged = valid[report["file"]]
                    print(json.dumps({"set": name, **report, "valid": judged.valid, "why": judged.why}), file=lines)
    save(
        "conformance",
        {
            "limits": {"seconds": options.seconds, "bytes": int(options.memory * 1e9)},
            "sets": {name: results[name] for name in sorted(results)},
        },
    )
    sys.exit(1 if faults else 0)


def _incomplete(folder: Path, reports: list[dict[str, Any]]) -> dict[str, Validity]:
    """The files that were refused for want of a file that lies nowhere in the set."""
    present = {path.name.casefold() for path in folder.rglob("*")}
    found = {}
    for report in reports:
        named = re.search(r"'([^']+)' not found", report.get("line", ""))
        if named is not None and PureWindowsPath(named[1]).name.casefold() not in present:
            found[report["file"]] = Validity(False, INCOMPLETE)
    return found


def summarise(reports: list[dict[str, Any]], valid: dict[str, Validity]) -> dict[str, Any]:
    """Figures of a set: outcomes, refusals by reason with one example each, and how many valid files were rendered."""
    reasons: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for report in reports:
        if report["outcome"] == "refused":
            reasons[_reason(report)].append(report)
    sound = [report for report in reports if valid[report["file"]].valid]
    missed = [report for report in sound if report["outcome"] != "rendered"]
    rendered = [report for report in reports if report["outcome"] == "rendered"]
    return {
        "files": len(reports),
        "outcomes": dict(Counter(report["outcome"] for report in reports).most_common()),
        "valid": len(sound),
        "valid_rendered": len(sound) - len(missed),
        "not_valid": dict(Counter(each.why for each in valid.values() if not each.valid).most_common()),
        "valid_not_rendered": [
            {"file": report["file"], "outcome": report["outcome"], "line": report.get("line", "")} for report in missed
        ],
        "refusals": {
            reason: {"files": len(each), "example": each[0]["line"]}
            for reason, each in sorted(reasons.items(), key=lambda item: (-len(item[1]), item[0]))
        },
        "shows_nothing": {
            report["file"]: "seen edge-on" if min(report["sides"][:2]) < FLAT else "small, or looked through"
            for report in rendered
            if report["shown"] < SHOWN
        },
        "faults": [
            {"file": report["file"], "line": report["line"]} for report in reports if report["outcome"] in FAULTS
        ],
        "cpu_seconds": round(sum(report["cpu"] for report in reports), 1),
    }


def _reason(report: dict[str, Any]) -> str:
    """What refusals of one cause have in common: what is said without the names and numbers of the file."""
    text = report["rule"] or report["what"]
    if re.match(r"it is (required|not understood)", text) or not report["rule"]:
        text = f"{report['what']}; {report['rule']}" if report["rule"] else report["what"]
    text = re.sub(r"'[^']*'", "'...'", text)
    text = re.sub(r"\[\d+\]", "[n]", text)
    return re.sub(r"(?<![\w.])-?\d[\d.e+]*(?![\w.])", "n", text)


def _reports(folder: Path, name: str, files: list[Path], options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """What became of each file, in their order."""
    if options.pictures is not None:
        options.pictures.mkdir(parents=True, exist_ok=True)
    waiting: queue.SimpleQueue[int] = queue.SimpleQueue()
    for index in range(len(files)):
        waiting.put(index)
    outside = name in SETS and SETS[name].allow_outside
    made: dict[int, dict[str, Any]] = {}
    failure: list[BaseException] = []

    def work() -> None:
        worker: Worker | None = None
        try:
            while not failure:
                try:
                    index = waiting.get_nowait()
                except queue.Empty:
                    return
                if worker is None:
                    worker = Worker(options.memory, options.seconds, allow_outside=outside)
                picture = None if options.pictures is None else options.pictures.resolve() / f"{index:05}.png"
                shown = files[index].relative_to(folder).as_posix()
                report = worker.render(files[index], picture)
                if "line" in report:
                    report["line"] = report["line"].replace(f"{folder.resolve()}/", "")
                made[index] = {"file": shown, "index": index, **report}
                print(f"{index + 1}/{len(files)} {shown}: {_told(made[index])}", file=sys.stderr, flush=True)
                if worker.spent:
                    worker.close()
                    worker = None
        except BaseException as error:  # noqa: BLE001  # raised again where the threads are joined
            failure.append(error)
        finally:
            if worker is not None:
                worker.close()

    threads = [threading.Thread(target=work) for _ in range(options.jobs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failure:
        raise failure[0]
    yield from (made[index] for index in range(len(files)))


def _told(report: dict[str, Any]) -> str:
    detail = f"{report['shown']:.0%} shown" if report["outcome"] == "rendered" else report.get("line", "")
    return f"{report['outcome']}, {report['cpu']:.1f} s; {detail}"


class Worker:
    """A process that renders files one after the other.

    Parameters
    ----------
    memory:
        GB that it may take.
    seconds:
        Of the processor, that a file may take.
    allow_outside:
        Let files name files of other folders.
    """

    def __init__(self, memory: float, seconds: float, *, allow_outside: bool) -> None:
        self._memory, self._seconds, self._allow_outside = memory * 1e9, seconds, allow_outside
        self._printed = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the worker
        reading, self._commands = os.pipe()
        self._reports, writing = os.pipe()
        command = [sys.executable, str(WORKER), str(reading), str(writing), str(int(memory * 1e9))]
        self._process = subprocess.Popen(
            command, stdout=self._printed, stderr=self._printed, pass_fds=(reading, writing)
        )
        os.close(reading)
        os.close(writing)
        os.set_blocking(self._reports, False)
        self._files = 0
        self.spent = False

    def render(self, file: Path, picture: Path | None) -> dict[str, Any]:
        """What became of a file: outcome, seconds of the processor, and what else there is to say of it."""
        self._files += 1
        began = self._cpu()
        said = self._printed.seek(0, os.SEEK_END)
        request = {
            "file": str(file.resolve()),
            "picture": None if picture is None else str(picture),
            "allow_outside": self._allow_outside,
        }
        os.write(self._commands, (json.dumps(request) + "\n").encode())
        text, stop = b"", ""
        while not text.endswith(b"\n"):
            time.sleep(_TICK)
            with suppress(BlockingIOError):
                text += os.read(self._reports, 1 << 20)
            status = self._process.poll()
            if status is not None and not text.endswith(b"\n"):
                stop = f"ends with status {status}" if status >= 0 else f"is ended by {signal.Signals(-status).name}"
                break
            if self._cpu() - began > self._seconds:
                stop = "over time"
            elif self._resident() > self._memory:
                stop = "over memory"
            if stop:
                break
        cpu = round(self._cpu() - began, 2)
        if stop:
            self.spent = True
            self._process.kill()
            if stop in ("over time", "over memory"):
                return {"outcome": stop, "cpu": cpu}
            return {"outcome": "died", "line": f"{stop} {self._said(said)}".strip(), "cpu": cpu}
        report = {**json.loads(text), "cpu": cpu}
        if report["outcome"] != "fault" and "Traceback" in (printed := self._said(said)):
            report |= {"outcome": "fault", "line": printed}
        # A fresh process for the files after one that took much: what it keeps of it would count as theirs.
        self.spent = self._files >= FILES_A_WORKER or self._resident() > self._memory / 2
        return report

    def close(self) -> None:
        """End the process, if it still runs."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        os.close(self._commands)
        os.close(self._reports)
        self._printed.close()

    def _said(self, since: int) -> str:
        self._printed.seek(since)
        return self._printed.read().decode("utf-8", "replace")[-600:]

    def _cpu(self) -> float:
        try:
            fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return 0.0
        return (int(fields[11]) + int(fields[12])) / _CLOCK

    def _resident(self) -> int:
        try:
            return int(Path(f"/proc/{self._process.pid}/statm").read_text().split()[1]) * _PAGE
        except (OSError, IndexError):
            return 0


if __name__ == "__main__":
    main()
