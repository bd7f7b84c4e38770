"""The workers of a cluster that take part in rendering: those with the client's versions."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

from lippmann.cluster.tasks import make_version_query, own_versions

if TYPE_CHECKING:
    from distributed import Client

#: Time in seconds between two updates of the list of workers.
INTERVAL = 0.5
#: Time in seconds for a worker to tell its versions, by way of the scheduler, before it is asked again.
ANSWER = 10.0


class Roster:
    """List of a cluster's workers, updated by a thread of its own; workers with other versions are refused.

    Parameters
    ----------
    client:
        A connected client.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._versions = own_versions()
        self._lock = threading.Lock()
        self._admitted: dict[str, int] = {}
        self._refused: dict[str, str] = {}
        self._unreported: list[str] = []
        self._asked: float | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="lippmann-roster", daemon=True)
        self.update()
        self._thread.start()

    @property
    def admitted(self) -> Mapping[str, int]:
        """Number of threads of the workers that take part, by address."""
        with self._lock:
            return dict(self._admitted)

    @property
    def refused(self) -> tuple[str, ...]:
        """One line for each present worker that is refused, with the reason."""
        with self._lock:
            return tuple(self._refused.values())

    def news(self) -> tuple[str, ...]:
        """Lines of refusals since the last call."""
        with self._lock:
            lines, self._unreported = tuple(self._unreported), []
            return lines

    @property
    def silent_seconds(self) -> float:
        """Seconds for which the scheduler has owed an answer."""
        asked = self._asked
        return 0.0 if asked is None else time.monotonic() - asked

    def close(self) -> None:
        """Stop the thread that updates the list."""
        self._stop.set()
        self._thread.join(timeout=2 * INTERVAL)

    def update(self) -> None:
        """Update the list, and ask new workers for their versions."""
        self._asked = time.monotonic()
        present = self._client.nthreads()
        self._asked = None  # workers are asked below: they may be slow
        known = {*self._admitted, *self._refused}
        answers = {address: self._ask(address) for address in present if address not in known}
        with self._lock:
            self._admitted = {address: count for address, count in self._admitted.items() if address in present}
            self._refused = {address: why for address, why in self._refused.items() if address in present}
            for address, versions in answers.items():
                if versions is None:  # gone before it answered, or too busy: asked again
                    continue
                if versions == self._versions:
                    self._admitted[address] = present[address]
                else:
                    why = f"the worker at {address} is refused: {self._difference(versions)}"
                    self._refused[address] = why
                    self._unreported.append(why)

    def _ask(self, address: str) -> dict[str, str] | None:
        ask, query = self._client.sync, make_version_query()
        try:
            answers = ask(self._client._run, query, workers=[address], on_error="return", callback_timeout=ANSWER)
        except TimeoutError:
            return None
        answer = answers.get(address)
        return answer if isinstance(answer, dict) else None

    def _difference(self, versions: Mapping[str, str]) -> str:
        parts = (
            f"it has {name} {versions.get(name, 'none')}, the client has {own}"
            for name, own in self._versions.items()
            if versions.get(name) != own
        )
        return "; ".join(parts)

    def _watch(self) -> None:
        while not self._stop.wait(INTERVAL):
            try:
                self.update()
            except Exception:  # noqa: BLE001 - a lost scheduler is reported by the code that waits for tiles
                continue
