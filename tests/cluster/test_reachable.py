"""Mistakes with addresses and certificates end soon, in one line."""

import datetime
import socket
import ssl
import threading
import time
from contextlib import closing, suppress

import pytest

from lippmann.cluster import reachable
from lippmann.cluster.reachable import check_reachable
from lippmann.errors import ClusterError


def made(folder, name, days=2):
    """Paths of a certificate that vouches for itself, and of its key."""
    x509 = pytest.importorskip("cryptography.x509")
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    now = datetime.datetime.now(datetime.timezone.utc)
    builder = x509.CertificateBuilder().subject_name(subject).issuer_name(subject).public_key(key.public_key())
    builder = builder.serial_number(7).not_valid_before(now - datetime.timedelta(days=9))
    builder = builder.not_valid_after(now + datetime.timedelta(days=days))
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
    certificate = builder.sign(key, hashes.SHA256())
    paths = folder / f"{name}.pem", folder / f"{name}.key"
    paths[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    form = serialization.PrivateFormat.PKCS8
    paths[1].write_bytes(key.private_bytes(serialization.Encoding.PEM, form, serialization.NoEncryption()))
    return paths


@pytest.fixture
def listener():
    """Starts a server that asks for certificates, or one that says nothing; gives its address."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve(certificate=None, key=None, trusted=None):
            context = None
            if certificate is not None:
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
                context.load_cert_chain(certificate, key)
                context.load_verify_locations(trusted)
                context.verify_mode = ssl.CERT_REQUIRED

            def answer():
                with suppress(OSError):
                    while True:
                        connection, _ = server.accept()
                        with closing(connection), suppress(OSError):
                            if context is None:
                                connection.recv(1 << 16)
                                time.sleep(1.0)
                            else:
                                with context.wrap_socket(connection, server_side=True) as secret:
                                    secret.recv(1)

            threading.Thread(target=answer, daemon=True).start()
            return f"tls://127.0.0.1:{server.getsockname()[1]}"

        yield serve


def refusal(*words):
    began = time.monotonic()
    with pytest.raises(ClusterError) as caught:
        check_reachable(*words)
    assert time.monotonic() - began < 5.0
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_nobody_listens(monkeypatch):
    monkeypatch.setattr(reachable, "SECONDS", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    said = refusal(f"tcp://127.0.0.1:{port}", None, None, None)
    assert said.startswith(f"cluster: no scheduler answers at tcp://127.0.0.1:{port} (")
    assert said.endswith("start one: dask scheduler")


def test_a_scheduler_that_is_about_to_start_is_waited_for():
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    started = []
    threading.Timer(0.4, lambda: started.append(socket.create_server(("127.0.0.1", port)))).start()
    check_reachable(f"tcp://127.0.0.1:{port}", None, None, None)
    started[0].close()


@pytest.mark.slow
def test_certificates_that_agree(listener, tmp_path):
    certificate, key = made(tmp_path, "ours")
    check_reachable(listener(certificate, key, certificate), certificate, certificate, key)


def test_a_certificate_that_is_out_of_date(listener, tmp_path):
    certificate, key = made(tmp_path, "ours")
    old, old_key = made(tmp_path, "old", days=-1)
    said = refusal(listener(old, old_key, certificate), old, certificate, key)
    assert "does not agree on encryption (certificate has expired)" in said


def test_another_authority(listener, tmp_path):
    certificate, key = made(tmp_path, "ours")
    other, _ = made(tmp_path, "other")
    assert "does not agree on encryption (" in refusal(listener(certificate, key, certificate), other, certificate, key)


def test_a_certificate_that_the_scheduler_does_not_know(listener, tmp_path):
    certificate, key = made(tmp_path, "ours")
    other, other_key = made(tmp_path, "other")
    address = listener(certificate, key, certificate)
    assert f"the scheduler at {address} refuses this certificate (" in refusal(address, certificate, other, other_key)


def test_files_that_are_no_certificates(listener, tmp_path):
    certificate, key = made(tmp_path, "ours")
    address = listener(certificate, key, certificate)
    assert "the certificates cannot be read (" in refusal(address, key, certificate, key)


def test_a_server_without_encryption(listener, tmp_path, monkeypatch):
    monkeypatch.setattr(reachable, "SECONDS", 0.3)
    certificate, key = made(tmp_path, "ours")
    assert "it listens, but says nothing of encryption" in refusal(listener(), certificate, certificate, key)
