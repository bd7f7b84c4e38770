"""Tiles rendered by the workers of a cluster: as many under way as keep them busy, results taken in as they come."""

from __future__ import annotations

import queue
import warnings
from collections import Counter, deque
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from secrets import token_hex
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from lippmann.cluster.connection import Cluster
from lippmann.cluster.job_pickle import Parcel, pack
from lippmann.cluster.tasks import render_part
from lippmann.errors import ClusterError
from lippmann.journal.tile_file import DamagedTile, decode

if TYPE_CHECKING:
    from lippmann.rendering.request.choices import Device
    from lippmann.tiles.job import TileJob
    from lippmann.tiles.tile_render import Prepared
    from lippmann.tiles.tiled_render import Put, Runner

#: Tiles under way for each thread of the workers: one being rendered, one waiting for its turn.
TILES_PER_THREAD = 2
#: A tile that has failed so often is given up.
MOST_FAILURES = 3
#: And one under which all workers have died so often, whatever Dask itself counts.
MOST_DEATHS = 5
#: So many tiles given up before any was rendered: there is no sense in trying the rest.
HOPELESS = 8
#: Tiles whose bytes may be on their way here at once.
FETCHERS = 32
#: Seconds between two looks at workers and scheduler while no tile comes.
PATIENCE = 0.5

_DIED = "its workers died"


def runner_on(cluster: Cluster) -> Runner:
    """A runner of :func:`lippmann.tiles.tiled_render.render_to_file` that renders on a cluster."""
    return lambda prepared, missing, put: run_on(cluster, _sent(prepared), missing, put)


def run_on(cluster: Cluster, job: TileJob, missing: Sequence[int], put: Put) -> None:
    """Render the tiles ``missing`` of a job; ``put`` is called with each as it comes, in any order.

    No more tiles are under way than keep the workers busy, and none is asked for while ``put`` is at work, so that
    memory here and there stays bounded.

    Raises
    ------
    ClusterError
        The scheduler is lost; all workers are of another version; or tiles failed :data:`MOST_FAILURES` times, after
        all others were rendered.
    """
    run = _Run(cluster, job, put, deque(missing), len(missing))
    try:
        run.finish()
    finally:
        run.cancel()


def _sent(prepared: Prepared) -> TileJob:
    """The job as workers get it: on the device that was chosen here, with threads and memory of their own."""
    job = prepared.job
    device: Device = "gpu" if prepared.session.engine.gpu_name else "cpu"
    return replace(job, request=replace(job.request, device=device, threads=None, memory=None))


@dataclass(eq=False)
class _Tile:
    """One tile under way: its number, Dask's future, who may render it, and its bytes on their way here."""

    index: int
    future: Any
    workers: frozenset[str]
    fetch: Future[bytes] | None = None


@dataclass(eq=False)
class _Run:
    cluster: Cluster
    job: TileJob
    put: Put
    waiting: deque[int]
    total: int
    under_way: dict[str, _Tile] = field(default_factory=dict)
    failures: Counter[int] = field(default_factory=Counter)
    deaths: Counter[int] = field(default_factory=Counter)
    given_up: dict[int, str] = field(default_factory=dict)
    done: int = 0
    parts: tuple[Any, ...] = ()
    news: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)
    mark: str = field(default_factory=lambda: token_hex(4))
    alone: bool = False
    # In threads of their own: bytes that lie with a worker that stands still must not hold up the others.
    fetchers: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(FETCHERS, "lippmann-fetch"))

    def finish(self) -> None:
        """Until every tile is rendered or given up."""
        parcel = pack(self.job)
        self._send(parcel)
        while self.waiting or self.under_way:
            self._fill(parcel)
            try:
                key = self.news.get(timeout=PATIENCE)
            except queue.Empty:
                self._look_round()
                continue
            if key in self.under_way:
                self._take(key)
        if self.given_up:
            raise self._failure()

    def cancel(self) -> None:
        """Leave nothing behind on the cluster."""
        futures = [tile.future for tile in self.under_way.values()]
        self.under_way.clear()
        if futures and self.cluster.client.status == "running":
            self.cluster.client.cancel(futures, force=True)
        self.parts = ()
        self.fetchers.shutdown(wait=False, cancel_futures=True)

    def _send(self, parcel: Parcel) -> None:
        """Give the parts to the scheduler as tasks that return them: what dies with its worker is made anew.

        Parts of the last job that this one needs, too, stay where they are.
        """
        wanted = {parcel.key: parcel.outline, **{name: parcel.parts[name] for name in parcel.names}}
        there = {name: part for name, part in self.cluster.parts.items() if part.status in ("pending", "finished")}
        sent = {name: there[name] if name in there else self._sent(name, array) for name, array in wanted.items()}
        self.cluster.parts.clear()
        self.cluster.parts.update(sent)
        self.parts = tuple(sent.values())

    def _sent(self, name: str, array: NDArray[Any]) -> Any:
        from toolz import identity

        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            # A function of Dask's own needs: workers of any kind may keep a part.
            return self.cluster.client.submit(identity, array, key=f"scene-{name}", pure=False)

    def _fill(self, parcel: Parcel) -> None:
        fit = self.cluster.roster.fit
        for line in self.cluster.roster.news():
            self.cluster.remark(line)
        if not fit and self.cluster.roster.refused and not self.under_way and not self.done:
            raise ClusterError("; ".join(self.cluster.roster.refused), fix="install the same version on all machines")
        if self.alone != (not fit):
            self.alone = not fit
            now = "no workers: waiting for some" if self.alone else "workers again"
            self.cluster.remark(f"{self.cluster.name} has {now}")
        room = TILES_PER_THREAD * sum(fit.values()) - len(self.under_way)
        while room > 0 and self.waiting and self._may_start(self.waiting[0]):
            self._start(self.waiting.popleft(), parcel, frozenset(fit))
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
            # By name: Dask would give tiles to workers that are refused, too.
            workers=sorted(workers),
        )
        self.under_way[key] = _Tile(index, future, workers)
        future.add_done_callback(lambda _: self.news.put(key))

    def _may_start(self, index: int) -> bool:
        """A tile under suspicion is tried again alone, so that others are not taken down with it, nor blamed for it."""
        return not self.under_way or not any(
            self.failures[one] or self.deaths[one] > 1 for one in (index, *(t.index for t in self.under_way.values()))
        )

    def _take(self, key: str) -> None:
        """What the news of a tile comes to: it is rendered, it is here, or it failed."""
        tile = self.under_way[key]
        if tile.fetch is not None:
            if tile.fetch.done():
                self._keep(key, tile.fetch)
        elif tile.future.status == "finished":
            tile.fetch = self.fetchers.submit(tile.future.result)
            tile.fetch.add_done_callback(lambda _: self.news.put(key))
        elif tile.future.status == "error":
            del self.under_way[key]
            self._note_failure(tile.index, tile.future.exception())
        else:
            raise self._lost()

    def _keep(self, key: str, fetch: Future[bytes]) -> None:
        try:
            result = decode(fetch.result())
        except (OSError, KeyError, CancelledError, DamagedTile):
            # It died with its worker on the way here.
            if self.cluster.client.status != "running":
                raise self._lost() from None
            self._ask_again(key)
            return
        del self.under_way[key]
        self.put(result)
        self.done += 1

    def _note_failure(self, index: int, error: BaseException) -> None:
        # Dask gives a tile up when several workers have died of it.
        self.failures[index] += 2 if type(error).__name__ == "KilledWorker" else 1
        if self.failures[index] < MOST_FAILURES:
            self.waiting.append(index)
        else:
            self._give_up(index, _in_words(error))

    def _give_up(self, index: int, why: str) -> None:
        self.given_up[index] = why
        self.cluster.remark(f"tile {self.job.grid.name(index)} is given up: {why}")
        if self.done == 0 and len(self.given_up) >= HOPELESS:
            raise self._failure()

    def _look_round(self) -> None:
        """What no message tells: a scheduler that is gone, tiles that wait for workers which will not come back."""
        if self.cluster.client.status != "running":
            raise self._lost()
        present = frozenset(self.cluster.roster.fit)
        for key, tile in list(self.under_way.items()):
            if present and not tile.workers & present:
                self.deaths[tile.index] += 1
                self._ask_again(key)

    def _ask_again(self, key: str) -> None:
        tile = self.under_way.pop(key)
        self.cluster.client.cancel([tile.future], force=True)
        if self.deaths[tile.index] < MOST_DEATHS:
            self.waiting.appendleft(tile.index)
        else:
            self._give_up(tile.index, _DIED)

    def _lost(self) -> ClusterError:
        return ClusterError(
            f"the connection to the scheduler of {self.cluster.name} is lost",
            where="--cluster",
            fix="run again with --resume: what was rendered is kept",
        )

    def _failure(self) -> ClusterError:
        names = [f"{self.job.grid.name(index)} ({why})" for index, why in sorted(self.given_up.items())]
        more = f" and {len(names) - 4} more" if len(names) > 4 else ""
        return ClusterError(
            f"{len(names)} of {self.total} tiles failed again and again: {', '.join(names[:4])}{more}",
            fix="run again with --resume: the other tiles are kept",
        )


def _in_words(error: BaseException) -> str:
    if type(error).__name__ == "KilledWorker":
        return _DIED
    what = str(error) if isinstance(error, ClusterError) else f"{type(error).__name__}: {error}"
    return " ".join(what.split())[:300]
