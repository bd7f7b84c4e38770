"""Rendering of tiles on a cluster: enough tiles in flight to keep the workers busy, results stored as they arrive."""

from __future__ import annotations

import queue
import warnings
from collections import Counter, deque
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from secrets import token_hex
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.cluster.connection import Cluster
from lippmann.cluster.job_pickle import Parcel, pack
from lippmann.cluster.tasks import render_part
from lippmann.errors import ClusterError
from lippmann.journal.tile_file import DamagedTile, decode

if TYPE_CHECKING:
    from distributed import Future as DaskFuture

    from lippmann.options.choices import Device
    from lippmann.tiles.job import TileJob
    from lippmann.tiles.tile_render import Prepared
    from lippmann.tiles.tiled_render import Put, Runner

#: Tiles in flight per thread of the workers: one rendering, one waiting.
TILES_PER_THREAD = 2
#: Number of failures after which a tile is given up.
MOST_FAILURES = 3
#: Number of times that all workers of a tile died after which it is given up, beside Dask's own limit.
MOST_DEATHS = 5
#: Number of tiles given up before any succeeded after which the whole render fails.
HOPELESS = 8
#: Number of concurrent transfers of results.
FETCHERS = 32
#: Time in seconds between two checks of workers and scheduler while no tile arrives.
PATIENCE = 0.5
#: Time in seconds without an answer after which a scheduler counts as lost: it needs milliseconds, under load a few s.
SILENCE = 30.0

_DIED = "its workers died"


def runner_on(cluster: Cluster) -> Runner:
    """A runner for :func:`lippmann.tiles.tiled_render.render_to_file` that renders on a cluster."""
    return lambda prepared, missing, put: run_on(cluster, _worker_job(prepared), missing, put)


def run_on(cluster: Cluster, job: TileJob, missing: Sequence[int], put: Put) -> None:
    """Render tiles of a job on a cluster.

    The number of tiles in flight is limited, and no tile is submitted while ``put`` runs, so that memory of client and
    workers is bounded.

    Parameters
    ----------
    cluster:
        The connected cluster.
    job:
        The picture in tiles.
    missing:
        Numbers of the tiles to render.
    put:
        Called with each result as it arrives, in any order.

    Raises
    ------
    ClusterError
        If the scheduler is lost, all workers have other versions, or, after all other tiles, a tile failed
        :data:`MOST_FAILURES` times.
    """
    run = _Run(cluster, job, put, deque(missing), len(missing))
    try:
        run.finish()
    finally:
        run.cancel()


def _worker_job(prepared: Prepared) -> TileJob:
    """The job for workers: on the device of this process, with their own threads and memory."""
    job = prepared.job
    device: Device = "gpu" if prepared.session.engine.gpu_name else "cpu"
    return replace(job, request=replace(job.request, device=device, threads=None, memory=None))


@dataclass(eq=False)
class _Tile:
    """One tile in flight: its number, Dask's future, the workers that may render it, and the transfer of its result."""

    index: int
    future: DaskFuture
    workers: frozenset[str]
    fetch: Future[bytes] | None = None


@dataclass(eq=False)
class _Run:
    cluster: Cluster
    job: TileJob
    put: Put
    waiting: deque[int]
    total: int
    in_flight: dict[str, _Tile] = field(default_factory=dict)
    failures: Counter[int] = field(default_factory=Counter)
    deaths: Counter[int] = field(default_factory=Counter)
    given_up: dict[int, str] = field(default_factory=dict)
    done: int = 0
    parts: tuple[Any, ...] = ()
    news: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)
    mark: str = field(default_factory=lambda: token_hex(4))
    alone: bool = False
    # Transfers have threads of their own, so that a worker that hangs does not delay the others.
    fetchers: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(FETCHERS, "lippmann-fetch"))

    def finish(self) -> None:
        """Render until every tile is done or given up; raise :class:`ClusterError` for those given up."""
        parcel = pack(self.job)
        self._send(parcel)
        while self.waiting or self.in_flight:
            self._fill(parcel)
            try:
                key = self.news.get(timeout=PATIENCE)
            except queue.Empty:
                self._check_workers()
                continue
            if key in self.in_flight:
                self._take(key)
        if self.given_up:
            raise self._failure()

    def cancel(self) -> None:
        """Cancel all tasks on the cluster and release its data."""
        futures = [tile.future for tile in self.in_flight.values()]
        self.in_flight.clear()
        if futures and self.cluster.client.status == "running":
            self.cluster.client.cancel(futures, force=True)
        self.parts = ()
        self.fetchers.shutdown(wait=False, cancel_futures=True)

    def _send(self, parcel: Parcel) -> None:
        """Submit the parts as tasks that return them, so that Dask restores a part that is lost with its worker.

        Parts that the previous job had too stay on the cluster.
        """
        arrays = {parcel.key: parcel.outline, **{name: parcel.parts[name] for name in parcel.names}}
        present = {name: part for name, part in self.cluster.parts.items() if part.status in ("pending", "finished")}
        futures = {
            name: present[name] if name in present else self._submit_part(name, array) for name, array in arrays.items()
        }
        self.cluster.parts.clear()
        self.cluster.parts.update(futures)
        self.parts = tuple(futures.values())

    def _submit_part(self, name: str, array: NDArray[np.generic]) -> DaskFuture:
        from toolz import identity

        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            # A function of a package that Dask needs anyway: every worker can hold a part.
            return self.cluster.client.submit(identity, array, key=f"scene-{name}", pure=False)

    def _fill(self, parcel: Parcel) -> None:
        admitted = self.cluster.roster.admitted
        for line in self.cluster.roster.news():
            self.cluster.remark(line)
        if not admitted and self.cluster.roster.refused and not self.in_flight and not self.done:
            raise ClusterError("; ".join(self.cluster.roster.refused), fix="install the same version on all machines")
        if self.alone != (not admitted):
            self.alone = not admitted
            now = "no workers: waiting for some" if self.alone else "workers again"
            self.cluster.remark(f"{self.cluster.name} has {now}")
        room = TILES_PER_THREAD * sum(admitted.values()) - len(self.in_flight)
        while room > 0 and self.waiting and self._may_start(self.waiting[0]):
            self._start(self.waiting.popleft(), parcel, frozenset(admitted))
            room -= 1

    def _start(self, index: int, parcel: Parcel, workers: frozenset[str]) -> None:
        outline, *parts = self.parts
        key = f"tile-{self.job.grid.name(index)}-{self.mark}-{self.failures[index]}-{token_hex(2)}"
        future = self.cluster.client.submit(
            render_part,
            parcel.key,
            index,
            outline,
            parcel.names,
            parts,
            key=key,
            pure=False,
            # By name: otherwise Dask would give tiles to refused workers as well.
            workers=sorted(workers),
        )
        self.in_flight[key] = _Tile(index, future, workers)
        future.add_done_callback(lambda _: self.news.put(key))

    def _may_start(self, index: int) -> bool:
        """Whether a tile may start: one that failed before runs alone, so that it cannot harm other tiles."""
        return not self.in_flight or not any(
            self.failures[one] or self.deaths[one] > 1 for one in (index, *(t.index for t in self.in_flight.values()))
        )

    def _take(self, key: str) -> None:
        """Handle a change of a tile: rendered, transferred, or failed."""
        tile = self.in_flight[key]
        if tile.fetch is not None:
            if tile.fetch.done():
                self._keep(key, tile.fetch)
        elif tile.future.status == "finished":
            tile.fetch = self.fetchers.submit(tile.future.result)
            tile.fetch.add_done_callback(lambda _: self.news.put(key))
        elif tile.future.status == "error":
            del self.in_flight[key]
            self._note_failure(tile.index, tile.future.exception())
        else:
            raise self._lost()

    def _keep(self, key: str, fetch: Future[bytes]) -> None:
        try:
            result = decode(fetch.result())
        except (OSError, KeyError, CancelledError, DamagedTile):
            # The result was lost with its worker during the transfer.
            if self.cluster.client.status != "running":
                raise self._lost() from None
            self._ask_again(key)
            return
        del self.in_flight[key]
        self.put(result)
        self.done += 1

    def _note_failure(self, index: int, error: BaseException) -> None:
        # Dask gives a tile up when several workers have died of it.
        self.failures[index] += 2 if type(error).__name__ == "KilledWorker" else 1
        if self.failures[index] < MOST_FAILURES:
            self.waiting.append(index)
        else:
            self._give_up(index, _error_text(error))

    def _give_up(self, index: int, why: str) -> None:
        self.given_up[index] = why
        self.cluster.remark(f"tile {self.job.grid.name(index)} is given up: {why}")
        if self.done == 0 and len(self.given_up) >= HOPELESS:
            raise self._failure()

    def _check_workers(self) -> None:
        """Detect what no message reports: a lost scheduler, and tiles that wait for workers which are gone."""
        if self.cluster.client.status != "running":
            raise self._lost()
        if self.cluster.roster.silent_seconds > SILENCE:
            raise ClusterError(
                f"the scheduler of {self.cluster.name} has not answered for {SILENCE:.0f} s",
                parameter="cluster",
                fix="does it still run? Run again with resume=True: what was rendered is kept",
            )
        present = frozenset(self.cluster.roster.admitted)
        for key, tile in list(self.in_flight.items()):
            if present and not tile.workers & present:
                self.deaths[tile.index] += 1
                self._ask_again(key)

    def _ask_again(self, key: str) -> None:
        tile = self.in_flight.pop(key)
        self.cluster.client.cancel([tile.future], force=True)
        if self.deaths[tile.index] < MOST_DEATHS:
            self.waiting.appendleft(tile.index)
        else:
            self._give_up(tile.index, _DIED)

    def _lost(self) -> ClusterError:
        return ClusterError(
            f"the connection to the scheduler of {self.cluster.name} is lost",
            parameter="cluster",
            fix="run again with resume=True: what was rendered is kept",
        )

    def _failure(self) -> ClusterError:
        names = [f"{self.job.grid.name(index)} ({why})" for index, why in sorted(self.given_up.items())]
        more = f" and {len(names) - 4} more" if len(names) > 4 else ""
        return ClusterError(
            f"{len(names)} of {self.total} tiles failed again and again: {', '.join(names[:4])}{more}",
            fix="run again with resume=True: the other tiles are kept",
        )


def _error_text(error: BaseException) -> str:
    if type(error).__name__ == "KilledWorker":
        return _DIED
    what = str(error) if isinstance(error, ClusterError) else f"{type(error).__name__}: {error}"
    return " ".join(what.split())[:300]
