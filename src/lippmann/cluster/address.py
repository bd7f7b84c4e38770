"""Addresses of clusters, their TLS files, and the warning of unauthenticated connections."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from lippmann.errors import ClusterError, UsageError
from lippmann.runtime.machine import is_loopback

if TYPE_CHECKING:
    from distributed import Security

LOOPBACK = "127.0.0.1"

#: Limit on the number of workers started on this machine.
_MOST_LOCAL = 1024

_RULE = "tcp://HOST:8786 or tls://HOST:8786 of a scheduler, or local:N for N workers here"


@dataclass(frozen=True)
class Target:
    """A cluster to render on; exactly one of the two is set.

    Attributes
    ----------
    address:
        Address of a running scheduler, such as ``tls://HOST:8786``.
    local:
        Number of workers to start on this machine.
    """

    address: str | None = None
    local: int | None = None


@dataclass(frozen=True)
class TlsFiles:
    """PEM files for TLS connections: all three, or none to use Dask's own configuration.

    Attributes
    ----------
    ca:
        Certificate of the authority.
    certificate:
        Certificate of this machine.
    key:
        Private key of this machine.
    """

    ca: Path | None = None
    certificate: Path | None = None
    key: Path | None = None

    def options(self) -> dict[str, Path | None]:
        """The three files by the names of the parameters that they come from."""
        return {"tls_ca": self.ca, "tls_cert": self.certificate, "tls_key": self.key}

    def security(self, address: str = "") -> Security:
        """``distributed.Security`` for ``address`` with these files, or with those of Dask's configuration.

        Raises
        ------
        UsageError
            If one of the three is not given, or a file does not exist; the address is ``tls://``, and neither are there
            files nor does Dask's configuration name any.
        ClusterError
            If Dask is not installed.
        """
        files = self.options()
        distributed = import_distributed()
        if not any(files.values()):
            configured = distributed.Security()
            if urlsplit(address).scheme == "tls" and not configured.tls_ca_file:
                rule = "tls:// goes by certificates: tls_ca=..., tls_cert=... and tls_key=..."
                raise UsageError(
                    "is missing", parameter="tls_ca", rule=rule, fix="or name them in Dask's configuration"
                )
            return configured
        for name, path in files.items():
            if path is None:
                rule = "tls_ca=..., tls_cert=... and tls_key=... go together"
                raise UsageError("is missing", parameter=name, rule=rule)
            if not path.is_file():
                raise UsageError(f"no such file '{path}'", parameter=name)
        roles = {f"tls_{role}_{what}": str(files[f"tls_{what}"]) for role in _ROLES for what in ("cert", "key")}
        return distributed.Security(require_encryption=True, tls_ca_file=str(self.ca), **roles)


_ROLES = ("client", "worker", "scheduler")

#: Schemes of mutual authentication by certificates.
_AUTHENTICATED = ("tls", "wss")


def temporary_security() -> Security:
    """``distributed.Security`` with a new self-signed certificate, held in memory.

    All roles of one cluster share the certificate and accept no other.

    Raises
    ------
    ClusterError
        If the package that makes certificates is not installed.
    """
    try:
        return import_distributed().Security.temporary()
    except ImportError as error:
        raise ClusterError(f"no certificate can be made ({error})", fix="pip install 'lippmann[cluster]'") from None


def warn_of_exposure(address: str, security: Security, remark: Callable[[str], None]) -> None:
    """Warn of a connection without certificates, through which others can run code.

    Dask runs the functions that its peers send: a scheduler those of clients, a worker and a client those of everyone
    whom the scheduler admits.

    Parameters
    ----------
    address:
        Address of the scheduler.
    security:
        Security of the connection.
    remark:
        Called with the warning, one line; not called if the connection is authenticated.
    """
    if security.require_encryption or urlsplit(address).scheme in _AUTHENTICATED:
        return  # Dask then connects with certificates at both ends or not at all
    who = "every account of this machine" if is_on_this_machine(address) else "everyone who can reach that port"
    remark(
        f"WARNING: {address} asks nobody for a certificate: {who} can run code as you, on the workers and here "
        "(use tls:// with tls_ca=..., tls_cert=... and tls_key=...)"
    )


def parse_target(text: str) -> Target:
    """The cluster of a text: ``tcp://HOST:PORT``, ``tls://HOST:PORT`` or ``local:N``.

    Raises
    ------
    UsageError
        If the text has neither form, or N is not 1 to 1024.
    """
    local = re.fullmatch(r"local:(\d{1,6})", text.strip())
    if local is not None:
        count = int(local[1])
        if not 1 <= count <= _MOST_LOCAL:
            raise UsageError(f"{count} workers", parameter="cluster", rule=f"1 to {_MOST_LOCAL} can be started here")
        return Target(local=count)
    return Target(address=checked_address(text.strip(), "cluster", _RULE))


def checked_address(text: str, parameter: str, rule: str) -> str:
    """``text`` itself, once it is known to be a scheduler's address with host and port.

    Parameters
    ----------
    text:
        The address.
    parameter, rule:
        Name of the parameter and rule, for the error message.

    Raises
    ------
    UsageError
        If the text is no such address.
    """
    try:
        parts = urlsplit(text)
        fits = parts.scheme in ("tcp", "tls", "ucx", "ws", "wss") and bool(parts.hostname) and parts.port is not None
    except ValueError:
        fits = False
    if not fits:
        raise UsageError(f"'{text}' is no address", parameter=parameter, rule=rule)
    return text


def is_on_this_machine(address: str) -> bool:
    """Whether a scheduler's address is a loopback address, reachable from this machine only."""
    return is_loopback(urlsplit(address).hostname or "")


def import_distributed() -> ModuleType:
    """Import the package ``distributed``, which is part of the extra ``cluster``.

    Raises
    ------
    ClusterError
        If it is not installed.
    """
    try:
        return import_module("distributed")
    except ImportError as error:
        raise ClusterError(f"Dask cannot be loaded ({error})", fix="pip install 'lippmann[cluster]'") from None
