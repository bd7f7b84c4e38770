"""The integral image: the pixels of a panel with the display that they are for, and the interface of such pictures."""

from __future__ import annotations

import base64
import html
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, get_args

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.errors import PictureError, UsageError
from lippmann.image.encoding import display_codes, linear_values
from lippmann.image.metadata import Metadata, Provenance
from lippmann.image.micro_images import Permutation, micro_images_as_views
from lippmann.image.stored_values import FloatArray, Indices, Layer, Matrix, Stored, Values
from lippmann.image.views import Resampling, exact_view_shape, resampled_views, view_grid
from lippmann.options.option import checked
from lippmann.scene.matrices import check_placement

if TYPE_CHECKING:
    from typing_extensions import Unpack

_MAP_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")

#: Width of the picture that a notebook shows, in pixels.
_NOTEBOOK_WIDTH = 512


class Picture(ABC):
    """The pixels of a panel: :class:`~lippmann.image.IntegralImage` in memory, or
    :class:`~lippmann.image.LargePicture` in a file that is decoded piece by piece.

    Attributes
    ----------
    display:
        Display of the picture; its panel has ``W x H`` pixels.
    world_from_display:
        ``(4, 4)`` affine map from the display frame (mm) to the scene.
    provenance:
        How the picture was made.
    maps:
        Layers beside the RGB by name, ``(H, W)`` or ``(H, W, 2 to 4)``.
    stored:
        Type of the values in the picture's file; ``float32`` if it has none.
    """

    display: Display
    world_from_display: Matrix
    provenance: Provenance
    maps: Mapping[str, Layer]
    stored: Stored

    @abstractmethod
    def window(self, window: PixelWindow) -> Values:
        """``(rows, columns, 3)`` values of a rectangle as the picture holds them: linear floats or codes."""

    @abstractmethod
    def take(self, row: Indices, column: Indices, channels: slice = slice(0, 3)) -> FloatArray:
        """Linear RGB ``(..., channels)`` of single pixels; ``row`` and ``column`` broadcast to ``(...)``."""

    def held_rows(self, first: int, last: int) -> Values:
        """``(last - first, W, 3)`` values of whole rows as the picture holds them: linear floats or codes."""
        return self.window(PixelWindow(0, first, self.display.panel.width, last - first))

    def rows(self, first: int, last: int) -> FloatArray:
        """``(last - first, W, 3)`` linear RGB of whole rows."""
        return linear_values(self.held_rows(first, last), self.provenance.transfer)

    @property
    def metadata(self) -> Metadata:
        """Display, placement and provenance, as a file carries them."""
        return Metadata(self.display, self.world_from_display, self.provenance)

    @property
    def views_are_exact(self) -> bool:
        """Whether the views are a permutation of the pixels; otherwise they are resampled."""
        return view_grid(self.display).exact

    @property
    def views_note(self) -> str:
        """A sentence on how the views deviate from exact ones; empty if they do not."""
        return view_grid(self.display).note

    def replay(
        self,
        eye: tuple[float, float, float] | None = None,
        *,
        size: tuple[int, int] | None = None,
        filter: Resampling = "nearest",
        subpixels: bool | None = None,
        optics: bool = False,
    ) -> FloatArray:
        """Linear RGB ``(height, width, 3)`` that an eye at ``eye`` (mm, display frame) sees.

        Parameters, defaults and errors are those of :func:`lippmann.viewing.replay.replay`; with ``optics`` those of
        :func:`lippmann.viewing.optical_replay.replay_optics`, which takes the place of ``filter`` and ``subpixels``.
        """
        from lippmann.viewing.replay import replay

        if optics:
            from lippmann.viewing.optical_replay import replay_optics

            if (filter, subpixels) != ("nearest", None):
                rule = "the lens says which sub-pixels are seen, and how much of each"
                parameter = "subpixels" if filter == "nearest" else "filter"
                raise UsageError("given beside optics", parameter=parameter, rule=rule, fix="leave it out")
            return replay_optics(self, eye, size=size)
        return replay(self, eye, size=size, filter=filter, subpixels=subpixels)


class Parts(TypedDict, total=False):
    """Optional parameters of :class:`IntegralImage`."""

    world_from_display: Matrix
    provenance: Provenance
    maps: Mapping[str, Layer]
    stored: Stored


@checked
@dataclass(frozen=True, eq=False)
class IntegralImage(Picture):
    """The pixels of a panel in linear RGB, in memory.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` linear RGB, row 0 on top, finite; kept as float32 and read-only. 1 is the brightest value of
        integer formats.
    display:
        Display of the picture; its panel has ``W x H`` pixels.
    world_from_display:
        ``(4, 4)`` similarity (rotation, scale, translation) from the display frame (mm) to the scene.
    provenance:
        How the picture was made.
    maps:
        Layers beside the RGB by name, such as ``depth`` and ``normal``: ``(H, W)`` or ``(H, W, 2 to 4)``, float32 or
        uint32. Names begin with a letter and hold letters, digits, ``_`` and ``-``. Only OpenEXR files keep maps.
    stored:
        Type of the values in the file that the picture was read from, so that it can be written back exactly.

    Raises
    ------
    PictureError
        If a shape, type or value is another.
    UsageError
        If ``display``, ``provenance`` or ``maps`` is of another kind.

    Examples
    --------
    >>> import numpy as np
    >>> display = lippmann.load_display("mla-square")
    >>> image = lippmann.IntegralImage(np.zeros((510, 510, 3), dtype=np.float32), display)
    >>> image.replay((0.0, 0.0, 300.0), size=(34, 34)).shape
    (34, 34, 3)
    """

    pixels: FloatArray
    display: Display
    world_from_display: Matrix = field(default_factory=lambda: np.eye(4))
    provenance: Provenance = field(default_factory=Provenance)
    maps: Mapping[str, Layer] = field(default_factory=dict)
    stored: Stored = "float32"

    def __post_init__(self) -> None:
        object.__setattr__(self, "pixels", _checked_pixels(self.pixels, self.display))
        object.__setattr__(self, "world_from_display", check_placement(self.world_from_display))
        size = self.pixels.shape[:2]
        maps = {name: _checked_map(name, values, size) for name, values in self.maps.items()}
        object.__setattr__(self, "maps", maps)
        if self.stored not in get_args(Stored):
            rule = f"it must be one of {', '.join(get_args(Stored))}"
            raise PictureError(f"stored is {self.stored!r}", rule=rule)

    # ---- Micro-images and views -----------------------------------------------------------------------------------

    def micro_images(self) -> FloatArray:
        """Micro-images ``(lens_rows, lens_cols, ny, nx, 3)``, an exact permutation of the pixels.

        A lenticular sheet has ``(1, lens_cols, H, nx, 3)``. Values are zero where :meth:`micro_image_mask` is False.
        The result may share its memory with :attr:`pixels`.
        """
        return Permutation(self.display).split(self.pixels)

    def micro_image_mask(self) -> NDArray[np.bool_]:
        """Mask ``(lens_rows, lens_cols, ny, nx)`` of :meth:`micro_images`: True for places that hold a pixel."""
        return Permutation(self.display).mask

    def views(self, resampling: Resampling = "nearest") -> FloatArray:
        """Views ``(ny, nx, lens_rows, lens_cols, 3)``; for a lenticular sheet ``(1, nx, H, lens_cols, 3)``.

        A larger ``kx`` is seen from further left, a larger ``ky`` from further up. Views are exact where the distance
        from lens to lens is a whole number of pixels (:attr:`views_are_exact`), else resampled. Values are zero where
        :meth:`view_mask` is False.

        Parameters
        ----------
        resampling:
            Value of a lens without a pixel at the place of the view: its ``nearest`` pixel, or a ``linear``
            interpolation between its pixels.

        Raises
        ------
        PictureError
            If ``resampling`` is unknown.
        """
        return self.views_and_mask(resampling)[0]

    def view_mask(self) -> NDArray[np.bool_]:
        """Mask ``(ny, nx, lens_rows, lens_cols)`` of :meth:`views`: True for values that stand for a pixel."""
        return self.views_and_mask()[1]

    def views_and_mask(self, resampling: Resampling = "nearest") -> tuple[FloatArray, NDArray[np.bool_]]:
        """:meth:`views` and :meth:`view_mask` in one pass; parameter and errors as for :meth:`views`."""
        if resampling not in get_args(Resampling):
            rule = f"it must be one of {', '.join(get_args(Resampling))}"
            raise PictureError(f"resampling is {resampling!r}", rule=rule)
        if not self.views_are_exact:
            return resampled_views(self.pixels, self.display, resampling)
        permutation = Permutation(self.display)
        views = micro_images_as_views(permutation.split(self.pixels), self.display)
        return views, micro_images_as_views(permutation.mask, self.display)

    @classmethod
    def from_micro_images(cls, micro_images: ArrayLike, display: Display, **parts: Unpack[Parts]) -> IntegralImage:
        """The picture with these :meth:`micro_images`, ``(lens_rows, lens_cols, ny, nx, 3)``.

        ``parts`` are further parameters of the class.

        Raises
        ------
        PictureError
            If the shape is not that of the display's micro-images.
        """
        return cls(Permutation(display).join(_numbers("micro-images", micro_images)), display, **parts)

    @classmethod
    def from_views(cls, views: ArrayLike, display: Display, **parts: Unpack[Parts]) -> IntegralImage:
        """The picture with these exact :meth:`views`, ``(ny, nx, lens_rows, lens_cols, 3)``.

        ``parts`` are further parameters of the class.

        Raises
        ------
        PictureError
            If the shape is not that of the display's views, or the display's views are resampled.
        """
        values, expected = _numbers("views", views), exact_view_shape(display)
        if values.shape[:4] != expected:
            rule = f"those of the display {display.name} have {expected}"
            raise PictureError(f"the views have the shape {values.shape[:4]}", rule=rule)
        return cls.from_micro_images(micro_images_as_views(values, display), display, **parts)

    def window(self, window: PixelWindow) -> FloatArray:
        """``(rows, columns, 3)`` linear RGB of a rectangle; shares its memory with :attr:`pixels`."""
        return self.pixels[window.slices]

    def take(self, row: Indices, column: Indices, channels: slice = slice(0, 3)) -> FloatArray:
        """Linear RGB of single pixels, ``(..., channels)``; ``row`` and ``column`` broadcast to ``(...)``."""
        values: FloatArray = self.pixels[..., channels][row, column]
        return values

    # ---- Refocusing and files -------------------------------------------------------------------------------------

    def refocus(self, plane: float, *, size: tuple[int, int] | None = None) -> FloatArray:
        """Linear RGB ``(height, width, 3)`` focused on the plane z = ``plane`` mm.

        Parameters, defaults and errors are those of :func:`lippmann.viewing.refocus.refocus`.
        """
        from lippmann.viewing.refocus import refocus

        return refocus(self, plane, size=size)

    @checked
    def save(self, path: str | Path, bits: int | None = None, *, icc: bytes = b"") -> None:
        """Write a PNG, OpenEXR, TIFF or Zarr file.

        Parameters and errors are those of :func:`lippmann.image.write.write_picture`.
        """
        from lippmann.image.write import write_picture

        write_picture(self, Path(path), bits=bits, icc=icc)

    def srgb(self, bits: int = 8) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """Display codes ``(H, W, 3)``, as integer formats hold them: uint8, or uint16 for 16 ``bits``.

        Raises
        ------
        PictureError
            If ``bits`` is neither 8 nor 16.
        """
        return display_codes(self.pixels, bits, self.provenance.transfer)

    def with_pixels(self, pixels: ArrayLike, **parts: Unpack[Parts]) -> IntegralImage:
        """A copy with other ``pixels``, ``(H, W, 3)`` linear RGB, and other ``parts``; errors as of the class."""
        return replace(self, pixels=_numbers("pixels", pixels), **parts)

    @property
    def stats(self) -> dict[str, object]:
        """Display, size in pixels, number of lenses, and provenance, as JSON-able values."""
        grid, panel = self.display.lens_grid, self.display.panel
        return {
            "display": self.display.name,
            "size": [panel.width, panel.height],
            "lenses": [grid.columns, grid.rows],
            **self.provenance.to_dict(),
        }

    # ---- Notebooks ------------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        grid, panel = self.display.lens_grid, self.display.panel
        lenses = f"{grid.columns} x {grid.rows} lenses"
        return f"<IntegralImage {panel.width} x {panel.height} pixels, {lenses}, display {self.display.name}>"

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """:attr:`pixels`, for ``np.asarray`` and NumPy's functions."""
        return np.array(self.pixels, dtype=dtype, copy=copy)

    def _repr_mimebundle_(self, **_: object) -> object:
        """The viewer's page as a widget, where it can be shown; see :mod:`lippmann.viewer.notebook`."""
        from lippmann.viewer.notebook import mimebundle

        return mimebundle(self)

    def _repr_png_(self) -> bytes:
        """A PNG of what an eye in the middle sees, at most 512 pixels wide."""
        from lippmann.codecs.png import encode_png
        from lippmann.color.transfer import quantize
        from lippmann.viewing.replay import default_size

        width, height = default_size(self.display, _NOTEBOOK_WIDTH)
        transfer = self.provenance.transfer
        codes = quantize(self.replay(size=(width, height)), 8, transfer)
        return encode_png(codes, text={}, srgb=transfer == "srgb")

    def _repr_html_(self) -> str:
        """The picture of :meth:`_repr_png_` above a line of facts."""
        origin = ", ".join(part for part in (self.provenance.scene, self.provenance.method) if part)
        caption = html.escape(repr(self)[1:-1] + (f" ({origin})" if origin else ""))
        picture = base64.b64encode(self._repr_png_()).decode("ascii")
        return f'<figure><img alt="" src="data:image/png;base64,{picture}"/><figcaption>{caption}</figcaption></figure>'


def _numbers(name: str, values: object) -> FloatArray:
    try:
        array = np.asarray(values)
        if np.iscomplexobj(array):
            raise TypeError("they are complex")
        return array.astype(np.float32, copy=False)
    except (TypeError, ValueError) as error:
        raise PictureError(f"the {name} are no array of numbers ({error})") from None


def _checked_pixels(pixels: object, display: Display) -> FloatArray:
    panel = display.panel
    values = _numbers("pixels", pixels)
    if values.ndim != 3 or values.shape[2] != 3:
        raise PictureError(f"the pixels have the shape {values.shape}", rule="it must be (height, width, 3)")
    if values.shape[:2] != (panel.height, panel.width):
        raise PictureError(
            f"the picture has {values.shape[1]} x {values.shape[0]} pixels",
            rule=f"the display {display.name} has {panel.width} x {panel.height}",
        )
    finite = np.isfinite(values)
    if not finite.all():
        row, column, _ = np.argwhere(~finite)[0]
        count = int((~finite).any(axis=2).sum())
        raise PictureError(f"{count} pixels are not finite, the first in column {column}, row {row}")
    values = values.view()
    values.flags.writeable = False
    return values


def _checked_map(name: str, values: ArrayLike, size: tuple[int, ...]) -> Layer:
    if not _MAP_NAME.fullmatch(name):
        rule = "it must begin with a letter and hold letters, digits, _ and - only"
        raise PictureError(f"a map has the name {name!r}", rule=rule)
    array = np.asarray(values)
    if array.dtype not in (np.float32, np.uint32):
        raise PictureError(f"the map {name} holds {array.dtype}", rule="it must hold float32 or uint32")
    if array.shape[:2] != size or array.ndim not in (2, 3) or (array.ndim == 3 and not 2 <= array.shape[2] <= 4):
        rule = f"it must be {size} or {size} and 2 to 4 channels"
        raise PictureError(f"the map {name} has the shape {array.shape}", rule=rule)
    array = array.view()
    array.flags.writeable = False
    return array
