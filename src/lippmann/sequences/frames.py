"""Sequences: one integral image a frame, of a scene that moves or that the display flies through.

The display's place is held fixed over all frames: where the scene is fitted to it, the box around all that the motion
ever fills is; where it follows a camera, it stays in the same place in front of that camera. So nothing
jumps from frame to frame, and a frame is the same whether it is rendered alone or with all others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from lippmann.display import Display, load_display
from lippmann.errors import SceneError, UsageError
from lippmann.options.option import checked
from lippmann.options.placement import Mode, PlacementOptions
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import Build
from lippmann.runtime.machine import return_freed_memory
from lippmann.scene.placement import Placement, find_eye_share, options_of_sequence, place, place_at
from lippmann.scene.values.description import Camera, Matrix
from lippmann.sequences.cuts import Moment
from lippmann.sequences.flicker import add_flicker
from lippmann.sequences.forms import INTEGRAL, Form, Output, QuiltForm
from lippmann.sequences.kept_scene import KeptScene
from lippmann.sequences.key_frames import KeyFrames
from lippmann.sequences.key_light import KeyLight, LightOfSurfaces
from lippmann.sequences.motion import Motion, open_motion
from lippmann.sequences.still_pixels import StillPixels
from lippmann.sequences.tuning import TUNING

if TYPE_CHECKING:
    from lippmann.image import IntegralImage
    from lippmann.image.metadata import Provenance
    from lippmann.quilts.quilt import Quilt


@checked
@dataclass(frozen=True)
class FrameRange:
    """Frames ``first``, ``first + step``, ... before ``stop``; ``stop`` None is the motion's end.

    Raises
    ------
    UsageError
        It is empty, or a number is out of range.

    Examples
    --------
    >>> from lippmann.sequences.frames import FrameRange
    >>> FrameRange(0, 48, 2).step
    2
    """

    first: int = 0
    stop: int | None = None
    step: int = 1

    def __post_init__(self) -> None:
        if self.first < 0 or self.step < 1 or (self.stop is not None and self.stop <= self.first):
            raise UsageError(
                f"the frames {self.first} to {'the end' if self.stop is None else self.stop} in steps of {self.step}",
                parameter="frames",
                rule="FIRST:STOP or FIRST:STOP:STEP, such as 0:48 for the frames 0 to 47",
            )

    def of(self, motion: Motion) -> range:
        """The frames of a motion.

        Raises
        ------
        UsageError
            The motion ends before.
        """
        frames = range(self.first, motion.count if self.stop is None else self.stop, self.step)
        if not frames or frames[-1] >= motion.count:
            last = frames[-1] if frames else self.first
            raise UsageError(
                f"there is no frame {last}",
                parameter="frames",
                rule=f"there are {motion.count}, counted from 0",
                fix=f"ask for {self.first if self.first < motion.count else 0}:{motion.count}",
            )
        return frames


@dataclass(frozen=True)
class FramePlacements:
    """Placements of the display in all frames; called with a frame's number.

    ``camera`` is the name of the scene's camera that the display follows, if it follows one of the scene's own.
    ``warnings`` hold for all frames, in place of those of each. ``may_cut`` is that of all placements.
    """

    motion: Motion
    display: Display
    mode: Mode
    first: Matrix
    camera: str | None = None
    first_pose: Matrix | None = None
    warnings: tuple[str, ...] | None = None
    may_cut: PlacementOptions | None = None
    eye_share: float = 1.0

    def where(self, frame: int) -> tuple[Matrix, float]:
        """``world_from_display`` in a frame, and the exposure of the camera that the display follows, in stops."""
        if self.first_pose is None:
            return self.motion.display_turn(frame) @ self.first, 0.0
        camera = cast(Camera, self.motion.camera(frame, self.camera))
        return _find_pose(camera) @ np.linalg.inv(self.first_pose) @ self.first, camera.exposure

    def __call__(self, frame: int) -> Placement:
        scene = self.motion.scene(frame)
        where, exposure = self.where(frame)
        bounds, box = scene.bounds, scene.bounds_in
        placement = place_at(where, bounds, self.display, mode=self.mode, bounds_in=box, eye_share=self.eye_share)
        placement = replace(placement, exposure=exposure, may_cut=self.may_cut)
        return placement if self.warnings is None else replace(placement, warnings=self.warnings)


def place_frames(motion: Motion, display: Display, options: PlacementOptions) -> FramePlacements:
    """Place a display in a scene that moves, by one rule for all its frames.

    Raises
    ------
    UsageError, SceneError
        As :func:`lippmann.scene.placement.place`; or a flight is to be fitted.
    """
    own = motion.placement(display, options)
    if own is not None:
        return _repeat_placement(own, motion, display, warnings=own.warnings)
    camera = motion.camera(0, options.camera)
    if camera is None and options.place == "camera":
        cameras = motion.scene(0).cameras
        if not cameras:
            raise SceneError("the scene has no cameras", parameter="place", fix="fit it instead")
        options = replace(options, camera=cameras[0].name)
        camera = motion.camera(0, options.camera)
    if camera is None:
        placement = place(motion.bounds(), display, cameras=motion.scene(0).facing_cameras, options=options)
        return _repeat_placement(placement, motion, display)
    if options.place not in (None, "camera"):
        raise UsageError(
            f"placement '{options.place}' beside a flight", parameter="place", rule="the display follows the camera"
        )
    of_camera = replace(options, place="camera", camera=camera.name)
    bounds, pose = motion.bounds(), _find_pose(camera)
    placement = place(bounds, display, cameras=(camera,), options=of_camera)
    following = _repeat_placement(placement, motion, display, camera=options.camera, first_pose=pose)
    if display.stereo is None or options.depth_scale is not None:
        return following
    # One distance between the eyes for all frames, so that nothing changes its depth as they come and go.
    moments = {round(moment) for moment in np.linspace(0, motion.count - 1, TUNING.moments)}
    shares = (find_eye_share(following.where(frame)[0], bounds, display)[0] for frame in sorted(moments))
    return replace(following, eye_share=min(shares))


def _repeat_placement(placement: Placement, motion: Motion, display: Display, **values: Any) -> FramePlacements:
    """The placements of all frames that follow from the first one."""
    values |= {"may_cut": placement.may_cut, "eye_share": placement.eye_share}
    return FramePlacements(motion, display, placement.mode, placement.world_from_display, **values)


@checked
def render_sequence(
    motion: Motion,
    display: Display | str | Path = "seed-lenticular",
    frames: FrameRange | Sequence[int] = FrameRange(),
    *,
    placement: PlacementOptions | Mapping[str, object] | None = None,
    progress: ProgressCallback = silent,
    **options: object,
) -> Iterator[tuple[int, IntegralImage]]:
    """Render one integral image a frame; each is traced when it is asked for.

    Parameters
    ----------
    motion:
        What :func:`lippmann.sequences.motion.open_motion` gives.
    display:
        A display, a preset's name, or a TOML file.
    frames:
        Which frames.
    placement:
        Where the display stands during the whole sequence; a camera is followed as it moves.
    progress:
        Called with reports of each frame's stages; notes say which frame it is.
    **options:
        Further options of :func:`lippmann.render`. Each frame has a seed of its own, which follows from ``seed`` and
        its number, so noise does not stand still on the glass; ``fixed_noise=True`` holds it still.

    Yields
    ------
    int, IntegralImage
        A frame's number and picture, whose provenance has ``frame`` among its options.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong; before the first frame for what can be told then.

    Examples
    --------
    >>> from pathlib import Path
    >>> from lippmann.sequences.frames import open_motion, render_sequence
    >>> Path("flight.cam").write_text("0 0 1  0 1 0  0 0 -3   0 0 1  0 1 0  0 0 -2.9")
    45
    >>> motion, small = open_motion("teapot", camera_path=Path("flight.cam")), lippmann.load_display("mla-square")
    >>> [frame for frame, image in render_sequence(motion, small.resized(32, 32), spp=1)]
    [0, 1]
    """
    target, numbers, where = _begin(motion, display, frames, placement)
    return render_frames(motion, target, numbers, where, RenderRequest.of(options), INTEGRAL, progress)


@checked
def render_quilt_sequence(
    motion: Motion,
    display: Display | str | Path = "portrait",
    frames: FrameRange | Sequence[int] = FrameRange(),
    *,
    placement: PlacementOptions | Mapping[str, object] | None = None,
    views: tuple[int, int] | None = None,
    size: tuple[int, int] | None = None,
    progress: ProgressCallback = silent,
    **options: object,
) -> Iterator[tuple[int, Quilt]]:
    """Render one quilt a frame, each when it is asked for.

    Parameters
    ----------
    motion, frames, placement, progress:
        As of :func:`render_sequence`.
    display, views, size:
        As of :func:`lippmann.render_quilt`.
    **options:
        Further options of :func:`lippmann.render_quilt`.

    Yields
    ------
    int, Quilt
        A frame's number and quilt, whose provenance has ``frame`` among its options.

    Raises
    ------
    LippmannError
        Of the kind that says what was wrong; before the first frame for what can be told then.

    Examples
    --------
    >>> from pathlib import Path
    >>> from lippmann.sequences.frames import open_motion, render_quilt_sequence
    >>> Path("flight.cam").write_text("0 0 1  0 1 0  0 0 -3   0 0 1  0 1 0  0 0 -2.9")
    45
    >>> motion = open_motion("teapot", camera_path=Path("flight.cam"))
    >>> frames = render_quilt_sequence(motion, views=(2, 1), size=(256, 256), integrator="normal", spp=1)
    >>> [quilt.layout.columns for frame, quilt in frames]
    [2, 2]
    """
    from lippmann.quilts.quilt import quilt_of_display

    device = display if isinstance(display, Display) else load_display(str(display))
    form = QuiltForm(quilt_of_display(device, views, size))
    target, numbers, where = _begin(motion, device, frames, placement)
    return render_frames(motion, target, numbers, where, RenderRequest.of(options), form, progress)


def _begin(
    motion: Motion,
    display: Display | str | Path,
    frames: FrameRange | Sequence[int],
    placement: PlacementOptions | Mapping[str, object] | None,
) -> tuple[Display, Sequence[int], FramePlacements]:
    target = display if isinstance(display, Display) else load_display(display)
    numbers = frames.of(motion) if isinstance(frames, FrameRange) else frames
    return target, numbers, place_frames(motion, target, options_of_sequence(placement))


def render_frames(
    motion: Motion,
    display: Display,
    frames: Sequence[int],
    where: FramePlacements,
    request: RenderRequest,
    form: Form[Output],
    progress: ProgressCallback,
) -> Iterator[tuple[int, Output]]:
    """The frames of :func:`render_sequence`, in any form, once it is known where the display stands."""
    kept = KeptScene()
    request = hold_exposure(request, motion, display, where, kept.build)
    shared = choose_key_light(motion, where)
    render = make_frame_renderer(
        lambda frame: Moment(frame, motion.scene(frame), where(frame)), display, request, form, shared, kept
    )
    for position, frame in enumerate(frames):
        yield frame, render(frame, _report_frame(progress, position, len(frames)))
        return_freed_memory()  # else the next begins with the holes that the last one left


def make_frame_renderer(
    read_moment: Callable[[int], Moment],
    display: Display,
    request: RenderRequest,
    form: Form[Output],
    shared: KeyLight | None,
    kept: KeptScene,
) -> Callable[[int, ProgressCallback], Output]:
    """A function that renders frames by their numbers, best in their order: it keeps what the next one follows.

    Parameters
    ----------
    read_moment:
        Returns a frame by its number; also called for frames that others follow.
    request:
        With the exposure of all frames, see :func:`hold_exposure`.
    shared:
        Takes the light of key frames for those after them; None where all frames are traced.
    kept:
        The scene on the device.
    """

    def moment(frame: int) -> Moment:
        now = read_moment(frame)
        return now._replace(scene=kept.known(now.scene))

    def trace(now: Moment, request: RenderRequest, report: ProgressCallback) -> Output:
        return form.render(now.scene, display, replace(request, placement=now.placement), report, kept.build)

    def render_key(key: Moment, own: RenderRequest, noise_of: int) -> Provenance:
        return trace(key, give_seed(own, noise_of), silent).provenance

    keys = KeyFrames(display, moment, render_key, shared)

    def render(frame: int, report: ProgressCallback) -> Output:
        now = moment(frame)
        key = keys.before(now, request)
        own = keys.make_request(give_seed(request, keys.noise_of(frame, request)), now, key)
        image = trace(now, own, report)
        made = image.provenance
        keys.add(now, made, key)
        estimate = keys.estimate(made, key)
        # Noise that stands still has no flicker that the frames' own errors would tell.
        if not request.fixed_noise:
            shares = made.pixel_shares
            traced_error = shared.traced_error if shared is not None and shares else 1.0
            estimate = add_flicker(estimate, shares.get("traced", 1.0), traced_error=traced_error)
        return replace(image, provenance=replace(made, options={**made.options, "frame": frame}, estimate=estimate))

    return render


def hold_exposure(
    request: RenderRequest, motion: Motion, display: Display, where: FramePlacements, build: Build | None = None
) -> RenderRequest:
    """``request`` with the exposure that suits the motion's first frame, whichever frames are rendered."""
    scene = motion.scene(0)
    if request.exposure != "auto" or not scene.has_physical_lights:
        return request
    from lippmann.rendering.picture import choose_exposure

    still = replace(request, placement=where(0), fixed_noise=False)
    return replace(request, exposure=choose_exposure(scene, display, still, build))


def choose_key_light(motion: Motion, where: FramePlacements) -> KeyLight | None:
    """How frames reuse a key frame's light; None where the display takes the light along, as on turntables."""
    if where.first_pose is not None:
        return LightOfSurfaces()
    return StillPixels() if np.array_equal(motion.display_turn(1), np.eye(4)) else None


def give_seed(request: RenderRequest, number: int) -> RenderRequest:
    """The request of one frame: with a seed that follows from its number, unless noise is to stand still.

    With the same seed in all frames, noise stands on the glass like dirt.
    """
    seed = request.seed
    if not request.fixed_noise:
        seed = int(np.random.SeedSequence((seed, number)).generate_state(1)[0])
    return replace(request, seed=seed, fixed_noise=False)


def _report_frame(progress: ProgressCallback, position: int, frames: int) -> ProgressCallback:
    """Reports of one frame's tracing as reports of the whole sequence, which never run backwards."""
    done = float(position)

    def report(inner: Progress) -> None:
        nonlocal done
        if inner.stage == "trace":
            done = max(done, position + inner.done / inner.total)
        progress(Progress("sequence", done, frames, f"frame {position + 1} of {frames}"))

    return report


def _find_pose(camera: Camera) -> Matrix:
    return np.asarray(camera.world_from_camera, np.float64)


__all__ = [
    "FrameRange",
    "Motion",
    "open_motion",
    "place_frames",
    "render_quilt_sequence",
    "render_sequence",
]
