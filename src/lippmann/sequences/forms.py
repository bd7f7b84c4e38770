"""What the frames of a sequence are: integral images, or quilts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from lippmann.display import Display
from lippmann.image import IntegralImage
from lippmann.image.metadata import Provenance
from lippmann.image.read import read_metadata
from lippmann.progress import ProgressCallback
from lippmann.quilts.files import write_quilt
from lippmann.quilts.quilt import DeviceQuilt, Quilt
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import Build
from lippmann.scene.scene import Scene

#: An integral image, or a quilt.
Output = TypeVar("Output", IntegralImage, Quilt)


class Form(ABC, Generic[Output]):
    """How a frame is rendered and written."""

    @property
    @abstractmethod
    def settings(self) -> Mapping[str, str]:
        """What an unfinished sequence has to agree in with one that goes on with it, besides the render's request."""

    @abstractmethod
    def render(
        self, scene: Scene, display: Display, request: RenderRequest, progress: ProgressCallback, build: Build
    ) -> Output:
        """Render a frame of a scene that ``build`` builds; errors as of the renderer."""

    @abstractmethod
    def write(self, frame: Output, path: Path, bits: int | None) -> Output | None:
        """Write a frame with so many bits per value; the frame with the file's values, None where they are read."""

    @abstractmethod
    def provenance(self, path: Path) -> Provenance:
        """How the frame in a file was made, as far as the file tells."""


class IntegralForm(Form[IntegralImage]):
    """Native pictures of a display."""

    @property
    def settings(self) -> Mapping[str, str]:
        return {}

    def render(
        self, scene: Scene, display: Display, request: RenderRequest, progress: ProgressCallback, build: Build
    ) -> IntegralImage:
        from lippmann.rendering.picture import render_picture

        return render_picture(scene, display, request, progress, build)

    def write(self, frame: IntegralImage, path: Path, bits: int | None) -> None:
        frame.save(path, bits=bits)

    def provenance(self, path: Path) -> Provenance:
        return read_metadata(path).provenance


@dataclass(frozen=True)
class QuiltForm(Form[Quilt]):
    """Quilts of one size and layout.

    Parameters
    ----------
    quilt:
        As :func:`lippmann.quilts.quilt.quilt_of_display` gives it.
    """

    quilt: DeviceQuilt

    @property
    def settings(self) -> Mapping[str, str]:
        layout, size = self.quilt.layout, (self.quilt.width, self.quilt.height)
        return {"the quilt": f"{layout.columns}x{layout.rows} views, {size[0]}x{size[1]} pixels"}

    def render(
        self, scene: Scene, display: Display, request: RenderRequest, progress: ProgressCallback, build: Build
    ) -> Quilt:
        from lippmann.rendering.quilt import render_quilt

        layout = self.quilt.layout
        grid, size = (layout.columns, layout.rows), (self.quilt.width, self.quilt.height)
        frame = render_quilt(scene, display, grid, size, request, progress, build)
        return Quilt(frame.pixels, layout, provenance=frame.provenance)

    def write(self, frame: Quilt, path: Path, bits: int | None) -> Quilt:
        return write_quilt(frame, path, bits=bits)

    def provenance(self, path: Path) -> Provenance:
        # A quilt's file holds nothing but its pixels.
        return Provenance()


INTEGRAL = IntegralForm()
