"""Pictures on clusters of real processes that fail in all the ways processes fail."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from urllib.request import urlopen

import psutil
import pytest

from lippmann.errors import ClusterError, UsageError

TILES = 16
#: Of a picture that is the same byte by byte wherever its tiles are rendered.
OPTIONS = {"integrator": "direct", "method": "full", "spp": 2, "device": "cpu"}


@pytest.mark.long
def test_a_killed_worker_and_a_poisoned_tile(lab, render, here, until):
    """A worker dies in mid-tile and is replaced; a tile that cannot be rendered is named, the rest goes on."""
    lab.start()
    lab.fail("kill", 3)
    lab.fail("poison", 6)
    first = render(lab.address).finish()
    assert isinstance(first.error, ClusterError)
    assert first.error.exit_code == 1
    assert "1 of 16 tiles failed again and again: r0001_c0002 (ValueError: poisoned)" in str(first.error)
    assert not first.output.exists()
    assert lab.done() == set(range(TILES)) - {6}
    lab.heal("poison", 6)
    second = render(lab.address, resume=True).finish()
    assert second.error is None
    assert second.result.resumed == TILES - 1
    assert second.output.read_bytes() == here


@pytest.mark.long
def test_the_dashboard_shows_tiles_by_name(lab, render, until):
    """The page of a worker, as people and programs get it, lists the tile that it holds: row 1, column 2."""
    pytest.importorskip("bokeh")
    lab.start()
    lab.fail("hold", 6)
    begun = render(lab.address)
    until(lambda: 6 in lab.begun())
    (link,) = (line.split()[-1] for line in begun.remarks if "dashboard" in line)
    assert link.startswith("http://127.0.0.1:")
    home = link.removesuffix("/status")
    (worker,) = re.findall(r'href="\.\./(worker/[^"]+\.html)"', _page(f"{home}/info/main/workers.html"))
    assert "tile-r0001_c0002-" in _page(f"{home}/info/{worker}")
    assert "Dask: TaskStream" in _page(f"{home}/individual-task-stream")
    lab.heal("hold", 6)
    assert begun.finish().error is None


def _page(address: str) -> str:
    with urlopen(address, timeout=20) as answer:
        return answer.read().decode()


@pytest.mark.long
@pytest.mark.parametrize(
    "options", [{}, {"threads": "2"}, {"command": "dask"}], ids=["one thread", "two threads", "Dask's own"]
)
def test_the_same_bytes_as_on_one_machine(lab, render, here, options):
    lab.start(2, **options)
    done = render(lab.address).finish()
    assert done.error is None
    assert done.output.read_bytes() == here


@pytest.mark.long
def test_all_workers_gone_and_new_ones_come(lab, render, here, until):
    lab.start_scheduler()
    workers = [lab.start_worker(), lab.start_worker()]
    lab.fail("slow")
    begun = render(lab.address)
    until(lambda: len(lab.done()) >= 4)
    for worker in workers:
        lab.kill(worker)
    until(lambda: any("no workers" in line for line in begun.remarks))
    lab.start_worker()
    begun.finish()
    assert begun.error is None
    assert begun.output.read_bytes() == here


@pytest.mark.long
def test_a_film_whose_first_worker_dies_and_whose_second_comes_late(lab, until, cut_display, tmp_path):
    """The same files as here, though the frames after a key frame are rendered by three processes."""
    words = ("render", "teapot", "--turntable", "9", "--swing", "20", "-d", cut_display(96, 56), "--quiet", "--threads")
    program = [sys.executable, "-c", "from lippmann.cli import main; main()", *map(str, words), "1"]
    lab.start_scheduler()
    lab.fail("kill", 2)
    there = [*program, "--cluster", lab.address, "-o", tmp_path / "there", "--video", tmp_path / "film.png"]
    begun = subprocess.Popen(there)
    lab.start_worker()
    until(lambda: 2 in lab.begun())
    lab.start_worker()
    subprocess.run([*program, "-o", tmp_path / "here"], check=True)
    assert begun.wait(120) == 0
    assert not (lab.faults / "kill-2").exists()
    for path in sorted((tmp_path / "here").iterdir()):
        assert path.read_bytes() == (tmp_path / "there" / path.name).read_bytes()
    assert (tmp_path / "film.png").exists()


@pytest.mark.long
def test_a_restarted_scheduler_is_told_and_resumed_from(lab, render, here, until):
    scheduler = lab.start_scheduler()
    lab.start_worker()
    lab.fail("slow")
    begun = render(lab.address)
    until(lambda: len(lab.done()) >= 5)
    lab.kill(scheduler)
    begun.finish()
    assert isinstance(begun.error, ClusterError)
    assert "resume=True" in str(begun.error)
    lab.heal("slow")
    lab.start()
    again = render(lab.address, resume=True).finish()
    assert again.error is None
    assert again.result.resumed >= 3
    assert again.output.read_bytes() == here


@pytest.mark.long
def test_a_worker_of_another_version_is_refused_by_name(lab, render, here):
    lab.start(version="0.0.1")
    alone = render(lab.address, "alone.png").finish()
    assert isinstance(alone.error, ClusterError)
    assert "tcp://127.0.0.1:" in str(alone.error)
    assert "it has Lippmann 0.0.1, the client has" in str(alone.error)
    assert lab.begun() == set()


@pytest.mark.long
def test_the_others_do_what_a_refused_worker_may_not(lab, render, here, until):
    lab.start_scheduler()
    lab.start_worker()
    lab.fail("hold")
    begun = render(lab.address)
    until(lab.begun)
    lab.start_worker(version="0.0.1")
    until(lambda: any("0.0.1" in line for line in begun.remarks))
    lab.heal("hold")
    assert begun.finish().error is None
    assert begun.output.read_bytes() == here


@pytest.mark.long
def test_a_slow_worker_keeps_its_tiles(lab, render, here, until):
    """One worker falls asleep in mid-tile, and the process of the other is stopped for a while."""
    lab.start(1)
    stopped = lab.start_worker()
    lab.fail("slow")
    lab.fail("freeze", 2)
    begun = render(lab.address)
    until(lambda: len(lab.done()) >= 2)
    processes = [psutil.Process(stopped.pid), *psutil.Process(stopped.pid).children(recursive=True)]
    for process in processes:
        os.kill(process.pid, signal.SIGSTOP)
    until(lambda: len(lab.done()) >= 8)
    for process in processes:
        os.kill(process.pid, signal.SIGCONT)
    assert begun.finish().error is None
    assert begun.output.read_bytes() == here


@pytest.mark.long
def test_a_worker_out_of_memory_is_replaced(lab, render, here):
    lab.start_scheduler()
    lab.start_worker("--memory", "1200M")
    lab.fail("hog", 5)
    done = render(lab.address).finish()
    assert done.error is None
    assert done.output.read_bytes() == here
    assert not (lab.faults / "hog-5").exists()


@pytest.mark.long
def test_a_tile_that_kills_its_workers_is_given_up(lab, render, until):
    lab.start()
    kills = 0

    def done_or_killed() -> bool:
        nonlocal kills
        if begun.is_alive() and not (lab.faults / "kill-4").exists():
            lab.fail("kill", 4)
            kills += 1
        return not begun.is_alive()

    begun = render(lab.address)
    until(done_or_killed, 300)
    assert isinstance(begun.error, ClusterError)
    assert "its workers died" in str(begun.error)


@pytest.mark.long
def test_a_scheduler_that_stands_still_ends_the_render(lab, render, until, monkeypatch):
    monkeypatch.setattr("lippmann.cluster.runner.SILENCE", 2.0)
    scheduler = lab.start_scheduler()
    worker = lab.start_worker()
    lab.fail("hold")
    begun = render(lab.address)
    until(lab.begun)
    scheduler.send_signal(signal.SIGSTOP)
    begun.finish(60)
    assert "has not answered for 2 s" in str(begun.error)
    lab.kill(scheduler)
    lab.kill(worker)
    assert "Traceback" not in lab.log()


@pytest.mark.long
def test_interrupting_leaves_no_tiles_behind(lab, render, until):
    """What nobody waits for any more is not rendered."""
    from lippmann.cluster import connect, parse_target

    lab.start()
    lab.fail("slow")
    with connect(parse_target(lab.address)) as cluster:
        from lippmann import api
        from lippmann.cluster.runner import run_on

        def put(_: object) -> None:
            raise KeyboardInterrupt

        def runner(prepared, missing, _):
            run_on(cluster, prepared.job, missing, put)

        with pytest.raises(KeyboardInterrupt):
            api.render_to_file("primitives", lab.faults.parent / "x.png", runner=runner, **OPTIONS)
        until(lambda: not cluster.client.processing() or not any(cluster.client.processing().values()))
        assert len(lab.begun()) < TILES


@pytest.mark.long
def test_encrypted_connections(lab, here, tmp_path, until):
    """Certificates go from our options to Dask; who has none gets no picture."""
    from lippmann import api
    from lippmann.cluster import TlsFiles, connect, parse_target
    from lippmann.cluster.runner import runner_on

    if shutil.which("openssl") is None:
        pytest.skip("openssl is not found to make certificates")
    key, certificate = tmp_path / "key.pem", tmp_path / "cert.pem"
    name = ["-subj", "/CN=lippmann-test", "-days", "2", "-nodes", "-newkey", "rsa:2048"]
    subprocess.run(
        ["openssl", "req", "-x509", *name, "-keyout", key, "-out", certificate], check=True, capture_output=True
    )
    files = ("--tls-ca-file", certificate, "--tls-cert", certificate, "--tls-key", key)
    lab.start_scheduler("--protocol", "tls", *map(str, files))
    address = lab.address.replace("tcp://", "tls://")
    ours = ("--tls-ca", certificate, "--tls-cert", certificate, "--tls-key", key)
    lab.start_worker(*map(str, ours), address=address)
    output = tmp_path / "x.png"
    with connect(parse_target(address), TlsFiles(certificate, certificate, key)) as cluster:
        api.render_to_file("primitives", output, runner=runner_on(cluster), **OPTIONS)
    assert output.read_bytes() == here
    with pytest.raises(UsageError, match="tls_ca: is missing"), connect(parse_target(address)):
        pass


@pytest.mark.slow
def test_nothing_listens_beyond_loopback(lab, until):
    lab.start()
    until(lambda: "Registered to" in lab.log())
    found = set()
    for process in lab.processes():
        for child in (process, *process.children(recursive=True)):
            found |= {one.laddr.ip for one in child.net_connections("inet") if one.status == "LISTEN"}
    assert found == {"127.0.0.1"}


@pytest.mark.long
def test_no_more_is_rendered_than_is_taken_in(lab, tmp_path, until):
    """While the disk here takes its time the workers wait."""
    from lippmann import api
    from lippmann.cluster import connect, parse_target
    from lippmann.cluster.runner import TILES_PER_THREAD, run_on

    lab.start()
    seen: list[int] = []

    def runner(prepared, missing, put):
        def slow(result):
            until(lambda: len(lab.done()) >= min(TILES, len(seen) + TILES_PER_THREAD))
            time.sleep(0.3)
            seen.append(len(lab.begun()) - len(seen))
            put(result)

        run_on(cluster, prepared.job, missing, slow)

    with connect(parse_target(lab.address)) as cluster:
        api.render_to_file("primitives", tmp_path / "x.png", runner=runner, **OPTIONS)
    assert len(seen) == TILES
    assert max(seen) <= TILES_PER_THREAD


@pytest.mark.long
def test_a_scene_goes_to_each_worker_once(lab, tmp_path):
    """Of two pictures of one scene, too."""
    from lippmann import api
    from lippmann.cluster import connect, parse_target
    from lippmann.cluster.job_pickle import pack
    from lippmann.cluster.runner import run_on

    lab.start(2)
    lab.fail("slow")
    names: set[str] = set()

    def runner(prepared, missing, put):
        names.update(pack(prepared.job).names)
        run_on(cluster, prepared.job, missing, put)

    def received(dask_worker):
        return [str(key) for entry in dask_worker.transfer_incoming_log for key in entry["keys"]]

    with connect(parse_target(lab.address)) as cluster:
        for seed in (1, 2):
            output = tmp_path / f"{seed}.png"
            api.render_to_file("primitives", output, runner=runner, **OPTIONS, seed=seed)
        logs = cluster.client.run(received)
    assert names
    assert len(logs) == 2
    for keys in logs.values():
        parts = [key for key in keys if key.removeprefix("scene-") in names]
        assert len(parts) == len(set(parts)) <= len(names)


@pytest.mark.long
def test_workers_that_end_while_they_start_are_one_line(tmp_path):
    """As the kernel does when memory is short: the process is gone before it has said anything."""
    preload = tmp_path / "ends.py"
    preload.write_text("import os\n\n\ndef dask_setup(worker):\n    os._exit(9)\n")
    code = "from lippmann.cli import main; main()"
    words = ["render", "teapot", "--display", "seed-lenticular", "--spp", "1", "--cluster", "local:2", "-o", "p.png"]
    ended = subprocess.run(
        [sys.executable, "-c", code, *words],
        env={**os.environ, "DASK_DISTRIBUTED__WORKER__PRELOAD": str(preload)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith(
        "lippmann: --cluster: the workers of this machine did not start (RuntimeError"
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ends.py"]
