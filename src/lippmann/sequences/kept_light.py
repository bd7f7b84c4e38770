"""The prepared light of a key frame, as far as it is that of the frames after it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.rendering.transport.path import PreparedLight


class KeptLight:
    """Keeps emitter weights, photons, light vertices, exposure and the number of specular chains of a key frame.

    All of them depend on the scene on the device and on the camera's own exposure. Photons and light vertices depend on
    the places of the light sources, too, which on a turntable go along with the display.
    """

    def __init__(self) -> None:
        self._last: tuple[PreparedLight, Scene, BuiltScene, float] | None = None

    def keep_key(
        self, prepare: Callable[[], PreparedLight], scene: Scene, built: BuiltScene, own_exposure: float
    ) -> PreparedLight:
        """The light of a key frame; parameters as :class:`~lippmann.rendering.request.render_request.RenderRequest`
        has them.
        """
        self._last = None  # the photons of two frames may not fit the memory
        light = prepare()
        self._last = light, scene, built, own_exposure
        return light

    def reuse_key(
        self, prepare: Callable[..., PreparedLight], scene: Scene, built: BuiltScene, own_exposure: float
    ) -> PreparedLight:
        """The light of a frame after the key frame: the same where it depends on nothing that has changed.

        Else it is prepared by the key frame's pilot, which decides how samples are spread, not what they show.
        """
        if self._last is None:
            return prepare()
        light, before, built_before, exposure_before = self._last
        is_placed = light.photons is not None or light.light_vertices is not None
        is_same = built is built_before and own_exposure == exposure_before
        return light if is_same and (scene is before or not is_placed) else prepare(pilot=light.pilot)


__all__ = ["KeptLight"]
