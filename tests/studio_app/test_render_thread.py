"""The thread that renders: the newest view wins, and pictures get better while nothing moves."""

from __future__ import annotations

import itertools
import threading
import time

import pytest
from stand_in import TINY, StandIn

from lippmann.errors import SceneError
from lippmann.studio_app import render_thread
from lippmann.studio_app.render_thread import RenderThread, ViewRequest, Watcher, _next_row_step, _next_share
from lippmann.studio_app.state import StudioState

STATE = StudioState(display=TINY)
DISPLAY = STATE.load_display()


class Record:
    """A watcher that keeps what it is shown."""

    def __init__(self):
        self.frames, self.errors, self.busy = [], [], []
        self.watcher = Watcher(self.frames.append, self.errors.append, self.busy.append)

    def wait_for(self, holds, seconds=60.0):
        until = time.monotonic() + seconds
        while not holds(self):
            assert time.monotonic() < until, (self.frames, self.errors)
            time.sleep(0.005)


def wanted(number, scene="teapot", load=lambda: "scene", display=DISPLAY, eye=(0.0, 0.0, 300.0)):
    return ViewRequest(number, scene, load, display, STATE.view(eye, (40, 30)))


@pytest.fixture
def start(monkeypatch):
    """``start(make)``: a thread with one watcher; ended after the test."""
    monkeypatch.setattr(render_thread, "REST", 0.02)
    threads = []

    def begin(make=StandIn):
        thread, record = RenderThread(make), Record()
        threads.append(thread)
        thread.add(record.watcher)
        return thread, record

    yield begin
    for thread in threads:
        thread.close()


def test_a_resting_view_is_refined_until_it_is_final(start):
    thread, record = start()
    thread.want(record.watcher, wanted(1))
    record.wait_for(lambda r: r.frames and r.frames[-1].is_final)
    assert [shown.number for shown in record.frames] == [1] * len(record.frames)
    assert [shown.frame.samples for shown in record.frames] == sorted(shown.frame.samples for shown in record.frames)
    count = len(record.frames)
    time.sleep(0.1)
    assert len(record.frames) == count


def test_the_newest_view_wins(start):
    allowed, begun = threading.Event(), threading.Event()

    class Slow(StandIn):
        def frame(self, view):
            begun.set()
            allowed.wait(60.0)
            return super().frame(view)

    thread, record = start(Slow)
    thread.want(record.watcher, wanted(1))
    assert begun.wait(60.0)
    for number in range(2, 200):
        thread.want(record.watcher, wanted(number))
    allowed.set()
    record.wait_for(lambda r: r.frames and r.frames[-1].number == 199)
    assert {shown.number for shown in record.frames} == {1, 199}


def test_scene_and_display_are_set_when_they_change(start):
    made = []

    def make(scene, display):
        made.append(StandIn(scene, display))
        return made[-1]

    thread, record = start(make)
    other = StudioState(display="mla-square").load_display()
    steps = [wanted(1), wanted(2), wanted(3, scene="room"), wanted(4, scene="room", display=other)]
    for step in steps:
        thread.want(record.watcher, step)
        record.wait_for(lambda r, n=step.number: r.frames and r.frames[-1].number == n)
    assert len(made) == 1
    assert made[0].calls == ["scene", "display"]
    assert record.busy == ["Opening the scene", None] * 2


def test_a_scene_that_cannot_be_loaded_is_said_and_the_last_one_stays(start):
    def broken():
        raise SceneError("is damaged", where="a.glb")

    thread, record = start()
    thread.want(record.watcher, wanted(1))
    record.wait_for(lambda r: r.frames)
    thread.want(record.watcher, wanted(2, scene="a.glb", load=broken))
    record.wait_for(lambda r: r.errors)
    assert str(record.errors[0]) == "a.glb: is damaged"
    thread.want(record.watcher, wanted(3))
    record.wait_for(lambda r: r.frames[-1].number == 3)


def test_a_fault_is_reported_and_the_thread_goes_on(start, capfd):
    class Faulty(StandIn):
        def frame(self, view):
            if view.eye[0] == 1.0:
                raise ZeroDivisionError("a fault")
            return super().frame(view)

    thread, record = start(Faulty)
    thread.want(record.watcher, wanted(1, eye=(1.0, 0.0, 300.0)))
    record.wait_for(lambda r: r.errors)
    thread.want(record.watcher, wanted(2))
    record.wait_for(lambda r: r.frames)
    assert "ZeroDivisionError: a fault" in capfd.readouterr().err


def test_nothing_is_gathered_while_a_render_runs_beside(start):
    thread, record = start()
    thread.gather(False)
    thread.want(record.watcher, wanted(1))
    record.wait_for(lambda r: r.frames)
    time.sleep(0.1)
    assert [shown.frame.samples for shown in record.frames] == [1]
    thread.gather(True)
    record.wait_for(lambda r: r.frames[-1].is_final)


def test_depth_is_told_of_the_picture_that_is_shown(start):
    thread, record = start()
    told = []
    thread.want(record.watcher, wanted(1))
    record.wait_for(lambda r: r.frames and r.frames[-1].is_final)
    thread.pick(record.watcher, 0.7, 0.5, told.append)
    record.wait_for(lambda r: told)
    assert told == [3.0]


def test_those_who_left_are_served_no_more(start):
    thread, record = start()
    thread.remove(record.watcher)
    thread.want(record.watcher, wanted(1))
    time.sleep(0.05)
    assert record.frames == []


class Turns(StandIn):
    """Notes whose step is made; all native pixels take :attr:`PARTS` steps."""

    PARTS = 5

    def __init__(self, scene, display):
        super().__init__(scene, display)
        self.made, self.may_begin = [], threading.Event()

    def frame_steps(self, view):
        assert self.may_begin.wait(60.0)
        for _ in range(self.PARTS - 1 if view.eye is None else 0):
            self.made.append("part")
            yield None
        self.made.append(view.eye)
        yield self.frame(view)


def moving(thread, view, most=200):
    """A watcher that wants the next view as soon as it sees one, as pages and panels do during a drag."""
    seen = []

    def take(shown):
        seen.append(shown)
        if len(seen) < most:
            thread.want(watcher, ViewRequest(len(seen) + 1, "teapot", lambda: "scene", DISPLAY, view))

    watcher = Watcher(take, lambda error: pytest.fail(str(error)))
    thread.add(watcher)
    thread.want(watcher, ViewRequest(1, "teapot", lambda: "scene", DISPLAY, view))
    return seen


def test_watchers_take_turns_and_a_panel_gets_its_parts_between(start):
    made = []

    def make(scene, display):
        made.append(Turns(scene, display))
        return made[-1]

    thread, record = start(make)
    thread.gather(False)
    thread.remove(record.watcher)
    pages = [moving(thread, STATE.view((float(n), 0.0, 300.0), (40, 30))) for n in range(4)]
    panel = moving(thread, STATE.native_view())
    until = time.monotonic() + 60.0
    while not made:
        assert time.monotonic() < until
        time.sleep(0.005)
    made[0].may_begin.set()
    while min(map(len, pages)) < 150:
        assert time.monotonic() < until
        time.sleep(0.005)
    turns = made[0].made[1:601]  # the first one may have begun before all others were there
    counts = [turns.count((float(n), 0.0, 300.0)) for n in range(4)]
    assert max(counts) - min(counts) <= 1
    native = turns.count("part") + turns.count(None)
    assert abs(native - counts[0]) <= 1
    # Each native frame that was begun was finished, though newer views were wanted all the time.
    assert turns.count(None) == pytest.approx(native / Turns.PARTS, abs=1)
    assert len(panel) > 20


def test_a_coarse_panel_is_made_whole_at_rest_even_beside_a_render(start):
    steps = []

    class Rows(StandIn):
        def frame(self, view):
            steps.append(view.row_step)
            return super().frame(view)

    thread, record = start(Rows)
    thread.gather(False)
    thread.want(record.watcher, ViewRequest(1, "teapot", lambda: "scene", DISPLAY, STATE.native_view()))
    record.wait_for(lambda r: len(r.frames) == 2)
    time.sleep(0.1)
    assert steps == [render_thread.MOST_ROW_STEP, 1]
    thread.gather(True)
    record.wait_for(lambda r: r.frames[-1].is_final)


def test_those_at_rest_take_turns_too(start):
    gathered = []

    class Notes(StandIn):
        def refine(self, view):
            gathered.append(view.eye[0])
            self.samples = len(gathered)
            return self._draw(view)

    thread, record = start(Notes)
    thread.gather(False)
    other = Record()
    thread.add(other.watcher)
    for number, each in enumerate((record, other)):
        thread.want(each.watcher, wanted(1, eye=(float(number), 0.0, 300.0)))
        each.wait_for(lambda r: r.frames)
    thread.gather(True)
    other.wait_for(lambda r: len(r.frames) > 10)
    assert {gathered[n] + gathered[n + 1] for n in range(10)} == {1.0}


@pytest.mark.parametrize(
    ("row_step", "seconds", "then"),
    [(30, 0.6, 32), (16, 0.01, 8), (8, 0.4, 7), (4, 0.125, 2), (1, 0.4, 1), (1, 0.6, 2), (2, 9.0, 4), (32, 9.0, 32)],
)
def test_rows_of_a_moving_panel_are_left_out_until_it_keeps_pace(row_step, seconds, then):
    assert _next_row_step(row_step, seconds) == then


@pytest.mark.parametrize(
    ("whole", "seconds", "share"),
    [
        (0.02, 0.02, 1.0),
        (0.06, render_thread.FRAME_SECONDS, 0.707),  # still above half of the sides
        (0.16, 0.04, 0.5),  # half of the sides, rather than a finer pace
        (0.4, render_thread.COARSE_FRAME_SECONDS, 0.354),
        (4.0, 0.25, 0.25),  # however slow
    ],
)
def test_slow_frames_shrink_to_the_time_that_there_is_and_grow_again(whole, seconds, share):
    now = 1.0
    for _ in range(40):
        now = _next_share(now, whole * now**2)
    assert whole * now**2 == pytest.approx(seconds, rel=0.05)
    assert now == pytest.approx(share, rel=0.03)
    for _ in range(40):
        now = _next_share(now, 0.01)
    assert now == 1.0


def test_one_slow_frame_shrinks_the_next_by_a_quarter_at_most():
    assert _next_share(1.0, 10.0) == 0.75
    assert _next_share(render_thread.LEAST_SHARE, 10.0) == render_thread.LEAST_SHARE


def test_freed_memory_is_given_back_now_and_then(start, monkeypatch):
    returned = []
    monkeypatch.setattr(render_thread, "return_freed_memory", lambda: returned.append(time.monotonic()))
    monkeypatch.setattr(render_thread, "TIDYING", 0.05)
    thread, record = start()
    for number in range(1, 200):
        thread.want(record.watcher, wanted(number))
        time.sleep(0.001)
    record.wait_for(lambda r: r.frames and r.frames[-1].number == 199)
    thread.close()
    assert 1 <= len(returned) < len(record.frames)
    assert all(later - earlier > 0.05 for earlier, later in itertools.pairwise(returned))
