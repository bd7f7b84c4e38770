"""Threads and forks: every test runs a program of its own, which a fault would end or hold up for ever."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
import weakref

import pytest

from lippmann.runtime.engine_lock import EngineOwner, exclusive, no_collection

needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")

#: What the programs begin with: a small display, a ball, a scene of Mitsuba's own, and a quick render.
SETUP = """
import gc, math, os, sys, threading, time
import numpy as np
import trimesh
import lippmann
from lippmann import Display, LensArray, Panel
from lippmann.runtime.engine_lock import exclusive
from lippmann.errors import EngineError

display = Display(
    name="small",
    panel=Panel(12, 9, 0.25),
    lens_array=LensArray("lenticular", 0.75),
    gap=6.8,
    viewing_distance=math.inf,
    aperture_distance=5.0,
)
ball = lippmann.load_scene(trimesh.creation.icosphere(subdivisions=1))
plain = dict(method="full", denoise="none", spp=1, integrator="direct")

def native():
    return lippmann.load_scene({"type": "scene", "ball": {"type": "sphere"}, "sky": {"type": "constant"}})

def render(scene=ball, **options):
    return lippmann.render(scene, display, **{**plain, **options}).pixels.tobytes()

def refused(call):
    try:
        call()
    except EngineError as error:
        assert error.exit_code == 1
        return str(error)
    return ""
"""

#: What a child that may not use the engine says.
REFUSAL = (
    "this process was forked from one that had loaded the rendering engine; "
    "the engine's threads do not survive a fork; "
    "start workers by the spawn method: multiprocessing.get_context('spawn')"
)

#: In the parent: the lines of a child's output and its exit code, or None where it hangs.
FORKED = """
def forked(work, end=os._exit):
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(writing, 1)
        os.close(reading), os.close(writing)
        try:
            print(work(), flush=True)
        except BaseException as error:
            print(repr(error), flush=True)
        end(3)
    os.close(writing)
    for _ in range(400):
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            with os.fdopen(reading) as said:
                return said.read().strip(), os.waitstatus_to_exitcode(status)
        time.sleep(0.05)
    os.kill(child, 9), os.waitpid(child, 0)
    return None
"""


def run(code: str, timeout: float = 240) -> list[str]:
    """The lines that a program prints; it ends well, within the seconds given."""
    program = SETUP + FORKED + textwrap.dedent(code)
    done = subprocess.run(
        # Python 3.12 and newer warn of forks beside threads, which these programs are about.
        [sys.executable, "-W", "error", "-W", "ignore:This process:DeprecationWarning", "-c", program],
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    assert done.returncode == 0, f"exit code {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout.splitlines()


@pytest.mark.long
def test_calls_of_eight_threads_give_the_bytes_of_single_ones(tmp_path):
    code = f"""
    import random, tempfile
    from pathlib import Path
    from lippmann.rendering import forecast
    forecast.PROBE_SECONDS = 0.01

    mitsubas = native()
    picture = lippmann.render(ball, display, **plain)

    def to_file():
        with tempfile.TemporaryDirectory(dir={str(tmp_path)!r}) as folder:
            path = Path(folder) / "x.png"
            lippmann.render_to_file(ball, path, display, **plain)
            return lippmann.read_picture(path).pixels.tobytes()

    def planned():
        foreseen = lippmann.plan(ball, display, **plain)
        return repr((foreseen.depth_range, foreseen.rays["primary"])).encode()

    quilt = dict(views=(2, 2), size=(256, 256), **plain)
    kinds = {{
        "mitsuba": (50, lambda: render(mitsubas)),
        "mitsuba anew": (20, lambda: render(native(), threads=1)),
        "full": (16, render),
        "replay": (16, lambda: picture.replay((5.0, 0.0, 300.0)).tobytes()),
        "classic": (4, lambda: render("primitives", integrator="classic")),
        "lens-view": (2, lambda: render(method="lens-view")),
        "pooled": (4, lambda: render(method="pooled", denoise="oidn-fast", spp=2)),
        "quilt": (2, lambda: lippmann.render_quilt(ball, display, **quilt).pixels.tobytes()),
        "preview": (5, lambda: lippmann.preview(ball, size=(12, 9), spp=1, integrator="direct").pixels.tobytes()),
        "plan": (2, planned),
        "file": (2, to_file),
    }}
    alone = {{name: call() for name, (_, call) in kinds.items()}}
    names = [name for name, (count, _) in kinds.items() for _ in range(count)]
    random.Random(1).shuffle(names)
    wrong = []

    def work(own):
        for name in own:
            try:
                if kinds[name][1]() != alone[name]:
                    wrong.append(name + " differs")
            except BaseException as error:
                wrong.append(name + ": " + repr(error))

    threads = [threading.Thread(target=work, args=(names[k::8],)) for k in range(8)]
    for thread in threads: thread.start()
    for thread in threads: thread.join()
    # Numba's own threads, which not every machine can start from several threads at once, are not used.
    from numba import threading_layer
    try:
        wrong.append(threading_layer())
    except ValueError:
        pass
    print(len(names), wrong)
    """
    assert run(code) == ["123 []"]


@pytest.mark.long
def test_scenes_may_be_freed_while_another_thread_renders():
    code = """
    from lippmann.device.pbr import build
    alone = render()
    def loaded():
        scene = native()
        scene.bounds
        return scene

    with exclusive():
        heap = [build(ball) if number % 2 else loaded() for number in range(24)]

    def free():
        while heap:
            cycle = [heap.pop()]
            if len(heap) % 4 < 2:
                cycle.append(cycle)
            del cycle
            gc.collect()
            time.sleep(0.02)

    thread = threading.Thread(target=free)
    sys.setswitchinterval(1e-5)
    thread.start()
    pictures = [render()]
    while thread.is_alive():
        pictures.append(render())
    print(all(picture == alone for picture in pictures), heap)
    """
    assert run(code) == ["True []"]


@pytest.mark.long
def test_the_tiles_of_a_file_may_be_traced_by_another_thread():
    # A lock held while the runner works would never be free for it.
    code = """
    import tempfile
    from pathlib import Path
    from lippmann.tiles.tiled_render import render_here

    def elsewhere(*arguments):
        thread = threading.Thread(target=render_here, args=arguments)
        thread.start()
        thread.join(60)
        assert not thread.is_alive()

    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / name for name in ("a.png", "b.png")]
        for path, runner in zip(paths, (None, elsewhere)):
            lippmann.render_to_file(ball, path, display, runner=runner, **plain)
        print(paths[0].read_bytes() == paths[1].read_bytes())
    """
    assert run(code) == ["True"]


@pytest.mark.long
def test_asking_a_scene_while_another_thread_renders():
    # Before Python 3.12, functools.cached_property has one lock for the same property of all objects: a thread that
    # holds it and waits for the engine stops the one that has the engine.
    code = """
    render()
    with exclusive():
        thread = threading.Thread(target=lambda: native().bounds)
        thread.start()
        time.sleep(0.3)
        assert thread.is_alive()
        print(lippmann.load_scene(trimesh.creation.icosphere(subdivisions=1)).bounds.shape)
    thread.join(60)
    print(thread.is_alive())
    """
    assert run(code, 100) == ["(2, 3)", "False"]


@pytest.mark.long
def test_the_engine_stays_with_the_thread_that_renders():
    code = """
    began, may_go, order = threading.Event(), threading.Event(), []

    def hold(report):
        began.set()
        may_go.wait(60)

    first = threading.Thread(target=lambda: (render(progress=hold), order.append("first")))
    first.start()
    began.wait(60)
    from lippmann.runtime import engine
    calls = [render, lambda: lippmann.preview(ball, size=(4, 4), spp=1), lambda: engine.start("cpu", 1)]
    others = [threading.Thread(target=lambda call=call: (call(), order.append("other"))) for call in calls]
    for thread in others: thread.start()
    time.sleep(0.5)
    print(order, [thread.is_alive() for thread in others])
    may_go.set()
    for thread in (first, *others): thread.join(100)
    print(order[0], len(order))
    """
    assert run(code) == ["[] [True, True, True]", "first 4"]


@pytest.mark.long
def test_a_wait_ends_by_ctrl_c(tmp_path):
    sign = tmp_path / "waiting"
    code = f"""
    held, may_go = threading.Event(), threading.Event()

    def hold():
        with exclusive():
            held.set()
            may_go.wait(60)

    threading.Thread(target=hold, daemon=True).start()
    held.wait()
    open({str(sign)!r}, "w").close()
    try:
        render()
    except KeyboardInterrupt:
        print("stopped")
    may_go.set()
    print(len(render()))
    """
    program = SETUP + textwrap.dedent(code)
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        while not sign.exists():
            assert process.poll() is None
            time.sleep(0.05)
        time.sleep(0.5)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        said, errors = process.communicate(timeout=100)
    finally:
        process.kill()
    assert (said, errors, process.returncode) == ("stopped\n1296\n", "", 0)


@pytest.mark.long
@needs_fork
def test_a_child_of_a_fork_before_the_first_render_renders():
    code = """
    said = forked(lambda: hash(render()))
    print(said == (str(hash(render())), 3))
    """
    assert run(code) == ["True"]


@pytest.mark.long
@needs_fork
@pytest.mark.parametrize("end", ["os._exit", "sys.exit"])
def test_a_child_of_a_fork_after_a_render_is_refused(end):
    # It ends by sys.exit, too, where destructors of Dr.Jit would wait for its threads.
    code = f"""
    mitsubas = native()
    render(mitsubas)
    calls = {{
        "render": render,
        "a scene of Mitsuba's": lambda: native().bounds,
        "a loaded scene": lambda: render(mitsubas),
        "plan": lambda: lippmann.plan(ball, display, **plain),
        "preview": lambda: lippmann.preview(ball, size=(4, 4), spp=1),
        "quilt": lambda: lippmann.render_quilt(ball, display, views=(2, 2), size=(256, 256), **plain),
        "file": lambda: lippmann.render_to_file(ball, "never.png", display, **plain),
    }}
    answer, code = forked(lambda: [refused(call) for call in calls.values()], {end})
    assert code == 3, code
    print(*dict.fromkeys(eval(answer)), sep="\\n")
    print(forked(lambda: forked(lambda: refused(render))[0])[0])
    print(len(render()))
    """
    assert run(code) == [REFUSAL, REFUSAL, "1296"]


@pytest.mark.long
@needs_fork
def test_an_uncaught_refusal_ends_the_child():
    code = """
    render()
    sys.stderr = open(os.devnull, "w")
    child = os.fork()
    if child == 0:
        render()
    for _ in range(400):
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        time.sleep(0.05)
    else:
        os.kill(child, 9)
    print(bool(ended) and os.waitstatus_to_exitcode(status))
    """
    assert run(code) == ["1"]


@pytest.mark.slow
@needs_fork
@pytest.mark.parametrize(
    ("end", "code_of_child"),
    [
        pytest.param("os._exit", 3, marks=pytest.mark.long),
        ("leave", 3),
        pytest.param("fail", 1, marks=pytest.mark.long),
    ],
)
def test_a_child_of_a_fork_during_a_render_is_refused(end, code_of_child):
    # It ends with its own exit code, where Dr.Jit's clean-up would wait for the kernel that ran during the fork.
    code = f"""
    def leave(code):
        sys.exit(code)

    def fail(code):
        raise RuntimeError(code)

    from lippmann.runtime.quiet_stderr import silence_libraries
    alone, done = render(), threading.Event()

    def work():
        while not done.is_set():
            assert render() == alone

    thread = threading.Thread(target=work)
    thread.start()
    said = set()
    for _ in range(5):
        time.sleep(0.15)
        said.add(forked(lambda: refused(render), {end}))
    done.set()
    thread.join()
    print(*said)
    print(render() == alone)
    """
    assert run(code) == [str((REFUSAL, code_of_child)), "True"]


@pytest.mark.long
@needs_fork
def test_a_fork_beside_a_thread_that_waits_leaves_no_lock_behind():
    # Nothing is loaded yet, so that the child may render: it waits for no thread of its parent.
    code = """
    held, may_go = threading.Event(), threading.Event()

    def hold():
        with exclusive():
            held.set()
            may_go.wait(100)

    thread = threading.Thread(target=hold)
    thread.start()
    held.wait()
    print(forked(lambda: len(render())))
    may_go.set()
    """
    assert run(code) == ["('1296', 3)"]


@pytest.mark.slow
@needs_fork
def test_the_denoiser_is_refused_in_a_child():
    code = """
    from lippmann.rendering.denoise.oidn import denoise
    noisy = np.ones((16, 16, 3), np.float32)
    denoise(noisy)
    print(forked(lambda: refused(lambda: denoise(noisy)))[0])
    """
    assert run(code) == [REFUSAL]


@pytest.mark.long
@needs_fork
def test_workers_that_are_forked_are_refused_and_those_that_are_spawned_render(tmp_path):
    (tmp_path / "work.py").write_text(
        SETUP
        + textwrap.dedent("""
        from concurrent.futures import ProcessPoolExecutor
        import multiprocessing

        def work(number):
            return render()

        if __name__ == "__main__":
            early = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("fork"))
            before = early.submit(work, 0).result(60)
            alone = work(0)
            for method in ("fork", "spawn"):
                with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context(method)) as pool:
                    waiting = [pool.submit(work, number) for number in range(2)]
                    for future in waiting:
                        error = future.exception(100)
                        print(method, error if error else future.result() == alone == before)
            early.shutdown()
        """)
    )
    done = subprocess.run(
        [sys.executable, str(tmp_path / "work.py")], capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [f"fork {REFUSAL}"] * 2 + ["spawn True"] * 2


def test_a_thread_that_waits_goes_before_one_that_takes_the_lock_again():
    """Live rendering takes it again at once, for as long as light is gathered."""
    turns, ends = [], threading.Event()

    def take_again_and_again():
        while not ends.is_set():
            with exclusive():
                turns.append(time.perf_counter())
                time.sleep(0.002)

    thread = threading.Thread(target=take_again_and_again, daemon=True)
    thread.start()
    try:
        waited = []
        for _ in range(20):
            before = len(turns)
            with exclusive(), exclusive():
                waited.append(len(turns) - before)
        # The turn that was running, and at most one that began before this thread asked.
        assert max(waited) <= 2
    finally:
        ends.set()
        thread.join()


class Part:
    """Stands for a scene of the engine."""


class Owner(EngineOwner):
    def __init__(self):
        self.part = Part()


def test_what_another_thread_drops_is_freed_when_the_engine_is_free():
    owners = [Owner(), Owner()]
    first, second = (weakref.ref(owner.part) for owner in owners)
    with exclusive():
        with exclusive():
            thread = threading.Thread(target=owners.pop)
            thread.start()
            thread.join()
        assert second() is not None
    assert second() is None
    with exclusive():  # a film's frame makes room for the next
        owners.pop()
        assert first() is None


class Ring:
    """Garbage that only the cyclic collector finds."""

    def __init__(self):
        self.own = self


def drop_a_ring():
    """A reference to what is lost already."""
    return weakref.ref(Ring())


def make_garbage():
    for _ in range(20 * gc.get_threshold()[0]):
        Ring()


def test_garbage_stays_within_the_block():
    gc.collect()
    with no_collection():
        lost = drop_a_ring()
        make_garbage()
        assert lost() is not None
    make_garbage()
    assert lost() is None


@pytest.mark.parametrize("was_enabled", [True, False])
def test_the_collector_is_left_as_it_was(was_enabled):
    (gc.enable if was_enabled else gc.disable)()
    try:
        with pytest.raises(ValueError, match="within"), no_collection():
            raise ValueError("within")
        assert gc.isenabled() == was_enabled
    finally:
        gc.enable()


def test_the_engine_is_used_without_it():
    with exclusive():
        assert not gc.isenabled()
        with exclusive():
            pass
        assert not gc.isenabled()
    assert gc.isenabled()
