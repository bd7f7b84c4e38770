"""A picture rendered tile by tile into a file, in memory that does not grow with it, and resumable."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from lippmann.calibration.finish import NO_FINISH, Finish
from lippmann.codecs import tiff, zarr_array
from lippmann.codecs.types import Pixels
from lippmann.display import Display
from lippmann.display.panel import TileGrid
from lippmann.errors import EngineError
from lippmann.image import IntegralImage
from lippmann.image.encoding import (
    FormatName,
    encode_tiles,
    encode_values,
    is_mirrored,
    is_tiled,
    linear_values,
    profile_in_file,
)
from lippmann.image.metadata import Metadata, Provenance, to_text
from lippmann.image.stored_values import FloatArray, Layer, Values
from lippmann.image.write import can_be_banded, check_output, format_for, replacing_output, write_rows
from lippmann.journal.tile_file import DamagedTile, TileResult
from lippmann.journal.tile_journal import TileStore, read_job, sweep_beside
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.denoise import oidn
from lippmann.rendering.estimate.denoised_psnr import estimate_sums
from lippmann.rendering.estimate.psnr import ErrorSums, Estimate
from lippmann.rendering.film import memory_model
from lippmann.rendering.provenance import is_among_mirrors, make_provenance
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import memory_limit, read_choices
from lippmann.runtime import engine as engines
from lippmann.scene.scene import Scene
from lippmann.tiles.job import SIDES, TileJob, make_job

if TYPE_CHECKING:
    from lippmann.tiles.tile_render import Prepared

#: Keeps the tiles of a picture: called with each as it comes, from any thread.
Put = Callable[[TileResult], None]

#: Renders the tiles with these numbers, in any order, and calls ``put`` with each.
Runner = Callable[["Prepared", Sequence[int], Put], None]

#: Threads that pack and write while the next tile is traced, and tiles that may wait for them.
_WRITERS, _WAITING = 2, 3

#: How often tiles that turn out damaged are made anew before the disk is blamed.
_MOST_REPAIRS = 3


@dataclass(frozen=True, eq=False)
class Rendered:
    """The written picture.

    ``tiles`` the picture has; ``resumed`` of them lay there already. ``provenance`` has the seconds of this run, which
    the file has not.
    """

    display: Display
    provenance: Provenance
    tiles: int
    resumed: int

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        return self.display.panel.width, self.display.panel.height


def render_to_file(
    scene: Scene,
    display: Display,
    request: RenderRequest,
    output: Path,
    *,
    bits: int | None = None,
    resume: bool = False,
    finish: Finish = NO_FINISH,
    runner: Runner | None = None,
    progress: ProgressCallback = silent,
) -> Rendered:
    """Render ``scene`` for ``display`` into the file ``output``, tile by tile.

    The file is the same, byte for byte, whatever interrupted the work and however often, and whatever ``runner`` does
    it. While it is in the making its tiles lie in a folder beside it, see :mod:`lippmann.journal.tile_journal`.

    Parameters
    ----------
    bits:
        See :func:`lippmann.image.write.format_for`.
    resume:
        Go on with what an earlier run left, if there is anything.
    finish:
        What is done to the picture of a print, once its tiles are there.
    runner:
        Who renders the tiles; by default this process.

    Raises
    ------
    UsageError, MemoryLimitError, SceneError, EngineError
        As the stages find them.
    PictureError
        If what an earlier run left is of another picture; says what differs.
    OutputError
        If the file cannot be written, or there is an unfinished picture and ``resume`` was not asked for.
    """
    from lippmann.tiles.tile_render import prepare

    started = time.perf_counter()
    name, stored = check_output(output, bits)
    finish.check_stored(stored, output)
    finish.check_colors(request.transfer)
    request = request.for_file(output, bits)
    printed = finish.display(display)
    if name == "zarr":
        zarr_array.load_zarr(output)
    job = make_job(
        scene,
        display,
        request,
        stored=stored,
        keeps_maps=name == "exr",
        side=_side_of(output) if resume else None,
    )
    _check_fits(job, name)
    denoiser = None
    if job.request.denoises:
        oidn.load_denoiser()
        denoiser = oidn.denoiser_version()
    progress(Progress("load", 0, 1))
    engine = engines.start(request.device, request.threads)
    fingerprint = {"the format": name, **job.fingerprint(engine.gpu_name or "cpu", engine.llvm_version, denoiser)}
    with TileStore.open(output, fingerprint, job.grid, resume=resume) as store:
        sweep_beside(output)
        prepared = prepare(job, progress)
        built = time.perf_counter()
        resumed = store.resumed
        provenance = _complete(prepared, store, runner or render_here, progress)
        traced = time.perf_counter()
        progress(Progress("write", 0, len(job.grid)))
        try:
            if finish == NO_FINISH and not is_mirrored(display):
                _write(output, name, prepared, provenance, store, progress)
            else:
                _write_print(output, bits, prepared, provenance, store, finish, progress)
        except DamagedTile as error:
            raise EngineError(f"a tile was damaged while the file was written: {error}", fix="run it again") from error
        left = store.finish()
    ended = time.perf_counter()
    seconds = {"build": built - started, "trace": traced - built, "write": ended - traced, "total": ended - started}
    return Rendered(
        printed, replace(provenance, seconds=seconds, notes=(*provenance.notes, *left)), len(job.grid), resumed
    )


def render_here(prepared: Prepared, missing: Sequence[int], put: Put) -> None:
    """The runner of one process: packs and writes one tile while it traces the next."""
    from lippmann.tiles.tile_render import TracedTile, pack, trace_tile

    def keep(traced: TracedTile) -> None:
        put(pack(prepared, traced))

    with ThreadPoolExecutor(_WRITERS) as pool:
        waiting: set[Future[None]] = set()
        for index in missing:
            traced = trace_tile(prepared, index)
            if len(waiting) >= _WAITING:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                _raise_failure(done)
            waiting.add(pool.submit(keep, traced))
        _raise_failure(waiting)


def _raise_failure(futures: set[Future[None]]) -> None:
    for future in futures:
        future.result()


def _complete(prepared: Prepared, store: TileStore, runner: Runner, progress: ProgressCallback) -> Provenance:
    """Render what is missing until every tile is there and whole; how the picture was made."""
    grid = prepared.job.grid
    for _ in range(_MOST_REPAIRS):
        missing = store.missing()
        if missing:
            counted = _Counted(store, grid, progress, len(grid) - len(missing))
            runner(prepared, missing, counted.put)
        try:
            return _sum_up(prepared, store)
        except DamagedTile:
            continue
    raise EngineError(
        "tiles are damaged again and again as they are written",
        where=str(store.folder),
        fix="look after the disk, or choose another one",
    )


class _Counted:
    """Keeps tiles and says how many there are."""

    def __init__(self, store: TileStore, grid: TileGrid, progress: ProgressCallback, done: int) -> None:
        self._store, self._grid, self._progress, self._done = store, grid, progress, done
        self._progress(Progress("tiles", done, len(grid)))

    def put(self, result: TileResult) -> None:
        self._store.put(result)
        self._done += 1
        self._progress(Progress("tiles", self._done, len(self._grid), f"tile {self._done} of {len(self._grid)}"))


def _sum_up(prepared: Prepared, store: TileStore) -> Provenance:
    """Rays and the estimate from all tiles, in their order; each is checked on the way."""
    from lippmann.rendering.film.wavefront import Frame, RayTotals
    from lippmann.rendering.picture import describe_placement
    from lippmann.tiles.tile_render import LENSES, OF_SAMPLES, SUMS

    job, grid = prepared.job, prepared.job.display.lens_grid
    rays = RayTotals()
    size = grid.rows, grid.columns
    # Of denoised pictures the samples' errors, too.
    sums = {
        before: ErrorSums.none(size[0] * size[1]) for before in (("", OF_SAMPLES) if job.request.denoises else ("",))
    }
    # By their first places, each once.
    notes = dict.fromkeys(prepared.placement.warnings)
    for tile in store.results():
        try:
            rays += RayTotals(**tile.rays)
        except TypeError as error:
            store.drop(tile.index)
            raise DamagedTile(f"its rays make no sense: {error}") from error
        for before, each in sums.items() if tile.sums else ():
            # Each lens has one entry in a tile.
            each.add_sums(tile.sums[LENSES], ErrorSums(**{name: tile.sums[before + name] for name in SUMS}))
        notes |= dict.fromkeys(tile.notes)
    estimate: Estimate | None = None
    if prepared.no_estimate is not None:
        notes |= {prepared.no_estimate: None}
    else:
        mirrors = is_among_mirrors(read_choices(prepared.integrator))
        estimate = estimate_sums(sums[""], sums.get(OF_SAMPLES), size, job.request.samples, mirrors)
    # Only the size of these pixels is asked for; they take no memory.
    frame = Frame(np.broadcast_to(np.float32(0), (job.grid.height, job.grid.width, 3)), rays)
    return make_provenance(
        prepared.session,
        frame,
        samples=job.request.samples,
        choices=read_choices(prepared.integrator),
        estimate=estimate,
        options={
            **({"auto": job.request.reason} if job.request.reason else {}),
            **prepared.options,
            **describe_placement(job.request, prepared.placement),
        },
        notes=tuple(notes),
        has_pixels=False,
    )


def _write(
    output: Path,
    name: FormatName,
    prepared: Prepared,
    provenance: Provenance,
    store: TileStore,
    progress: ProgressCallback,
) -> None:
    job = prepared.job
    size, dtype = (job.grid.width, job.grid.height), np.dtype(job.stored)
    text = to_text(Metadata(job.display, prepared.placement.world_from_display, provenance))
    pitch = job.display.panel.pixel_pitch
    icc = profile_in_file(job.display, job.stored, job.transfer)
    with replacing_output(output, name) as temporary:
        if is_tiled(name, size):
            tiles = _file_tiles(store, progress)
            encode_tiles(temporary, name, tiles, size=size, dtype=dtype, text=text, pixel_pitch=pitch, icc=icc)
        else:
            layers = _whole(job, store)
            encode_values(temporary, name, layers, transfer=job.transfer, text=text, pixel_pitch=pitch, icc=icc)


def _write_print(
    output: Path,
    bits: int | None,
    prepared: Prepared,
    provenance: Provenance,
    store: TileStore,
    finish: Finish,
    progress: ProgressCallback,
) -> None:
    """Write the sheet of a print: with its marks, in its profile, mirrored."""
    job, world_from_display = prepared.job, prepared.placement.world_from_display
    if can_be_banded(format_for(output, bits)[0]):
        printed = finish.display(job.display)

        def rows(first: int, last: int) -> Values:
            progress(Progress("write", first, printed.panel.height))
            return finished(first, last)

        finished = finish.rows(_Rows(job, store).linear, job.display)
        write_rows(rows, Metadata(printed, world_from_display, provenance), output, bits=bits, icc=finish.icc)
        return
    layers = _whole(job, store)
    pixels = linear_values(cast("Values", layers.pop("")), job.transfer)
    image = IntegralImage(pixels, job.display, world_from_display, provenance, cast("dict[str, Layer]", layers))
    finish.image(image).save(output, bits=bits, icc=finish.icc)


class _Rows:
    """Rows of a picture from its tiles, asked for from the top down."""

    def __init__(self, job: TileJob, store: TileStore) -> None:
        self._job, self._store = job, store
        self._bands: dict[int, Values] = {}

    def linear(self, first: int, last: int) -> FloatArray:
        """Linear RGB ``(last - first, W, 3)``."""
        side, columns = self._job.side, self._job.grid.columns
        numbers = range(first // side, -(-last // side))
        self._bands = {
            number: self._bands[number]
            if number in self._bands
            else np.concatenate([self._store.get(number * columns + c).pixels for c in range(columns)], axis=1)
            for number in numbers
        }
        band = np.concatenate([self._bands[number] for number in numbers])
        return linear_values(band[first - numbers[0] * side : last - numbers[0] * side], self._job.transfer)


def _file_tiles(store: TileStore, progress: ProgressCallback) -> Iterator[Pixels]:
    """The picture in the tiles of its file, from those of the job, whose sides divide theirs."""
    grid, per_side = store.grid, tiff.TILE // store.grid.side
    files = TileGrid(grid.width, grid.height, tiff.TILE)
    for number, window in enumerate(files):
        row, column = (first * per_side for first in divmod(number, files.columns))
        parts = [
            [store.get(r * grid.columns + c).pixels for c in range(column, min(column + per_side, grid.columns))]
            for r in range(row, min(row + per_side, grid.rows))
        ]
        tile = parts[0][0] if per_side == 1 else np.concatenate([np.concatenate(line, axis=1) for line in parts])
        assert tile.shape[:2] == window.shape
        yield tile
        progress(Progress("write", number + 1, len(files)))


def _whole(job: TileJob, store: TileStore) -> dict[str, Pixels]:
    """The layers of the whole picture, as its file holds them."""
    from lippmann.rendering.methods import SAMPLES_LAYER

    height, width = job.grid.height, job.grid.width
    layers: dict[str, Pixels] = {"": np.empty((height, width, 3), dtype=job.stored)}
    if job.keeps_maps:
        layers[SAMPLES_LAYER] = np.full((height, width), job.request.samples, dtype=np.uint32)
    for tile in store.results():
        place = job.grid[tile.index].slices
        layers[""][place] = tile.pixels
        for name, values in tile.maps.items():
            layers.setdefault(name, np.empty((height, width), dtype=values.dtype))[place] = values
    return layers


def fits_whole(display: Display, request: RenderRequest) -> bool:
    """Whether a picture can be rendered in one piece within the memory that it may use; see
    :func:`lippmann.rendering.film.memory_model.cut_wavefronts`.

    Beside its own pixels that takes their errors and the codes of its file; more where it is pooled or denoised, and
    thrice as much where so are sub-pixels that keep all colours.
    """
    with_neighbours = request.method == "pooled" or request.denoises
    per_pixel = memory_model.TILE if with_neighbours else memory_model.batches(1)
    per_pixel *= 3 if with_neighbours and request.keeps_colors(display) else 1
    return display.panel.width * display.panel.height * per_pixel <= memory_limit(request)


def _check_fits(job: TileJob, name: FormatName) -> None:
    """Files that are written whole have to fit into the memory."""
    if is_tiled(name, (job.grid.width, job.grid.height)):
        return
    memory = memory_limit(job.request)
    # The values and the copies that encoders make of them.
    per_pixel = 3 * 3 * np.dtype(job.stored).itemsize + (24 if job.keeps_maps else 0)
    required = job.grid.width * job.grid.height * per_pixel
    if required > memory:
        what = f"{job.grid.width}x{job.grid.height} pixels as {name.upper()}, which is written whole"
        fix = "give the output the ending .tif or .zarr, or raise the limit"
        raise memory_model.make_memory_error(memory, what, required, fix)


def _side_of(output: Path) -> int | None:
    """The side of the tiles that an earlier run began with; its choice may have hung on its memory."""
    job = read_job(output)
    grid = None if job is None else job.grid
    side = grid[2] if isinstance(grid, list) and len(grid) == 3 else None
    return side if side in SIDES else None
