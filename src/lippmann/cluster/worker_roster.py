"""Which workers of a cluster may take part."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any

from lippmann.cluster.tasks import make_introduction, own_versions

#: Seconds between two looks at who is there.
INTERVAL = 0.5


class Roster:
    """Watches the workers that come and go; those of other versions are refused, by name.

    Parameters
    ----------
    client:
        A connected ``distributed.Client``.
    """

    def __init__(self, client: Any) -> None:
        self._client = client
        self._versions = own_versions()
        self._lock = threading.Lock()
        self._fit: dict[str, int] = {}
        self._refused: dict[str, str] = {}
        self._unsaid: list[str] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="lippmann-roster", daemon=True)
        self.look()
        self._thread.start()

    @property
    def fit(self) -> Mapping[str, int]:
        """Addresses of the workers that may take part, with their threads."""
        with self._lock:
            return dict(self._fit)

    @property
    def refused(self) -> tuple[str, ...]:
        """Why workers that are there now may not, one line each."""
        with self._lock:
            return tuple(self._refused.values())

    def news(self) -> tuple[str, ...]:
        """Refusals that have not been told yet."""
        with self._lock:
            said, self._unsaid = tuple(self._unsaid), []
            return said

    def close(self) -> None:
        """Stop watching."""
        self._stop.set()
        self._thread.join(timeout=10 * INTERVAL)

    def look(self) -> None:
        """See who is there now."""
        present = self._client.nthreads()
        known = {*self._fit, *self._refused}
        answers = {address: self._ask(address) for address in present if address not in known}
        with self._lock:
            self._fit = {address: count for address, count in self._fit.items() if address in present}
            self._refused = {address: why for address, why in self._refused.items() if address in present}
            for address, found in answers.items():
                if found is None:  # gone before it answered, or too busy: asked again
                    continue
                if found == self._versions:
                    self._fit[address] = present[address]
                else:
                    why = f"the worker at {address} is refused: {self._difference(found)}"
                    self._refused[address] = why
                    self._unsaid.append(why)

    def _ask(self, address: str) -> dict[str, str] | None:
        answer = self._client.run(make_introduction(), workers=[address], on_error="return").get(address)
        return answer if isinstance(answer, dict) else None

    def _difference(self, found: Mapping[str, str]) -> str:
        parts = (
            f"it has {name} {found.get(name, 'none')}, here is {own}"
            for name, own in self._versions.items()
            if found.get(name) != own
        )
        return "; ".join(parts)

    def _watch(self) -> None:
        while not self._stop.wait(INTERVAL):
            try:
                self.look()
            except Exception:  # noqa: BLE001 - a scheduler that is gone is noticed by those who wait for tiles
                continue
