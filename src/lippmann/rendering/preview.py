"""The plain picture that a camera of the scene sees."""

from __future__ import annotations

import numpy as np

from lippmann.image.preview import Preview
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.provenance import make_provenance
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session, read_choices
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.camera_placement import remove_scale
from lippmann.scene.scene import Scene


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

    from lippmann.rendering.methods import Job, trace_without_estimate
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
    traced = trace_without_estimate(Job(session, integrator, source, frame_from_world))
    session.watch.seconds.update(traced.seconds)
    options = {"pixel_filter": request.pixel_filter, "camera": pose.name, **traced.options}
    choices = read_choices(integrator)
    provenance = make_provenance(session, traced.frame, samples=traced.samples, options=options, choices=choices)
    return Preview(request.tone_mapped(traced.frame.pixels), provenance)
