"""The plain picture that a camera of the scene sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.png import encode_png
from lippmann.color.transfer import quantize
from lippmann.image.metadata import Provenance
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.provenance import make_provenance
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.camera_placement import remove_scale
from lippmann.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Preview:
    """A plain picture: ``pixels`` ``(height, width, 3)`` float32 linear RGB, with how it was made."""

    pixels: NDArray[np.float32]
    provenance: Provenance

    def __repr__(self) -> str:
        return f"<Preview {self.pixels.shape[1]} x {self.pixels.shape[0]} pixels>"

    def _repr_png_(self) -> bytes:
        """The picture as PNG, for notebooks."""
        transfer = self.provenance.transfer
        return encode_png(quantize(self.pixels, 8, transfer), text={}, srgb=transfer == "srgb")


@exclusive()
def render_preview(
    scene: Scene, camera: str | None, size: tuple[int, int], request: RenderRequest, progress: ProgressCallback = silent
) -> Preview:
    """Render what ``camera`` sees in ``size`` (width, height) pixels.

    The camera None is the scene's first one, or one that frames a scene without any.

    Raises
    ------
    UsageError, SceneError, MemoryLimitError, EngineError
        As the stages find them.
    """
    request = resolve(request, scene, form="preview")
    session = open_session(scene, request, size, progress=progress)
    pose = scene.camera(camera)

    from lippmann.rendering.methods import Job, trace_unjudged
    from lippmann.rendering.transport.ray_source import CameraRays, OnePicture
    from lippmann.rendering.transport.whitted_camera import WhittedCameraRays

    source: OnePicture
    if request.integrator == "classic" and scene.classic is not None:
        # Its own camera, with all that only such a camera does.
        source = WhittedCameraRays(scene.classic.camera, scene.classic.handedness, *size)
    else:
        source = CameraRays(pose, *size)
    session.face_viewer(remove_scale(pose))
    frame_from_world = np.linalg.inv(np.asarray(pose.world_from_camera, dtype=np.float64))
    integrator = session.integrator(source, frame_from_world, pose.exposure)
    traced = trace_unjudged(Job(session, integrator, source, frame_from_world))
    session.watch.seconds.update(traced.seconds)
    options = {"pixel_filter": request.pixel_filter, "camera": pose.name, **traced.options}
    provenance = make_provenance(session, traced.frame, samples=traced.samples, options=options)
    return Preview(request.tone_mapped(traced.frame.pixels), provenance)
