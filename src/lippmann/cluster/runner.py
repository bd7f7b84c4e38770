"""Rendering on a cluster: enough tiles or frames in flight to keep the workers busy, results stored as they arrive."""

from __future__ import annotations

import queue
import warnings
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import chain
from secrets import token_hex
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.cluster.connection import Cluster
from lippmann.cluster.job_pickle import pack
from lippmann.cluster.tasks import FrameJob, Job, PictureJob, render_part
from lippmann.errors import ClusterError, UsageError
from lippmann.journal.tile_file import DamagedTile, TileResult, decode

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
    _TileRun(cluster, put, len(missing), iter([(PictureJob(job), missing)])).run()


def frame_runner_on(cluster: Cluster) -> Callable[[Iterator[FrameJob], int, Callable[[Any], None]], None]:
    """A runner for :func:`lippmann.sequences.files.save_sequence` that renders on a cluster."""
    return lambda jobs, total, put: _FrameRun(cluster, put, total, ((job, job.frames) for job in jobs)).run()


def _worker_job(prepared: Prepared) -> TileJob:
    """The job for workers: on the device of this process, with their own threads and memory."""
    job = prepared.job
    device: Device = "gpu" if prepared.session.engine.gpu_name else "cpu"
    return replace(job, request=replace(job.request, device=device, threads=None, memory=None))


@dataclass(eq=False)
class _Lot:
    """Parts of one job: its futures on the cluster by content hash, the outline first, and the numbers that wait.

    ``worker``: the address of the one that renders them; None for any.
    """

    job: Job
    data: Mapping[str, DaskFuture]
    waiting: deque[int]
    worker: str | None


@dataclass(eq=False)
class _Part:
    """One part in flight: its number, Dask's future, the workers that may render it, and the transfer of its result."""

    index: int
    lot: _Lot
    future: DaskFuture
    workers: frozenset[str]
    fetch: Future[Any] | None = None


@dataclass(eq=False)
class _Run(ABC):
    """Renders the parts with these numbers of ``jobs``, ``total`` in all; ``put`` is called with each result."""

    noun: ClassVar[str]

    cluster: Cluster
    put: Callable[[Any], None]
    total: int
    jobs: Iterator[tuple[Job, Sequence[int]]]
    lots: list[_Lot] = field(default_factory=list)
    in_flight: dict[str, _Part] = field(default_factory=dict)
    failures: Counter[int] = field(default_factory=Counter)
    deaths: Counter[int] = field(default_factory=Counter)
    given_up: dict[int, str] = field(default_factory=dict)
    done: int = 0
    news: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)
    mark: str = field(default_factory=lambda: token_hex(4))
    alone: bool = False
    # Transfers have threads of their own, so that a worker that hangs does not delay the others.
    fetchers: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(FETCHERS, "lippmann-fetch"))

    def run(self) -> None:
        """Render until every part is done or given up; raise :class:`ClusterError` for those given up."""
        try:
            self._finish()
        finally:
            self._cancel()

    def _finish(self) -> None:
        while self.done + len(self.given_up) < self.total:
            self._fill()
            try:
                key = self.news.get(timeout=PATIENCE)
            except queue.Empty:
                self._check_workers()
                continue
            if key in self.in_flight:
                self._take(key)
        if self.given_up:
            raise self._failure()

    def _cancel(self) -> None:
        """Cancel all tasks on the cluster and release its data."""
        futures = [part.future for part in self.in_flight.values()]
        self.in_flight.clear()
        if futures and self.cluster.client.status == "running":
            self.cluster.client.cancel(futures, force=True)
        self.lots.clear()
        self.fetchers.shutdown(wait=False, cancel_futures=True)

    @abstractmethod
    def _start_parts(self, admitted: Mapping[str, int]) -> None:
        """Start as many parts as suit the workers, whose threads are given by address."""

    def _send(self, job: Job, waiting: Sequence[int], worker: str | None = None) -> _Lot:
        """Submit a job's data as tasks that return them, so that Dask restores what is lost with its worker.

        Data of jobs under way, and of the last one, stay on the cluster.
        """
        parcel = pack(job)
        arrays = {parcel.key: parcel.outline, **{name: parcel.parts[name] for name in parcel.names}}
        known = self.cluster.parts
        present = {name: part for name, part in known.items() if part.status in ("pending", "finished")}
        futures = {
            name: present[name] if name in present else self._submit_data(name, array) for name, array in arrays.items()
        }
        known.clear()
        known.update(chain.from_iterable(data.items() for data in (*(lot.data for lot in self.lots), futures)))
        self.lots.append(_Lot(job, futures, deque(waiting), worker))
        return self.lots[-1]

    def _submit_data(self, name: str, array: NDArray[np.generic]) -> DaskFuture:
        from toolz import identity

        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            # A function of a package that Dask needs anyway: every worker can hold a part.
            return self.cluster.client.submit(identity, array, key=f"scene-{name}", pure=False)

    def _fill(self) -> None:
        admitted = self.cluster.roster.admitted
        for line in self.cluster.roster.news():
            self.cluster.remark(line)
        if not admitted and self.cluster.roster.refused and not self.in_flight and not self.done:
            raise ClusterError("; ".join(self.cluster.roster.refused), fix="install the same version on all machines")
        if self.alone != (not admitted):
            self.alone = not admitted
            now = "no workers: waiting for some" if self.alone else "workers again"
            self.cluster.remark(f"{self.cluster.name} has {now}")
        self._start_parts(admitted)

    def _may_start(self, lot: _Lot) -> bool:
        """Whether a lot's next part may start: one that failed before runs alone, so that it cannot harm others."""
        if not self.in_flight or not lot.waiting:
            return bool(lot.waiting)
        indices = (lot.waiting[0], *(part.index for part in self.in_flight.values()))
        return not any(self.failures[index] or self.deaths[index] > 1 for index in indices)

    def _start(self, lot: _Lot, workers: frozenset[str]) -> None:
        index = lot.waiting.popleft()
        (name, outline), *data = lot.data.items()
        key = f"{self.noun}-{lot.job.name(index)}-{self.mark}-{self.failures[index]}-{token_hex(2)}"
        future = self.cluster.client.submit(
            render_part,
            name,
            index,
            outline,
            [name for name, _ in data],
            [array for _, array in data],
            key=key,
            pure=False,
            # By name: otherwise Dask would give parts to refused workers as well.
            workers=sorted(workers),
        )
        self.in_flight[key] = _Part(index, lot, future, workers)
        future.add_done_callback(lambda _: self.news.put(key))

    def _take(self, key: str) -> None:
        """Handle a change of a part: rendered, transferred, or failed."""
        part = self.in_flight[key]
        if part.fetch is not None:
            if part.fetch.done():
                self._keep(key, part.fetch)
        elif part.future.status == "finished":
            part.fetch = self.fetchers.submit(self._receive, part.future)
            part.fetch.add_done_callback(lambda _: self.news.put(key))
        elif part.future.status == "error":
            del self.in_flight[key]
            error = part.future.exception()
            if isinstance(error, UsageError):
                raise error  # the same on all workers
            self._note_failure(part, error)
        else:
            raise self._lost()

    def _keep(self, key: str, fetch: Future[Any]) -> None:
        try:
            result = fetch.result()
        except (OSError, KeyError, CancelledError, DamagedTile):
            # The result was lost with its worker during the transfer.
            if self.cluster.client.status != "running":
                raise self._lost() from None
            self._ask_again(key)
            return
        del self.in_flight[key]
        self.put(result)
        self.done += 1

    def _receive(self, future: DaskFuture) -> Any:
        return future.result()

    def _note_failure(self, part: _Part, error: BaseException) -> None:
        # Dask gives a task up when several workers have died of it.
        self.failures[part.index] += 2 if type(error).__name__ == "KilledWorker" else 1
        if self.failures[part.index] < MOST_FAILURES:
            self._put_back(part).append(part.index)
        else:
            self._give_up(part, _error_text(error))

    def _put_back(self, part: _Part) -> deque[int]:
        """Numbers that wait in the part's lot, which may have been at its end."""
        if part.lot not in self.lots:
            self.lots.append(part.lot)
        return part.lot.waiting

    def _give_up(self, part: _Part, why: str) -> None:
        name = part.lot.job.name(part.index)
        self.given_up[part.index] = f"{name} ({why})"
        self.cluster.remark(f"{self.noun} {name} is given up: {why}")
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
        for key, part in list(self.in_flight.items()):
            if present and not part.workers & present:
                self.deaths[part.index] += 1
                self._ask_again(key)

    def _ask_again(self, key: str) -> None:
        part = self.in_flight.pop(key)
        self.cluster.client.cancel([part.future], force=True)
        if self.deaths[part.index] < MOST_DEATHS:
            self._put_back(part).appendleft(part.index)
        else:
            self._give_up(part, _DIED)

    def _lost(self) -> ClusterError:
        return ClusterError(
            f"the connection to the scheduler of {self.cluster.name} is lost",
            parameter="cluster",
            fix="run again with resume=True: what was rendered is kept",
        )

    def _failure(self) -> ClusterError:
        names = [name for _, name in sorted(self.given_up.items())]
        more = f" and {len(names) - 4} more" if len(names) > 4 else ""
        return ClusterError(
            f"{len(names)} of {self.total} {self.noun}s failed again and again: {', '.join(names[:4])}{more}",
            fix=f"run again with resume=True: the other {self.noun}s are kept",
        )


class _TileRun(_Run):
    noun = "tile"

    def _start_parts(self, admitted: Mapping[str, int]) -> None:
        if not self.lots:
            self._send(*next(self.jobs))
        (lot,) = self.lots
        room = TILES_PER_THREAD * sum(admitted.values()) - len(self.in_flight)
        while room > 0 and self._may_start(lot):
            self._start(lot, frozenset(admitted))
            room -= 1

    def _receive(self, future: DaskFuture) -> TileResult:
        return decode(future.result())


class _FrameRun(_Run):
    """Each worker renders the frames of one lot in their order, so that it has rendered what the next one follows."""

    noun = "frame"

    def _start_parts(self, admitted: Mapping[str, int]) -> None:
        for worker in admitted:
            own = [part for part in self.in_flight.values() if worker in part.workers]
            # The next one begins while the last one is on its way here.
            if len(own) < TILES_PER_THREAD and all(part.fetch is not None for part in own):
                lot = self._choose_lot(worker, admitted)
                if lot is not None and self._may_start(lot):
                    self._start(lot, frozenset([worker]))

    def _choose_lot(self, worker: str, admitted: Mapping[str, int]) -> _Lot | None:
        """A worker's own lot, one whose worker is gone, the next one, or a part of the longest; None: nothing to do."""
        self.lots = [lot for lot in self.lots if lot.waiting]
        for lot in sorted(self.lots, key=lambda lot: lot.worker != worker):
            if lot.worker == worker or lot.worker not in admitted:
                lot.worker = worker
                return lot
        job = next(self.jobs, None)
        return self._split_longest(worker) if job is None else self._send(*job, worker)

    def _split_longest(self, worker: str) -> _Lot | None:
        """The latter frames of the longest lot, where they end sooner though what they follow is rendered anew."""
        longest = max(self.lots, key=lambda lot: len(lot.waiting), default=None)
        if longest is None:
            return None
        frames, count = list(longest.waiting), len(longest.waiting)
        before = cast("FrameJob", longest.job).count_before
        times = {first: max(first, before(frames[first]) + count - first) for first in range(1, count)}
        first = min(times, key=times.__getitem__, default=count)
        if times.get(first, count) >= count:
            return None
        longest.waiting = deque(frames[:first])
        self.lots.append(_Lot(longest.job, longest.data, deque(frames[first:]), worker))
        return self.lots[-1]


def _error_text(error: BaseException) -> str:
    if type(error).__name__ == "KilledWorker":
        return _DIED
    what = str(error) if isinstance(error, ClusterError) else f"{type(error).__name__}: {error}"
    return " ".join(what.split())[:300]
