"""All that the studio sets: one value from which live pictures and renders are made."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import UsageError
from lippmann.rendering.live.live_view import LiveView
from lippmann.rendering.request.choices import Caustics, Denoiser, Effort, Integrator, Method, PixelFilter, ToneMap
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.light_options import LightOptions
from lippmann.scene.placement import Mode, PlacementOptions
from lippmann.scene.scene import Scene

Vector = tuple[float, float, float]
Up = Literal["y", "z"]

#: What the studio shows where nothing is said.
FIRST_SCENE, FIRST_DISPLAY = "teapot", "seed-lenticular"

#: Settings by which one scene is placed: another one begins without them.
PLACED_BY = ("up", "camera", "place", "turn", "shift", "scale", "depth_scale", "pop_out")


@dataclass(frozen=True)
class StudioState:
    """The settings of a picture. Fields are named after the options of ``lippmann render``, and mean the same.

    Parameters
    ----------
    scene:
        A file, or a bundled scene's name.
    display:
        A preset's name, a file, or a short form such as ``print:lpi=60,ppi=720,size=8x10in``.
    up:
        Which axis points up in files that do not say so.
    environment:
        A picture of the surroundings that lights the scene.
    background:
        Linear RGB seen where nothing is hit, each 0 to 1.
    camera, place, turn, shift, scale, depth_scale, pop_out:
        See :class:`~lippmann.scene.placement.PlacementOptions`; ``place`` is its mode, a ``depth_scale`` of None what
        the display resolves.
    light_turn, light_strength, environment_strength:
        See :class:`~lippmann.scene.light_options.LightOptions`.
    exposure, tone_map, integrator, depth, method, spp, effort, quality, max_time, seed, subpixels, pixel_filter, \
denoise, caustics, clamp_indirect:
        See :class:`~lippmann.rendering.request.render_request.RenderRequest`. Light is traced along paths, also in
        scenes that were made for Whitted ray tracing, whose light the studio does not show.
    eye:
        The eye's place (mm) of a preview; None: in front of the middle.

    Raises
    ------
    UsageError
        A value is of another type, out of its range, or does not go with another one.
    """

    scene: str = FIRST_SCENE
    display: str = FIRST_DISPLAY
    up: Up | None = None
    environment: str | None = None
    background: Vector | None = None
    camera: str | None = None
    place: Mode | None = None
    turn: Vector = (0.0, 0.0, 0.0)
    shift: Vector = (0.0, 0.0, 0.0)
    scale: float = 1.0
    depth_scale: float | None = None
    pop_out: float | None = None
    light_turn: tuple[float, float] = (0.0, 0.0)
    light_strength: float = 1.0
    environment_strength: float = 1.0
    exposure: float | Literal["auto"] = "auto"
    tone_map: ToneMap = "auto"
    integrator: Integrator = "path"
    depth: int | None = None
    method: Method = "auto"
    spp: int | None = None
    effort: Effort = "normal"
    quality: float | None = None
    max_time: float | None = None
    seed: int = 0
    subpixels: bool | None = None
    pixel_filter: PixelFilter = "auto"
    denoise: Denoiser = "auto"
    caustics: Caustics = "auto"
    clamp_indirect: float | None = None
    eye: Vector | None = None

    def __post_init__(self) -> None:
        for name in ("scene", "display"):
            if not getattr(self, name):
                raise UsageError("is empty", parameter=name, rule="a name or a file")
        if self.up is not None and self.up not in get_args(Up):
            raise UsageError(f"'{self.up}' is not known", parameter="up", rule="y or z")
        if self.background is not None and not all(0.0 <= value <= 1.0 for value in self.background):
            raise UsageError(f"{self.background!r}", parameter="background", rule="red, green and blue from 0 to 1")
        if self.eye is not None and not (all(map(math.isfinite, self.eye)) and self.eye[2] > 0):
            raise UsageError(f"{self.eye!r}", parameter="eye", rule="three finite numbers in mm, z above 0")
        self.light()
        self.request()

    def placement(self) -> PlacementOptions:
        """Where the display stands in the scene."""
        return PlacementOptions(
            mode=self.place,
            camera=self.camera,
            turn=self.turn,
            shift=self.shift,
            scale=self.scale,
            depth_scale=self.depth_scale,
            pop_out=self.pop_out,
        )

    def light(self) -> LightOptions:
        """Direction and strength of the scene's light."""
        return LightOptions(self.light_turn, self.light_strength, self.environment_strength)

    def request(self) -> RenderRequest:
        """How a picture is rendered."""
        return RenderRequest(
            method=self.method,
            integrator=self.integrator,
            depth=self.depth,
            spp=self.spp,
            effort=self.effort,
            quality=self.quality,
            max_time=self.max_time,
            seed=self.seed,
            subpixels=self.subpixels,
            pixel_filter=self.pixel_filter,
            denoise=self.denoise,
            caustics=self.caustics,
            clamp_indirect=self.clamp_indirect,
            exposure=self.exposure,
            # A background whose colour was asked for stays as it is.
            tone_map="none" if self.tone_map == "auto" and self.background is not None else self.tone_map,
            placement=self.placement(),
        )

    def view(self, eye: Vector, size: tuple[int, int]) -> LiveView:
        """What an eye sees, as a picture of ``size`` (width, height); see :class:`LiveView`."""
        return LiveView(eye, size, request=self.request(), light=self.light())

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
        from lippmann.scene.readers.load import load_scene

        return load_scene(
            self.scene if source is None else source,
            environment=None if self.environment is None else Path(self.environment),
            background=self.background,
            allow_outside=allow_outside,
            up=self.up,
        )

    def load_display(self) -> Display:
        """The display.

        Raises
        ------
        DisplayError
            As :func:`lippmann.display.load_display`.
        """
        from lippmann.display import load_display

        return load_display(self.display)
