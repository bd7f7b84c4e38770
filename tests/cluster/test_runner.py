"""Which worker renders which frames: a cluster whose workers are played here, each frame in one unit of time."""

from __future__ import annotations

from collections import defaultdict
from concurrent.futures import Future
from dataclasses import dataclass

import pytest

pytest.importorskip("distributed")

from lippmann.cluster import runner
from lippmann.errors import UsageError


@dataclass(frozen=True)
class Flight:
    """Frames of which every second passes its light on."""

    frames: range

    def name(self, index):
        return str(index)

    def count_before(self, index):
        return (index % 32 + 1) // 2

    def open(self, threads):
        raise UsageError("no such picture")


class Task(Future):
    status = "pending"


class Played:
    """Workers that come and go by ``presence``: from when to when each is there."""

    name, status, refused, silent_seconds = "played", "running", (), 0.0

    def __init__(self, presence):
        self.presence, self.parts, self.came = presence, {}, []
        self.ends = defaultdict(float)  # when each worker has rendered all that was asked of it
        self.rendered = defaultdict(list)
        self.running = {}
        self.now = 0.0
        self.client = self.roster = self

    @property
    def admitted(self):
        """The runner asks before it starts frames: the one that is rendered first comes then."""
        if self.running and len(self.came) == sum(map(len, self.rendered.values())):
            end, worker = min((self.ends[worker], worker) for worker in self.running)
            changes = [when for stay in self.presence.values() for when in stay if self.now < when < end]
            self.now = min(changes, default=end)
            if not changes:
                frame, task = self.running.pop(worker)
                self.rendered[worker].append(frame)
                task.status = "finished"
                task.set_result(frame)
            self.running = {worker: task for worker, task in self.running.items() if self.is_there(worker)}
        return {worker: 1 for worker in self.presence if self.is_there(worker)}

    def is_there(self, worker):
        first, last = self.presence[worker]
        return first <= self.now < last

    def submit(self, call, *words, key, pure, workers=()):
        task = Task()
        for worker in workers:
            frame, before = words[1], self.rendered[worker]
            self.ends[worker] = self.now + 1 + (0 if frame - 1 in before else Flight.count_before(None, frame))
            self.running[worker] = frame, task
        return task

    def news(self):
        return ()

    def remark(self, line):
        pass

    def cancel(self, tasks, force):
        pass


@pytest.mark.parametrize(
    ("presence", "frames", "longest"),
    [
        ({"a": (0, 999), "b": (0, 999)}, range(48), 32),
        ({"a": (0, 999), "b": (0, 999), "c": (0, 999)}, range(48), 23),
        ({"a": (0, 999), "b": (0, 999)}, range(3, 20), 15),
        ({"a": (0, 999), "late": (8, 999)}, range(32), 27),
        ({"a": (0, 999), "dies": (0, 5.5)}, range(64), 62),
    ],
    ids=["two", "three", "a part of a window", "one comes late", "one dies"],
)
def test_every_frame_comes_once_and_in_time(monkeypatch, presence, frames, longest):
    monkeypatch.setattr(runner, "PATIENCE", 0.01)
    cluster = Played(presence)
    windows = (Flight(range(max(first, frames.start), min(first + 32, frames.stop))) for first in range(0, 64, 32))
    jobs = (window for window in windows if window.frames)
    runner.frame_runner_on(cluster)(jobs, len(frames), cluster.came.append)
    assert sorted(cluster.came) == list(frames)
    assert all(frames == sorted(frames) for frames in cluster.rendered.values())
    assert cluster.now <= longest


def test_what_cannot_be_rendered_anywhere_is_said_at_once():
    class Refusing(Played):
        def submit(self, call, *words, key, pure, workers=()):
            task = super().submit(call, *words, key=key, pure=pure)
            if not workers:
                task.set_result(words[0])
                return task
            name, index, outline, names, parts = words
            try:
                call(name, index, outline.result(), names, parts)
            except UsageError as error:
                task.status = "error"
                task.set_exception(error)
            return task

    with pytest.raises(UsageError, match="no such picture"):
        runner.frame_runner_on(Refusing({"a": (0, 9)}))(iter([Flight(range(9))]), 9, print)
