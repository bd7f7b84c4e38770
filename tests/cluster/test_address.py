"""What ``--cluster`` and ``lippmann worker`` may be told."""

from __future__ import annotations

import pytest

from lippmann.cluster.address import Target, TlsFiles, is_on_this_machine, parse_target
from lippmann.cluster.worker import WorkerOptions
from lippmann.errors import ClusterError, UsageError


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("local:2", Target(local=2)),
        ("tcp://10.0.0.1:8786", Target(address="tcp://10.0.0.1:8786")),
        ("tls://node.example:8786", Target(address="tls://node.example:8786")),
        ("tcp://[::1]:8786", Target(address="tcp://[::1]:8786")),
    ],
)
def test_targets(text, target):
    assert parse_target(text) == target


@pytest.mark.parametrize(
    "text",
    ["", "local", "local:0", "local:x", "local:9999", "10.0.0.1:8786", "tcp://10.0.0.1", "http://a:1", "tcp://a:99999"],
)
def test_what_is_no_target(text):
    with pytest.raises(UsageError, match="cluster: "):
        parse_target(text)


@pytest.mark.parametrize(
    ("address", "own"),
    [
        ("tcp://127.0.0.1:1", True),
        ("tcp://localhost:1", True),
        ("tcp://[::1]:1", True),
        ("tcp://10.0.0.1:1", False),
        ("tcp://node:1", False),
    ],
)
def test_loopback(address, own):
    assert is_on_this_machine(address) == own


def test_a_worker_of_another_machine_opens_nothing_unasked():
    with pytest.raises(UsageError, match=r"host: is missing"):
        WorkerOptions("tcp://10.0.0.1:8786")
    assert WorkerOptions("tcp://10.0.0.1:8786", host="10.0.0.2").host == "10.0.0.2"
    assert WorkerOptions("tcp://127.0.0.1:8786").host is None


def test_certificates_go_together(tmp_path):
    for name in ("ca", "cert", "key"):
        (tmp_path / name).write_text("x")
    whole = TlsFiles(tmp_path / "ca", tmp_path / "cert", tmp_path / "key")
    security = whole.security()
    assert security.require_encryption
    assert security.tls_ca_file == str(tmp_path / "ca")
    assert security.tls_client_cert == security.tls_worker_cert == str(tmp_path / "cert")
    with pytest.raises(UsageError, match="tls_key: is missing"):
        TlsFiles(tmp_path / "ca", tmp_path / "cert").security()
    with pytest.raises(UsageError, match="tls_ca: no such file"):
        TlsFiles(tmp_path / "none", tmp_path / "cert", tmp_path / "key").security()


def test_without_certificates_dasks_own_configuration_counts(tmp_path):
    import dask

    with dask.config.set({"distributed.comm.require-encryption": True}):
        assert TlsFiles().security().require_encryption
    assert not TlsFiles().security().require_encryption
    with pytest.raises(UsageError, match="tls_ca: is missing; tls:// goes by certificates"):
        TlsFiles().security("tls://127.0.0.1:8786")


def test_without_dask_it_is_said_how_to_get_it(monkeypatch):
    from lippmann.cluster import address

    def missing(name):
        raise ImportError("No module named 'distributed'")

    monkeypatch.setattr(address, "import_module", missing)
    with pytest.raises(ClusterError, match=r"pip install 'lippmann\[cluster\]'"):
        address.import_distributed()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("render", "teapot", "--cluster", "nowhere", "-o", "x.png"), "'nowhere' is no address"),
        (("render", "teapot", "--tls-ca", "ca.pem", "-o", "x.png"), "--tls-ca: applies to a cluster only"),
        (("worker", "nowhere"), "'nowhere' is no address"),
        (("worker", "tcp://10.0.0.1:8786"), "--host"),
        (("worker", "tcp://127.0.0.1:8786", "--threads", "0"), "from 1 to"),
    ],
)
def test_commands_refuse_in_one_line(capfd, tmp_path, monkeypatch, words, message):
    from lippmann.cli import run

    monkeypatch.chdir(tmp_path)
    assert run(list(words)) == 2
    said = capfd.readouterr().err
    assert message in said
    assert said.count("\n") == 1
