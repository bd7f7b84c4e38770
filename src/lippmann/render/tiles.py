"""A picture as work that can be done tile by tile, anywhere and in any order: plain values, no engine in sight.

A tile's bytes are a pure function of the job and the tile's number. Random numbers hang on the pixel's number in the
whole picture, the sample and the seed; wavefronts are cut by the job alone, never by the memory that happens to be
free.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version as version_of
from os.path import relpath
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from lippmann._version import VERSION
from lippmann.display import Display
from lippmann.errors import MemoryLimitError, UsageError
from lippmann.image.provenance import Transfer
from lippmann.render.choice import decide
from lippmann.render.pipeline import default_memory, transfer_of
from lippmann.render.settings import RenderSettings
from lippmann.render.surroundings import Surroundings, surroundings_of
from lippmann.scene.mitsuba_source import MitsubaSource
from lippmann.scene.placement import Placement, PlacementOptions
from lippmann.scene.scene import Scene
from lippmann.store.fingerprint import content_hash, in_words
from lippmann.store.grid import TileGrid, Window

if TYPE_CHECKING:
    from lippmann.image.integral_image import Stored

#: Sides of tiles, the best first: large ones waste the least time on starting wavefronts.
SIDES = (1024, 512, 256, 128)
#: A tile that takes more samples than this is cut smaller: it is what a crash can lose.
MOST_SAMPLES = 1 << 24
#: Fewer tiles than this leave little to resume and nothing to share out.
FEWEST_TILES = 32
#: What rendering a pixel of a tile takes in memory: sums of eight batches, the picture, its errors, and a wavefront.
BYTES_PER_PIXEL = 8 * 12 + 24 + 12 + 96
#: The same for a pixel of a window whose tile needs its surroundings: pictures, and what the cells of pooled light may
#: take beside them; batches, guides and what Open Image Denoise works with.
BYTES_POOLED, BYTES_DENOISED = 1280, 768
#: Fewer tiles than this do where each is rendered with its surroundings: small ones are mostly those.
FEWEST_WINDOWS = 4
#: The most memory that tiles with surroundings are planned for where no limit is given.
MOST_MEMORY = 4 << 30
#: Pictures number their sub-pixels in 32 bits.
MOST_SUBPIXELS = 1 << 32

#: Settings that change nothing in the picture.
_IMMATERIAL = ("device", "threads", "memory")


@dataclass(frozen=True, eq=False)
class TileJob:
    """What is to be rendered, in tiles. Make one with :func:`make_job`; it can be pickled.

    Parameters
    ----------
    scene, display, settings, placement:
        As for :func:`lippmann.render.pipeline.render_integral_image`; a placement may be known already.
    side:
        Pixels along a tile's sides.
    stored:
        The type of the values that tiles hold.
    keeps_maps:
        Whether the file holds maps: the estimated error of each pixel, and its samples.
    why:
        Why it is this method, where the user left that open.
    """

    scene: Scene
    display: Display
    settings: RenderSettings
    placement: PlacementOptions | Placement
    side: int
    stored: Stored
    keeps_maps: bool = False
    why: str = ""

    @property
    def grid(self) -> TileGrid:
        """The tiles."""
        return TileGrid(self.display.panel.width, self.display.panel.height, self.side)

    @property
    def transfer(self) -> Transfer:
        """How values become codes."""
        return transfer_of(self.settings)

    @property
    def tile_memory(self) -> int:
        """Bytes that a tile may use, whatever is free: how it is cut into wavefronts, and how finely its light is
        pooled, must not depend on that."""
        return bytes_of_tile(self.side, self.display, self.settings)

    @property
    def surroundings(self) -> Surroundings | None:
        """What is rendered around tiles; None where each pixel stands for itself."""
        return surroundings_of(self.display, self.settings)

    def window(self, index: int) -> Window:
        """The pixels that are rendered for a tile: its own and, where it needs any, those around."""
        tile = self.grid[index]
        around = self.surroundings
        return tile if around is None else around.window(tile, self.side, (self.grid.width, self.grid.height))

    @cached_property
    def scene_hash(self) -> str:
        """SHA-256 of all that the scene holds.

        Raises
        ------
        UsageError
            If it is an object of Mitsuba's, whose content cannot be told.
        """
        described = self.scene.description
        if not isinstance(described, MitsubaSource):
            return content_hash(self.scene)
        if not isinstance(described.content, Path):
            raise UsageError(
                f"the scene '{self.scene.name}' is an object of Mitsuba's",
                rule="what it holds cannot be compared after an interruption",
                fix="save it as an XML file",
            )
        folder = described.content.parent
        files = {Path(relpath(path, folder)).as_posix(): path for path in files_of(described.content)}
        return content_hash([files, described.environment, described.background, self.scene.studio])

    def fingerprint(self, device: str) -> dict[str, str]:
        """All that the picture's bytes hang on, by names for people; ``device`` is ``cpu`` or a GPU's name."""
        settings = {
            f.name.replace("_", " "): repr(getattr(self.settings, f.name))
            for f in dataclasses.fields(self.settings)
            if f.name not in _IMMATERIAL
        }
        placement = {
            f"placement {f.name.replace('_', ' ')}": _text(getattr(self.placement, f.name))
            for f in dataclasses.fields(self.placement)
        }
        return {
            **made_by(device),
            "the scene's name": self.scene.name,
            "the scene": self.scene_hash,
            **in_words(self.display.to_dict(), "the display's "),
            **settings,
            **placement,
            "values": self.stored,
            "maps": str(self.keeps_maps),
            **self._cut(),
        }

    def _cut(self) -> dict[str, str]:
        """How the picture is cut, where that shows in its pixels."""
        around = self.surroundings
        if around is None:
            return {}
        return {"the tiles": f"{self.side} pixels and {around.margin} around, each with {self.tile_memory} bytes"}


def make_job(
    scene: Scene,
    display: Display,
    settings: RenderSettings,
    placement: PlacementOptions | Placement,
    *,
    stored: Stored,
    keeps_maps: bool = False,
    side: int | None = None,
) -> TileJob:
    """The job of rendering a picture in tiles; ``side`` is chosen where it is None.

    Raises
    ------
    UsageError
        If the settings ask for something that needs the whole picture at once.
    MemoryLimitError
        If ``settings.memory`` does not hold the smallest tile.
    """
    choice = decide(settings)
    settings = choice.settings
    _check_possible(display, settings)
    if side is None:
        side = _best_side(display, settings)
    return TileJob(scene, display, settings, placement, side, stored, keeps_maps, choice.why)


def made_by(device: str) -> dict[str, str]:
    """The programs, and the ``device`` (``cpu`` or a GPU's name), that a picture's bytes hang on."""
    return {
        "Lippmann's version": VERSION,
        "the engine": f"Mitsuba {version_of('mitsuba')}, Dr.Jit {version_of('drjit')}",
        "the device": device,
    }


def bytes_of_tile(side: int, display: Display, settings: RenderSettings) -> int:
    """What rendering a tile takes in memory; small ones are given enough for wavefronts that are worth starting."""
    around = surroundings_of(display, settings)
    if around is None:
        return max(side, 256) ** 2 * BYTES_PER_PIXEL
    pooled = BYTES_POOLED if settings.pools_cells else 0
    denoised = BYTES_DENOISED * (3 if settings.keeps_colors(display) else 1) if settings.denoises else 0
    return max(around.longest(side), 256) ** 2 * max(pooled, denoised)


def _best_side(display: Display, settings: RenderSettings) -> int:
    panel, channels = display.panel, 3 if settings.subpixels else 1
    memory, fewest = settings.memory, FEWEST_TILES
    if surroundings_of(display, settings) is not None:
        fewest = FEWEST_WINDOWS
        memory = memory or min(MOST_MEMORY, default_memory())
    for side in SIDES:
        fits = memory is None or bytes_of_tile(side, display, settings) <= memory
        is_light = side * side * settings.samples * channels <= MOST_SAMPLES
        if fits and is_light and len(TileGrid(panel.width, panel.height, side)) >= fewest:
            return side
    smallest = SIDES[-1]
    required = bytes_of_tile(smallest, display, settings)
    if memory is not None and memory < required:
        raise MemoryLimitError(
            f"{memory / 2**20:.0f} MiB are too small for a tile",
            where="--memory",
            rule=f"{required / 2**20:.0f} MiB are needed beside the scene",
            fix="raise the limit",
        )
    return smallest


def _check_possible(display: Display, settings: RenderSettings) -> None:
    whole = {
        "--method": None if settings.method in ("full", "pooled") else settings.method,
        "--quality": settings.quality,
        "--quality-mean": settings.quality_mean,
        "--max-time": settings.max_time,
        "--layers": True if settings.layers else None,
    }
    for option, value in whole.items():
        if value is not None:
            raise UsageError(
                "needs the whole picture" if value is True else f"{value} needs the whole picture",
                where=option,
                rule="with --resume, to Zarr and beyond the memory pictures are rendered in tiles",
                fix="leave it out" if option != "--method" else "use --method full or pooled",
            )
    panel = display.panel
    subpixels = panel.width * panel.height * (3 if settings.subpixels else 1)
    if subpixels >= MOST_SUBPIXELS:
        raise UsageError(
            f"the display {display.name} has {panel.width} x {panel.height} pixels",
            where="--display",
            rule=f"pictures of fewer than {MOST_SUBPIXELS} (sub-)pixels are rendered",
            fix="render it in parts",
        )


def _text(value: object) -> str:
    """A value as text, without loss."""
    return repr(value.tolist() if isinstance(value, np.ndarray) else value)


def files_of(xml: Path, seen: frozenset[Path] = frozenset()) -> list[Path]:
    """A Mitsuba file and all files that it names, those that included files name too."""
    if xml in seen:
        return []
    found = [xml]
    for element in ElementTree.parse(xml).iter():
        for text in element.attrib.values():
            path = xml.parent / text
            if text and "\0" not in text and path.is_file():
                found += files_of(path, seen | {xml}) if path.suffix == ".xml" else [path]
    return sorted(set(found))
