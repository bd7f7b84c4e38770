"""What ``--cluster`` names: a scheduler somewhere, or workers to be started here."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from lippmann.errors import ClusterError, UsageError

LOOPBACK = "127.0.0.1"

#: Workers that one machine may be asked to start.
_MOST_LOCAL = 1024

_RULE = "tcp://HOST:8786 or tls://HOST:8786 of a scheduler, or local:N for N workers here"


@dataclass(frozen=True)
class Target:
    """A scheduler's ``address``, or the number of workers to start here: one of the two is set."""

    address: str | None = None
    local: int | None = None


@dataclass(frozen=True)
class TlsFiles:
    """Files (PEM) for encrypted connections; all three or none. Without them Dask's own configuration counts."""

    ca: Path | None = None
    certificate: Path | None = None
    key: Path | None = None

    def options(self) -> dict[str, Path | None]:
        """The three by the names of the command line's options."""
        return {"--tls-ca": self.ca, "--tls-cert": self.certificate, "--tls-key": self.key}

    def security(self) -> Any:
        """``distributed.Security`` with these files, or with what Dask is configured to use.

        Raises
        ------
        UsageError
            Some of the three are missing, or a file is.
        """
        given = self.options()
        distributed = import_distributed()
        if not any(given.values()):
            return distributed.Security()
        for option, path in given.items():
            if path is None:
                raise UsageError("is missing", where=option, rule="--tls-ca, --tls-cert and --tls-key go together")
            if not path.is_file():
                raise UsageError(f"no such file '{path}'", where=option)
        roles = {f"tls_{role}_{what}": str(given[f"--tls-{what}"]) for role in _ROLES for what in ("cert", "key")}
        return distributed.Security(require_encryption=True, tls_ca_file=str(self.ca), **roles)


_ROLES = ("client", "worker", "scheduler")

#: Schemes whose two ends ask each other for certificates.
_AUTHENTICATED = ("tls", "wss")


def temporary_security() -> Any:
    """``distributed.Security`` with a certificate that is made for one cluster, kept in memory and trusted by no other.

    All roles of the cluster have this certificate and accept nobody who has not.

    Raises
    ------
    ClusterError
        The package that makes certificates is not installed.
    """
    try:
        return import_distributed().Security.temporary()
    except ImportError as error:
        raise ClusterError(f"no certificate can be made ({error})", fix="pip install 'lippmann[cluster]'") from None


def warn_of_exposure(address: str, security: Any, remark: Callable[[str], None]) -> None:
    """Call ``remark`` with one line on who can run code through connections to ``address``, unless certificates forbid.

    Dask runs whatever functions its peers send: a scheduler those of clients, a worker and a client those of all
    whom the scheduler lets in. ``security`` is the ``distributed.Security`` of the connection.
    """
    if security.require_encryption or urlsplit(address).scheme in _AUTHENTICATED:
        return  # Dask connects with certificates on both ends, or not at all
    who = "every account of this machine" if is_loopback(address) else "everyone who can reach that port"
    remark(
        f"WARNING: {address} asks nobody for a certificate: {who} can run code as you, on the workers and here "
        "(use tls:// with --tls-ca, --tls-cert and --tls-key)"
    )


def parse_target(text: str) -> Target:
    """What the text of ``--cluster`` names.

    Raises
    ------
    UsageError
        Neither form fits.
    """
    local = re.fullmatch(r"local:(\d{1,6})", text.strip())
    if local is not None:
        count = int(local[1])
        if not 1 <= count <= _MOST_LOCAL:
            raise UsageError(f"{count} workers", where="--cluster", rule=f"1 to {_MOST_LOCAL} can be started here")
        return Target(local=count)
    return Target(address=checked_address(text.strip(), "--cluster", _RULE))


def checked_address(text: str, where: str, rule: str) -> str:
    """A scheduler's address, known to have a host and a port.

    Raises
    ------
    UsageError
        It has not.
    """
    try:
        parts = urlsplit(text)
        fits = parts.scheme in ("tcp", "tls", "ucx", "ws", "wss") and bool(parts.hostname) and parts.port is not None
    except ValueError:
        fits = False
    if not fits:
        raise UsageError(f"'{text}' will not do", where=where, rule=rule)
    return text


def is_loopback(address: str) -> bool:
    """Whether a scheduler's address can only be reached from this machine."""
    host = urlsplit(address).hostname or ""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def import_distributed() -> Any:
    """The package ``distributed``, loaded when a cluster is first asked for.

    Raises
    ------
    ClusterError
        It is not installed.
    """
    try:
        return import_module("distributed")
    except ImportError as error:
        raise ClusterError(f"Dask cannot be loaded ({error})", fix="pip install 'lippmann[cluster]'") from None
