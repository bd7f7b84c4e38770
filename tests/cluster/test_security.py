"""What other accounts of the machine, and files that lie about, may do to a cluster: nothing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.error import URLError
from urllib.parse import urlsplit
from urllib.request import ProxyHandler, build_opener

import psutil
import pytest

from lippmann.cluster import Target, TlsFiles, connect
from lippmann.cluster.address import warn_of_exposure
from lippmann.cluster.private_scratch import private_scratch
from lippmann.errors import ClusterError, UsageError

#: Another account's program. It tries to run a function in each process of a cluster, which writes a file ``NAME-HOW``.
INTRUDER = """
import asyncio, pathlib, ssl, sys
import distributed
from distributed.protocol.pickle import dumps

folder, *addresses = sys.argv[1:]

def write(folder, name):
    (pathlib.Path(folder) / name).touch()

async def run(name, how, address, arguments):
    words = {"function": dumps(write), "args": dumps((folder, f"{name}-{how}"))}
    async with distributed.rpc(address, connection_args=arguments, timeout=8) as process:
        await (process.run_function(**words) if name == "scheduler" else process.run(**words))

async def submit(how, address, security):
    async with distributed.Client(address, security=security, asynchronous=True, timeout=8) as client:
        await client.submit(write, folder, f"client-{how}", pure=False)

async def report(name, how, attempt):
    try:
        await asyncio.wait_for(attempt, 20)
    except Exception as error:
        print(name, how, "refused", type(error).__name__)
    else:
        print(name, how, "SERVED")

async def main():
    own = distributed.Security.temporary()
    careless = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    careless.check_hostname, careless.verify_mode = False, ssl.CERT_NONE
    plain = {"require_encryption": False}
    attempts = []
    for name, address in zip(("scheduler", "worker", "nanny"), addresses):
        bare = address.partition("://")[2]
        attempts += [
            report(name, "tcp", run(name, "tcp", f"tcp://{bare}", plain)),
            report(name, "own", run(name, "own", f"tls://{bare}", own.get_connection_args("client"))),
            report(name, "none", run(name, "none", f"tls://{bare}", {"ssl_context": careless, **plain})),
        ]
    bare = addresses[0].partition("://")[2]
    attempts += [
        report("client", "tcp", submit("tcp", f"tcp://{bare}", None)),
        report("client", "own", submit("own", f"tls://{bare}", own)),
    ]
    await asyncio.gather(*attempts)

asyncio.run(main())
"""

#: Pages of Dask's dashboards and of its programs' interface.
PAGES = ("status", "info/main/workers.html", "json/identity.json", "metrics", "health", "individual-task-stream")


@pytest.mark.slow
def test_nobody_else_runs_code_in_a_cluster_of_this_machine_or_sees_its_pages(tmp_path, until):
    """Scheduler, worker and nanny refuse all who have not the cluster's certificate; the cluster itself works.

    A worker that takes the place of one that died shows no pages, either.
    """
    from distributed.comm.addressing import unparse_address

    (tmp_path / "intruder.py").write_text(INTRUDER)
    marks = tmp_path / "marks"
    marks.mkdir()
    remarks: list[str] = []
    with connect(Target(local=1), remark=remarks.append) as cluster:
        _check_ports()
        (worker,) = cluster.client.scheduler_info()["workers"].items()
        addresses = (cluster.client.scheduler.address, worker[0], worker[1]["nanny"])
        run = subprocess.run(
            [sys.executable, tmp_path / "intruder.py", marks, *addresses],
            env={**os.environ, "PYTHONWARNINGS": "ignore", "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "8s"},
            capture_output=True,
            text=True,
            check=True,
        )
        assert sorted(path.name for path in marks.iterdir()) == []
        outcomes = sorted(run.stdout.splitlines())
        assert len(outcomes) == 11
        assert [line for line in outcomes if "refused" not in line] == []
        assert {urlsplit(address).scheme for address in addresses} == {"tls"}
        assert cluster.client.submit(unparse_address, "tls", "served").result(timeout=30) == "tls://served"
        ((address, process),) = cluster.client.run(os.getpid).items()
        os.kill(process, signal.SIGKILL)
        until(lambda: set(cluster.client.nthreads()) - {address})
        _check_ports()
    assert remarks == []


def _check_ports() -> None:
    places = list(_listening())
    # Scheduler, nanny and worker, and HTTP servers of two of them: Dask opens these always, with or without pages.
    assert len(places) == 5
    assert {host for host, _ in places} == {"127.0.0.1"}
    shown = [f"{port}/{page}" for host, port in places for page in PAGES if _shows(f"http://{host}:{port}/{page}")]
    assert shown == []


def _listening() -> Iterator[tuple[str, int]]:
    this = psutil.Process()
    for process in (this, *this.children(recursive=True)):
        for one in process.net_connections("inet"):
            if one.status == "LISTEN":
                yield one.laddr.ip, one.laddr.port


def _shows(address: str) -> bool:
    try:
        with build_opener(ProxyHandler({})).open(address, timeout=20) as answer:
            return bool(answer.read())
    except (URLError, OSError):
        return False


def test_certificates_need_a_package(monkeypatch):
    from distributed import Security

    def temporary() -> None:
        raise ImportError("Using `Security.temporary` requires `cryptography`")

    monkeypatch.setattr(Security, "temporary", temporary)
    with (
        pytest.raises(ClusterError, match=r"cryptography.*pip install 'lippmann\[cluster\]'"),
        connect(Target(local=1)),
    ):
        pass


def test_a_cluster_of_this_machine_makes_its_own_certificates(tmp_path):
    tls = TlsFiles(key=tmp_path / "key.pem")
    with pytest.raises(UsageError, match=r"tls_key: .*local:N"), connect(Target(local=1), tls):
        pass


@pytest.mark.parametrize(
    ("address", "who"),
    [
        ("tcp://127.0.0.1:8786", "every account of this machine"),
        ("tcp://localhost:8786", "every account of this machine"),
        ("tcp://10.0.0.1:8786", "everyone who can reach that port"),
        ("ws://10.0.0.1:8786", "everyone who can reach that port"),
    ],
)
def test_open_connections_say_what_they_expose(address, who):
    said: list[str] = []
    warn_of_exposure(address, TlsFiles().security(), said.append)
    (line,) = said
    assert line.startswith("WARNING: ")
    assert address in line
    assert f"{who} can run code as you" in line
    assert "tls:// with tls_ca=..., tls_cert=... and tls_key=..." in line
    assert "\n" not in line


@pytest.mark.parametrize("address", ["tls://127.0.0.1:8786", "tls://10.0.0.1:8786", "wss://10.0.0.1:8786"])
def test_connections_with_certificates_need_no_warning(address):
    said: list[str] = []
    warn_of_exposure(address, TlsFiles().security(), said.append)
    assert said == []


def test_where_dask_refuses_open_connections_no_warning_is_needed():
    import dask

    said: list[str] = []
    with dask.config.set({"distributed.comm.require-encryption": True}):
        warn_of_exposure("tcp://127.0.0.1:8786", TlsFiles().security(), said.append)
    assert said == []


@pytest.mark.long
def test_the_warning_comes_before_the_connection(monkeypatch):
    """Whoever listens there instead of the scheduler can already send code when the connection stands."""
    from lippmann.cluster import connection

    monkeypatch.setattr(connection, "CONNECT_SECONDS", 1)
    remarks: list[str] = []
    with (
        pytest.raises(ClusterError, match="no scheduler answers"),
        connect(Target(address="tcp://127.0.0.1:1"), remark=remarks.append),
    ):
        pass
    (line,) = remarks
    assert line.startswith("WARNING: tcp://127.0.0.1:1 ")


def test_scratch_files_lie_where_dask_is_told_and_where_nobody_else_reads(tmp_path):
    import dask

    before = list(sys.path)
    with dask.config.set({"temporary-directory": str(tmp_path / "fast" / "disk")}), private_scratch() as folder:
        assert Path(folder).parent == tmp_path / "fast" / "disk"
        assert Path(folder).stat().st_mode & 0o777 == 0o700
        sys.path.insert(1, f"{folder}/dask-scratch-space")
    assert sys.path == before
    assert list((tmp_path / "fast" / "disk").iterdir()) == []


def test_scratch_files_that_can_lie_nowhere(tmp_path):
    import dask

    (tmp_path / "file").touch()
    with (
        dask.config.set({"temporary-directory": str(tmp_path / "file")}),
        pytest.raises(ClusterError, match=r"no folder for Dask's files.*DASK_TEMPORARY_DIRECTORY"),
        private_scratch(),
    ):
        pass


#: Modules that Dask, its workers and a render import after they have started, as far as they do not lie in a package.
MODULES = (
    "multiprocessing",
    "random",
    "socket",
    "ssl",
    "pickle",
    "msgpack",
    "numpy",
    "drjit",
    "mitsuba",
    "lippmann",
    "cloudpickle",
    "imagecodecs",
    "tifffile",
    "trimesh",
    "PIL",
    "dask",
    "distributed",
    "tornado",
    "psutil",
    "lz4",
    "zict",
    "bokeh",
    "jupyter_server_proxy",
    "prometheus_client",
    "crick",
    "uvloop",
)


class Places:
    """A working directory and a temporary folder, one of them full of stand-ins of modules, which leave marks."""

    def __init__(self, folder: Path, hostile: str) -> None:
        self.working, self.shared, self._marks = folder / "working", folder / "shared", folder / "marks"
        for path in (self.working, self.shared, self._marks):
            path.mkdir()
        planted = self.working if hostile == "working" else self.shared / "dask-scratch-space"
        planted.mkdir(exist_ok=True)
        planted.chmod(0o777)
        for name in MODULES:
            mark = f"open({str(self._marks / name)!r}, 'w').close()"
            (planted / f"{name}.py").write_text(f"{mark}\nraise SystemExit(3)\n")

    def imported(self) -> list[str]:
        """Stand-ins that were imported."""
        return sorted(path.name for path in self._marks.iterdir())

    def left(self) -> set[str]:
        """What the program has left in the temporary folder."""
        return {path.name for path in self.shared.iterdir()} - {"dask-scratch-space"}


@pytest.fixture(params=["working", "temporary"])
def places(request, tmp_path, monkeypatch) -> Places:
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    return Places(tmp_path, request.param)


@pytest.fixture
def program(tmp_path) -> Path:
    """What pip installs as ``lippmann``: a script in a folder of its own."""
    path = tmp_path / "bin" / "lippmann-here"
    path.parent.mkdir()
    path.write_text("import sys\nfrom lippmann.cli import main\nif __name__ == '__main__':\n    sys.exit(main())\n")
    return path


@pytest.mark.long
def test_a_render_imports_nothing_that_lies_about(places, program):
    """Neither beside the scene nor in the folder that Dask would share with all accounts of the machine."""
    options = ("primitives", "--integrator", "direct", "--spp", "2", "--device", "cpu", "--cluster", "local:1")
    run = subprocess.run(
        [sys.executable, program, "render", *options, "-o", "picture.png"],
        cwd=places.working,
        env={**os.environ, "TMPDIR": str(places.shared)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert places.imported() == []
    assert run.returncode == 0, run.stderr
    assert (places.working / "picture.png").is_file()
    assert places.left() == set()


@pytest.mark.long
def test_a_worker_imports_nothing_that_lies_about(lab, places, program, until):
    from distributed import Client

    def search_path() -> list[str]:
        import sys

        return sys.path

    lab.start_scheduler()
    words = ("worker", lab.address, "--threads", "1")
    worker = lab.start_program(program, *words, folder=places.working, TMPDIR=str(places.shared))
    with Client(lab.address, set_as_default=False) as client:
        until(lambda: client.nthreads() or places.imported() or worker.poll() is not None)
        assert places.imported() == []
        assert list(client.nthreads().values()) == [1], lab.log()
        paths: dict[str, list[str]] = client.run(search_path)
    (path,) = paths.values()
    assert not {"", str(places.working), str(places.shared / "dask-scratch-space")} & set(path)
    assert "WARNING: " in lab.log()
    worker.terminate()
    worker.wait(timeout=30)
    assert places.imported() == []
    assert places.left() == set()
