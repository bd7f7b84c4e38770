"""All that the studio sets: one value from which live pictures and renders are made."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields

from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.display.visible_pixels import EyeMap
from lippmann.errors import UsageError
from lippmann.options.choices import Integrator, ToneMap
from lippmann.options.light import LightOptions
from lippmann.options.option import again, option, options_of
from lippmann.options.placement import PlacementOptions, Vector
from lippmann.options.quality import QualityOptions
from lippmann.options.scene import SceneOptions
from lippmann.rendering.live.live_view import LiveView
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.scene import Scene

#: Scene and display of a studio that is opened without any.
FIRST_SCENE, FIRST_DISPLAY = "teapot", "seed-lenticular"

#: Settings by which one scene is placed: another one begins without them.
PLACED_BY = ("up", *(each.name for each in fields(PlacementOptions)))

#: Settings that name files, beside their other meanings.
FILES = ("scene", "display", *(each.name for each, its in options_of(SceneOptions) if its.is_file))


@dataclass(frozen=True)
class StudioState(QualityOptions, LightOptions, PlacementOptions, SceneOptions):
    """The settings of a picture: the options of ``lippmann render``, by the same names.

    Light is traced along paths, also in scenes that were made for Whitted ray tracing, whose light the studio does not
    show.

    Parameters
    ----------
    scene:
        A file, or a bundled scene's name.
    display:
        A preset's name, a file, or a short form such as ``print:lpi=60,ppi=720,size=8x10in``.
    eye:
        The eye's place (mm) of a preview; None: in front of the middle.

    Raises
    ------
    UsageError
        A value is of another type, out of its range, or does not go with another one.

    Examples
    --------
    >>> from lippmann.studio_app.state import StudioState
    >>> StudioState(scene="gears", turn=(30.0, 0.0, 0.0)).placement().turn
    (30.0, 0.0, 0.0)
    """

    scene: str = option(FIRST_SCENE, "Scene file, or a bundled scene's name.", group="Scene")
    display: str = option(FIRST_DISPLAY, "Name, TOML file or short form of a display.", group="Display")
    environment: str | None = again(SceneOptions, "environment")
    depth_map: str | None = again(SceneOptions, "depth_map")
    transfer_function: str | None = again(SceneOptions, "transfer_function")
    integrator: Integrator = again(QualityOptions, "integrator", default="path")
    eye: Vector | None = option(None, "The eye's place: X,Y,Z in mm, z toward the viewer.", group="Display")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("scene", "display"):
            if not getattr(self, name):
                raise UsageError("is empty", parameter=name, rule="a name or a file")
        if self.background is not None and not all(0.0 <= value <= 1.0 for value in self.background):
            raise UsageError(f"{self.background!r}", parameter="background", rule="red, green and blue from 0 to 1")
        if self.eye is not None and not (all(map(math.isfinite, self.eye)) and self.eye[2] > 0):
            raise UsageError(f"{self.eye!r}", parameter="eye", rule="three finite numbers in mm, z above 0")

    def placement(self) -> PlacementOptions:
        """Options of the display's place in the scene."""
        return PlacementOptions.part_of(self)

    def light(self) -> LightOptions:
        """Direction and strength of the scene's light."""
        return LightOptions.part_of(self)

    def request(self) -> RenderRequest:
        """How a picture is rendered."""
        # A background whose colour was asked for stays as it is.
        tone_map: ToneMap = "none" if self.tone_map == "auto" and self.background is not None else self.tone_map
        return RenderRequest.from_options(QualityOptions.part_of(self), placement=self.placement(), tone_map=tone_map)

    def view(self, eye: Vector, size: tuple[int, int], eye_map: Callable[..., EyeMap] = EyeMap) -> LiveView:
        """An eye's view, as a picture of ``size`` (width, height); see :class:`LiveView`."""
        return LiveView(eye, size, eye_map, request=self.request(), light=self.light())

    def native_view(self, window: PixelWindow | None = None) -> LiveView:
        """Native pixels of a window of the panel, or of all of it."""
        return LiveView(None, window=window, request=self.request(), light=self.light())

    def load_scene(self, *, allow_outside: bool = False, source: Scene | None = None) -> Scene:
        """The scene with its surroundings, in the light of its file: that of :meth:`light` is set by the view.

        ``source`` is a scene that has no file, in place of the one that is named.

        Raises
        ------
        SceneError
            As :func:`lippmann.load_scene`.
        """
        from lippmann.scene.readers.load import read_scene

        asked = SceneOptions.part_of(self)
        return read_scene(self.scene if source is None else source, asked, allow_outside=allow_outside)

    def load_display(self) -> Display:
        """The display.

        Raises
        ------
        DisplayError
            As :func:`lippmann.display.load_display`.
        """
        from lippmann.display import load_display

        return load_display(self.display)
