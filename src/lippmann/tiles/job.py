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
from lippmann.display.panel import PixelWindow, TileGrid
from lippmann.errors import UsageError
from lippmann.journal.fingerprint import content_hash, in_words
from lippmann.rendering.film import memory_model
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import memory_limit
from lippmann.runtime.engine_lock import cached_property
from lippmann.scene.mitsuba_source import MitsubaSource
from lippmann.scene.mitsuba_xml import MitsubaXml
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
#: Fewer tiles than this do where each is rendered with its surroundings: small ones are mostly those.
FEWEST_WINDOWS = 4
#: The most memory that tiles with surroundings are planned for where no limit is given.
MOST_MEMORY = 4 << 30
#: Fields of a request that change nothing in the picture.
_IMMATERIAL = ("device", "threads", "memory", "began", "plan")


@dataclass(frozen=True, eq=False)
class TileJob:
    """A picture to be rendered in tiles. Make one with :func:`make_job`; it can be pickled.

    Parameters
    ----------
    scene, display, request:
        As for :func:`lippmann.rendering.picture.render_picture`; the request is a resolved one.
    side:
        Pixels along a tile's sides.
    stored:
        The type of the values that tiles hold.
    keeps_maps:
        Whether the file holds maps: the estimated error of each pixel, and its samples.
    """

    scene: Scene
    display: Display
    request: RenderRequest
    side: int
    stored: Stored
    keeps_maps: bool = False

    @property
    def grid(self) -> TileGrid:
        """The tiles."""
        return TileGrid(self.display.panel.width, self.display.panel.height, self.side)

    @property
    def transfer(self) -> Transfer:
        """How values become codes."""
        return self.request.transfer

    @property
    def tile_memory(self) -> int:
        """Bytes that a tile may use, whatever is free: how it is cut into wavefronts must not depend on that."""
        return bytes_of_tile(self.side, self.display, self.request)

    @property
    def surroundings(self) -> Surroundings | None:
        """Margin that is rendered around tiles; None where each pixel stands for itself."""
        return surroundings_of(self.display, self.request)

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
        xml = find_xml(described)
        known = xml.outline(), xml.files, described.environment, described.background
        return content_hash([*known, self.scene.studio, self.scene.light])

    def fingerprint(self, device: str, llvm: str | None = None, denoiser: str | None = None) -> dict[str, str]:
        """All that the picture's bytes depend on, by names for people; parameters as of :func:`made_by`."""
        request = {
            f.name.replace("_", " "): repr(getattr(self.request, f.name))
            for f in dataclasses.fields(self.request)
            if f.name not in (*_IMMATERIAL, "placement")
        }
        placement = {
            f"placement {f.name.replace('_', ' ')}": _text(getattr(self.request.placement, f.name))
            for f in dataclasses.fields(self.request.placement)
        }
        return {
            **made_by(device, llvm, denoiser),
            "the scene's name": self.scene.name,
            "the scene": self.scene_hash,
            **in_words(self.display.to_dict(), "the display's "),
            **request,
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


def find_xml(source: MitsubaSource) -> MitsubaXml:
    """The file that a scene of Mitsuba's was read from.

    Raises
    ------
    UsageError
        If it is an object of Mitsuba's.
    """
    if not isinstance(source.content, MitsubaXml):
        raise UsageError(
            f"the scene '{source.name}' is an object of Mitsuba's",
            rule="what it holds can neither be compared after an interruption nor sent",
            fix="save it as an XML file",
        )
    return source.content


def make_job(
    scene: Scene,
    display: Display,
    request: RenderRequest,
    *,
    stored: Stored,
    keeps_maps: bool = False,
    side: int | None = None,
) -> TileJob:
    """The job of rendering a picture in tiles; ``side`` is chosen where it is None.

    Raises
    ------
    UsageError
        If the request is for something that needs the whole picture at once.
    MemoryLimitError
        If ``request.memory`` does not hold the smallest tile.
    """
    display.check_native()
    request = resolve(request, scene, display, "tiles")
    return TileJob(scene, display, request, _best_side(display, request) if side is None else side, stored, keeps_maps)


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


def bytes_of_tile(side: int, display: Display, request: RenderRequest) -> int:
    """Bytes that rendering a tile takes; small tiles are given enough for wavefronts that are worth starting."""
    around = surroundings_of(display, request)
    if around is None:
        return max(side, 256) ** 2 * memory_model.TILE
    return (
        max(around.longest(side), 256) ** 2 * memory_model.DENOISED_TILE * (3 if request.keeps_colors(display) else 1)
    )


def _best_side(display: Display, request: RenderRequest) -> int:
    panel = display.panel
    memory, fewest = request.memory, FEWEST_TILES
    if surroundings_of(display, request) is not None:
        fewest = FEWEST_WINDOWS
        memory = memory or min(MOST_MEMORY, memory_limit(request))
    for side in SIDES:
        fits = memory is None or bytes_of_tile(side, display, request) <= memory
        is_light = side * side * request.samples * request.channels <= MOST_SAMPLES
        if fits and is_light and len(TileGrid(panel.width, panel.height, side)) >= fewest:
            return side
    smallest = SIDES[-1]
    required = bytes_of_tile(smallest, display, request)
    if memory is not None and memory < required:
        raise memory_model.make_memory_error(memory, "a tile, beside the scene", required)
    return smallest


def _text(value: object) -> str:
    """A value as text, without loss."""
    return repr(value.tolist() if isinstance(value, np.ndarray) else value)
