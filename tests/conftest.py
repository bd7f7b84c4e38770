"""What many tests share: the engine, started once, and the folder of real scenes."""

from __future__ import annotations

import base64
import faulthandler
import gc
import json
import math
import os
import re
import signal
import sys
import tempfile
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TextIO

import pytest
from hypothesis import HealthCheck, settings

ROOT = Path(__file__).resolve().parent.parent
SHARED_SCENES = ROOT.parent / "shared" / "scenes"

# The suite passes or fails the same way each time, however busy the machine is: examples follow from the test's code,
# and no check is by the clock. Random ones are searched by `make search`, which keeps what it finds in .hypothesis/.
BY_CLOCK = [HealthCheck.too_slow]
# Each round of a search has its own instance of a test's class.
OF_ROUNDS = [HealthCheck.differing_executors]
PATIENT = settings(settings.get_profile("default"), deadline=None, print_blob=True, suppress_health_check=BY_CLOCK)
settings.register_profile("ci", PATIENT, derandomize=True, database=None, max_examples=50)
settings.register_profile("search", PATIENT, suppress_health_check=[*BY_CLOCK, *OF_ROUNDS])
settings.load_profile("ci")
with suppress(ImportError, AttributeError):
    # Hypothesis mixes in numbers and words of all modules that are loaded: each worker would read them all, and take
    # other examples than the next.
    from hypothesis.internal.conjecture import providers

    providers._get_local_constants = lambda: providers._local_constants

#: The folder in which a worker that crashes says where, one file a worker; and, in a worker, its file.
CRASHES = pytest.StashKey[tempfile.TemporaryDirectory]()
CRASH = pytest.StashKey[TextIO]()
OF_PYTEST = re.compile(r"site-packages.(pluggy|_pytest|xdist|execnet)\b")


def pytest_addoption(parser):
    # Tests state how many examples they take; a search takes more of them by further rounds.
    parser.addoption("--rounds", type=int, default=1, help="run each property test so many times")


@pytest.hookimpl(wrapper=True)
def pytest_pycollect_makeitem():
    """``long_cases("a", "b")`` makes these cases of a test ``long``; ``long_cases(but=["a"])`` all the others."""
    items = yield
    for item in items if isinstance(items, list) else []:
        for mark in item.iter_markers("long_cases"):
            named = mark.args or mark.kwargs["but"]
            absent = set(named) - {one.callspec.id for one in items}
            if absent:
                raise pytest.Collector.CollectError(f"{item.originalname} has no case {sorted(absent)}")
            if (item.callspec.id in named) == bool(mark.args):
                item.add_marker("long")
    return items


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect ten thousand tests without searching them for garbage again and again, now and while they run."""
    gc.disable()
    result = yield
    gc.enable()
    gc.freeze()
    return result


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item, nextitem):
    """Free the scenes of a file's tests after its last one.

    Kernels take in the surfaces and emitters of all scenes that are alive: of the tests before, too, and which these
    were would decide what is compiled.
    """
    result = yield
    if "mitsuba" in sys.modules and (nextitem is None or nextitem.path != item.path):
        gc.collect()
        gc.freeze()  # what lives on is not looked at again
    return result


def pytest_generate_tests(metafunc):
    rounds = metafunc.config.getoption("--rounds")
    if rounds > 1 and getattr(metafunc.function, "is_hypothesis_test", False):
        metafunc.fixturenames.append("search_round")
        metafunc.parametrize("search_round", range(1, rounds + 1))


@pytest.hookimpl(trylast=True)  # after pytest's own choice of where to write what a crash says
def pytest_configure(config):
    _keep_to_own_cores()
    worker = getattr(config, "workerinput", None)
    if worker is not None:
        config.stash[CRASH] = open(Path(worker["crashes"], worker["workerid"]), "w", encoding="utf-8")  # noqa: SIM115
        config.add_cleanup(config.stash[CRASH].close)
        faulthandler.enable(config.stash[CRASH])
    # A shell lets what it starts in the background ignore Ctrl-C, and so would all programs that tests start.
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node):
    if CRASHES not in node.config.stash:
        node.config.stash[CRASHES] = tempfile.TemporaryDirectory()
        node.config.add_cleanup(node.config.stash[CRASHES].cleanup)
    node.workerinput["crashes"] = node.config.stash[CRASHES].name


def pytest_terminal_summary(terminalreporter, config):
    """Where native code brought a worker down, at the end, beside the name of the test."""
    folder = config.stash.get(CRASHES, None)
    for path in sorted(Path(folder.name).iterdir()) if folder else []:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
        if lines:
            terminalreporter.section(f"crash of {path.name}")
            terminalreporter.write("\n".join(line for line in lines if not OF_PYTEST.search(line)) + "\n")


def _keep_to_own_cores():
    """Each of several workers has cores of its own: engines that all take all cores hold each other up tenfold."""
    worker, count = os.environ.get("PYTEST_XDIST_WORKER"), int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    if worker is None or count == 1 or not hasattr(os, "sched_setaffinity"):
        return
    cores, number = sorted(os.sched_getaffinity(0)), int(worker.removeprefix("gw"))
    os.sched_setaffinity(0, cores[number::count] or [cores[number % len(cores)]])


@pytest.fixture(scope="session")
def engine():
    """The rendering engine on the CPU."""
    from lippmann.runtime.engine import start

    return start("cpu")


@pytest.fixture(scope="session")
def shared_scenes() -> Path:
    """Real scenes made by others; the test is skipped where they are absent."""
    if not SHARED_SCENES.is_dir():
        pytest.skip("the folder ../shared/scenes with real scenes is not found")
    return SHARED_SCENES


def _display_of_whole_lenses(
    layout="lenticular", lenses=(4, 3), pixels=3, *, pixel_pitch=0.25, distance=math.inf, gap=6.8, **lens_array
):
    from lippmann.display import Display, LensArray, Panel

    magnification = 1.0 + gap / distance
    height = lenses[1] * pixels
    if layout == "hexagonal":
        row_pixels = max(1, round(0.866 * pixels))
        height = row_pixels * lenses[1]
        lens_array.setdefault("row_pitch", row_pixels * pixel_pitch / magnification)
    pitch = lens_array.pop("pitch", pixels * pixel_pitch / magnification)
    return Display(
        name=f"test-{layout}",
        panel=Panel(lenses[0] * pixels, height, pixel_pitch),
        lens_array=LensArray(layout, pitch, **lens_array),
        gap=gap,
        viewing_distance=distance,
        aperture_distance=min(5.0, distance / 2),
    )


@pytest.fixture(scope="session")
def make_display():
    """``make_display(layout, lenses, pixels, ...)``: ``lenses`` (across, down) of ``pixels`` whole pixels each.

    A lenticular sheet has as many rows as a square array.
    """
    return _display_of_whole_lenses


@pytest.fixture
def cut_display(tmp_path):
    """``cut_display(width, height)``: the paper's display with fewer pixels, as a file."""
    import lippmann.display.presets as presets

    def cut(width, height):
        text = (Path(presets.__path__[0]) / "seed-lenticular.toml").read_text()
        path = tmp_path / "small.toml"
        path.write_text(text.replace("width = 512", f"width = {width}").replace("height = 512", f"height = {height}"))
        return path

    return cut


@pytest.fixture
def fake_bridge(monkeypatch):
    """A stand-in for Looking Glass Bridge, with one panel; see :class:`fake_bridge.FakeBridge`."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    from fake_bridge import running

    with running(monkeypatch) as fake:
        yield fake


@pytest.fixture(scope="session")
def moving_ball(tmp_path_factory) -> Path:
    """A glTF file of one second: a ball rises and comes down again 1 to the right, and a camera goes along."""
    import numpy as np
    import trimesh

    scene = trimesh.Scene(trimesh.creation.icosphere(subdivisions=2, radius=0.5))
    path = tmp_path_factory.mktemp("moving") / "ball.gltf"
    times = np.array([0.0, 0.5, 1.0], "<f4")
    places = np.array([[0, 0, 0], [0.5, 1, -0.5], [1, 0, 0]], "<f4")
    along = np.array([[0, 0, 5], [0.5, 0, 5], [1, 0, 5]], "<f4")
    files = trimesh.exchange.gltf.export_gltf(scene)
    tree = json.loads(files.pop("model.gltf"))
    for name, data in files.items():
        (path.parent / name).write_bytes(data)
    ball = next(number for number, node in enumerate(tree["nodes"]) if "mesh" in node)
    tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.6, "znear": 0.1}}]
    tree["nodes"].append({"name": "eye", "camera": 0})
    eye = len(tree["nodes"]) - 1
    for one in tree.get("scenes", []):
        one["nodes"].append(eye)
    first, buffer = len(tree["accessors"]), len(tree["buffers"])
    data = b"".join(array.tobytes() for array in (times, places, along))
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    tree["buffers"].append({"byteLength": len(data), "uri": uri})
    offset = 0
    for array, kind in ((times, "SCALAR"), (places, "VEC3"), (along, "VEC3")):
        tree["accessors"].append(
            {"bufferView": len(tree["bufferViews"]), "componentType": 5126, "count": 3, "type": kind}
        )
        tree["bufferViews"].append({"buffer": buffer, "byteOffset": offset, "byteLength": array.nbytes})
        offset += array.nbytes
    tree["animations"] = [
        {
            "name": "hop",
            "samplers": [{"input": first, "output": first + 1}, {"input": first, "output": first + 2}],
            "channels": [
                {"sampler": 0, "target": {"node": ball, "path": "translation"}},
                {"sampler": 1, "target": {"node": eye, "path": "translation"}},
            ],
        }
    ]
    for node in (ball, eye):
        tree["nodes"][node].pop("matrix", None)
    path.write_text(json.dumps(tree))
    return path


@pytest.fixture(scope="session")
def browser():
    """Chromium, once for all tests of pages; a test is skipped where none is installed."""
    from browser import started

    with ExitStack() as stack:
        try:
            running = stack.enter_context(started())
        except LookupError as error:
            pytest.skip(f"{error}: scripts/setup.sh --dev installs it")
        yield running


@pytest.fixture
def open_tab(browser):
    """``open_tab(**options)``: a fresh :class:`browser.Tab`, closed after the test; options as for ``browser.tab``."""
    from browser import tab

    with ExitStack() as stack:
        yield lambda **options: stack.enter_context(tab(browser, **options))
