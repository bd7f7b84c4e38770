"""Whether a scheduler answers, asked before Dask is: it would try for most of a minute, and say little."""

from __future__ import annotations

import socket
import ssl
import time
from contextlib import closing
from pathlib import Path
from urllib.parse import urlsplit

from lippmann.errors import ClusterError

#: Seconds that a scheduler may take to listen, and to agree on encryption.
SECONDS = 4.0
#: Seconds that it has to refuse a certificate, once it has agreed.
_REFUSAL_SECONDS = 1.0

_START = "start one: dask scheduler"


def check_reachable(address: str, ca: Path | None, certificate: Path | None, key: Path | None) -> None:
    """Raise :class:`ClusterError` unless a scheduler listens at ``address`` and takes these certificates.

    Parameters
    ----------
    address:
        ``tcp://HOST:PORT`` or ``tls://HOST:PORT``; others are left to Dask.
    ca, certificate, key:
        PEM files for ``tls://``; without them, those that Dask's own configuration names are not tried here.
    """
    place = urlsplit(address)
    if place.scheme not in ("tcp", "tls") or place.hostname is None or place.port is None:
        return
    with closing(_connect(address, place.hostname, place.port)) as plain:
        if place.scheme == "tls" and ca is not None and certificate is not None:
            _agree(plain, address, place.hostname, ca, certificate, key)


def _connect(address: str, host: str, port: int) -> socket.socket:
    end = time.monotonic() + SECONDS
    while True:
        try:
            return socket.create_connection((host, port), timeout=max(0.1, end - time.monotonic()))
        except OSError as error:
            # It may be about to start.
            if not isinstance(error, ConnectionRefusedError) or time.monotonic() > end - 0.2:
                raise _silent(address, error.strerror or str(error)) from None
            time.sleep(0.2)


def _agree(plain: socket.socket, address: str, host: str, ca: Path, certificate: Path, key: Path | None) -> None:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False  # as Dask has it: the authority vouches for all
    what = "the certificates cannot be read"
    try:
        context.load_verify_locations(ca)
        context.load_cert_chain(certificate, key)
        plain.settimeout(SECONDS)
        what = f"the scheduler at {address} does not agree on encryption"
        with context.wrap_socket(plain, server_hostname=host) as secret:
            secret.settimeout(_REFUSAL_SECONDS)
            what = f"the scheduler at {address} refuses this certificate"
            try:
                secret.recv(1)
            except TimeoutError:
                return  # it has nothing against it
    except TimeoutError:
        raise _silent(address, "it listens, but says nothing of encryption") from None
    except OSError as error:  # SSLError among them
        why = getattr(error, "verify_message", "") or getattr(error, "reason", "") or error.strerror or str(error)
        raise ClusterError(
            f"{what} ({why})",
            parameter="cluster",
            fix="are tls_ca=..., tls_cert=... and tls_key=... those of this cluster, and valid today?",
        ) from None


def _silent(address: str, why: str) -> ClusterError:
    return ClusterError(f"no scheduler answers at {address} ({why})", parameter="cluster", fix=_START)
