"""A picture as work that can be done tile by tile, anywhere and in any order: plain values, no engine in sight.

A tile's bytes are a pure function of the job and the tile's number. Random numbers hang on the pixel's number in the
whole picture, the sample and the seed; wavefronts are cut by the job alone, never by the memory that happens to be
free.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from importlib.metadata import version as version_of
from typing import TYPE_CHECKING

import numpy as np

from lippmann._version import VERSION
from lippmann.color.transfer import Transfer
from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow, TileGrid
from lippmann.errors import MemoryLimitError, UsageError
from lippmann.journal.fingerprint import content_hash, in_words
from lippmann.rendering.picture import default_memory, transfer_of
from lippmann.rendering.request.resolve import decide
from lippmann.rendering.request.settings import RenderSettings
from lippmann.runtime.cached_property import cached_property
from lippmann.scene.mitsuba_source import MitsubaSource
from lippmann.scene.mitsuba_xml import MitsubaXml
from lippmann.scene.placement import Placement, PlacementOptions
from lippmann.scene.scene import Scene
from lippmann.tiles.margins import Surroundings, surroundings_of

if TYPE_CHECKING:
    from lippmann.image.stored_values import Stored

#: Sides of tiles, the best first: large ones waste the least time on starting wavefronts.
SIDES = (1024, 512, 256, 128)
#: A tile that takes more samples than this is cut smaller: it is what a crash can lose.
MOST_SAMPLES = 1 << 24
#: Fewer tiles than this leave little to resume and nothing to share out.
FEWEST_TILES = 32
#: What rendering a pixel of a tile takes in memory: sums of eight batches, the picture, its errors, and a wavefront.
BYTES_PER_PIXEL = 8 * 12 + 24 + 12 + 96
#: The same for a pixel of a window whose tile needs its surroundings: pictures, batches, guides and what Open Image
#: Denoise works with.
BYTES_DENOISED = 768
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
        As for :func:`lippmann.rendering.picture.render_integral_image`; a placement may be known already.
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
        """Bytes that a tile may use, whatever is free: how it is cut into wavefronts must not depend on that."""
        return bytes_of_tile(self.side, self.display, self.settings)

    @property
    def surroundings(self) -> Surroundings | None:
        """What is rendered around tiles; None where each pixel stands for itself."""
        return surroundings_of(self.display, self.settings)

    def window(self, index: int) -> PixelWindow:
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
        if not isinstance(described.content, MitsubaXml):
            raise UsageError(
                f"the scene '{self.scene.name}' is an object of Mitsuba's",
                rule="what it holds cannot be compared after an interruption",
                fix="save it as an XML file",
            )
        xml = described.content
        return content_hash([xml.outline(), xml.files, described.environment, described.background, self.scene.studio])

    def fingerprint(self, device: str, llvm: str | None = None, denoiser: str | None = None) -> dict[str, str]:
        """All that the picture's bytes depend on, by names for people; parameters as of :func:`made_by`."""
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
            **made_by(device, llvm, denoiser),
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


def made_by(device: str, llvm: str | None = None, denoiser: str | None = None) -> dict[str, str]:
    """Programs and device that a picture's bytes depend on, by names for people.

    Parameters
    ----------
    device:
        ``cpu`` or a GPU's name.
    llvm:
        Version of the LLVM library that compiles the kernels; None on a GPU, which needs none.
    denoiser:
        What :func:`lippmann.rendering.denoise.oidn.denoiser_version` says; None where no noise is taken out.
    """
    optional = {"LLVM": llvm, "Open Image Denoise": denoiser}
    return {
        "Lippmann's version": VERSION,
        "the engine": f"Mitsuba {version_of('mitsuba')}, Dr.Jit {version_of('drjit')}",
        **{name: version for name, version in optional.items() if version is not None},
        "the device": device,
    }


def bytes_of_tile(side: int, display: Display, settings: RenderSettings) -> int:
    """What rendering a tile takes in memory; small ones are given enough for wavefronts that are worth starting."""
    around = surroundings_of(display, settings)
    if around is None:
        return max(side, 256) ** 2 * BYTES_PER_PIXEL
    return max(around.longest(side), 256) ** 2 * BYTES_DENOISED * (3 if settings.keeps_colors(display) else 1)


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
