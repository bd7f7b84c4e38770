"""Provenance of a picture for its file: choices, costs, estimated error, and notes on missing or clamped light."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann._version import VERSION
from lippmann.image.metadata import Provenance
from lippmann.options.choices import LIGHT
from lippmann.options.option import Options
from lippmann.options.quality import QualityOptions
from lippmann.options.texts import settings_of
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.request.tuning import TUNING
from lippmann.rendering.session import Session, Stopwatch, find_uniform_background
from lippmann.scene.values.description import Color

if TYPE_CHECKING:
    from lippmann.rendering.estimate.psnr import Estimate
    from lippmann.rendering.film.wavefront import Frame, RayTotals

#: Least share of pixels that show the scene; pictures below it carry a warning.
LEAST_SHARE = 0.01


def make_provenance(
    session: Session,
    frame: Frame,
    *,
    samples: int,
    options: Mapping[str, object],
    choices: Mapping[str, object],
    estimate: Estimate | None = None,
    notes: tuple[str, ...] = (),
    has_pixels: bool = True,
) -> Provenance:
    """The provenance of a picture, for its file.

    ``choices`` are those of the integrator's prepared light. ``has_pixels`` says that the frame holds the picture, not
    its size alone.
    """
    request = session.request
    height, width = frame.pixels.shape[:2]
    rays, work = frame.rays, height * width * samples * request.channels
    assert request.plan is not None  # of a resolved request
    plan = request.plan.with_pilot(choices).lines()
    return Provenance(
        method=request.method,
        integrator=request.integrator,
        depth=request.surfaces,
        spp=samples,
        seed=request.seed,
        subpixels=bool(request.subpixels),
        scene=session.scene.name,
        transfer=request.transfer,
        version=VERSION,
        device=session.engine.gpu_name or "cpu",
        traced_fraction=rays.primary / work,
        pixel_shares=frame.shares,
        rays={"primary": rays.primary, "shadow": rays.shadow, "secondary": rays.secondary},
        seconds=_stage_seconds(session.watch, frame),
        estimate=describe_estimate(estimate, choices),
        options={**options, **choices, "plan": plan, "settings": _settings(session)},
        notes=(
            *session.notes,
            *notes,
            *describe_light(request, estimate, samples, choices),
            *_frame_notes(frame),
            *_warn_of_emptiness(session, frame, has_pixels),
        ),
    )


def _settings(session: Session) -> list[str]:
    """Every option that is not at its default, as it was decided."""
    request, scene = session.request, session.scene
    parts = (scene.light, request.placement, QualityOptions.part_of(request))
    return [*scene.settings, *(line for part in parts if isinstance(part, Options) for line in settings_of(part))]


def _warn_of_emptiness(session: Session, frame: Frame, has_pixels: bool) -> tuple[str, ...]:
    if session.request.integrator not in LIGHT:
        return ()
    background = find_uniform_background(session.built, session.request)
    scene = getattr(session.built, "mitsuba", None)
    if background is None and scene is not None and scene.environment() is None:
        background = (0.0, 0.0, 0.0)
    by_rays = background is None or not has_pixels
    if by_rays and (session.scene.keeps_its_colors or (background is not None and max(background) == 0.0)):
        return ()  # paths end at glowing surfaces as at the background: nothing tells them apart
    return warn_of_emptiness(measure_visible_share(frame.pixels if has_pixels else None, background, frame.rays))


def _stage_seconds(watch: Stopwatch, frame: Frame) -> dict[str, float]:
    """Seconds by stage, in the order of the work; ``write`` is added by the writer of the file."""
    return {
        "load": watch.seconds.get("load", 0.0),
        "build": watch.seconds.get("build", 0.0),
        "compile": frame.seconds_compile,
        "trace": frame.seconds_trace,
        "reuse": frame.seconds_reuse,
        **{name: watch.seconds[name] for name in ("denoise", "layers") if name in watch.seconds},
        "write": 0.0,
        "total": watch.total,
    }


def _frame_notes(frame: Frame) -> tuple[str, ...]:
    if not frame.rays.discarded:
        return ()
    return (f"{frame.rays.discarded} samples were not finite and count as black",)


def describe_estimate(estimate: Estimate | None, choices: Mapping[str, object]) -> dict[str, object] | None:
    """The estimate as metadata; None where the samples miss light that their differences cannot reveal.

    Parameters
    ----------
    estimate:
        None where there is none.
    choices:
        Decisions for the picture by option name; ``caustics`` counts here.
    """
    if estimate is None or _misses_caustics(choices):
        return None
    return estimate.to_dict()


def is_among_mirrors(choices: Mapping[str, object]) -> bool:
    """Whether sharp surfaces may reflect emitters so small that samples miss them: wherever photons bring caustics."""
    return choices.get("caustics", "paths") != "paths"


def describe_light(
    request: RenderRequest, estimate: Estimate | None, samples: int, choices: Mapping[str, object]
) -> tuple[str, ...]:
    """Sentences on the light of a picture that was made by ``request``; ``samples`` are those of each pixel."""
    notes = []
    if request.exposure == "auto" and "exposure" in choices:
        notes.append(f"exposure {choices['exposure']:+.2f} EV: physical light, its median at mid-grey")
    if request.exposure == "auto" and "camera_exposure" in choices:
        own = choices["camera_exposure"]
        notes.append(f"the camera's own exposure ({own:+.2f} EV) counts with a fixed one alone (exposure=0)")
    if _misses_caustics(choices):
        notes.append(
            "no estimate of the error: paths hardly find what mirrors, glass or gloss throw onto other surfaces from "
            "emitters as small as here; photons bring it (caustics)"
        )
    if estimate is not None and samples < TUNING.usual and is_among_mirrors(choices):
        notes.append(
            f"fewer than {TUNING.usual} samples may all have missed bright light among mirrors: intervals "
            "of the PSNR reach down farther"
        )
    if request.clamp_indirect is not None:
        notes.append(
            f"indirect light above {request.clamp_indirect:g} is cut off: bright light is lost, not only noise"
        )
    return tuple(notes)


def _misses_caustics(choices: Mapping[str, object]) -> bool:
    return choices.get("caustics") == "paths"


def measure_visible_share(pixels: NDArray[np.float32] | None, background: Color | None, rays: RayTotals) -> float:
    """Share of a picture's pixels that may show something of the scene, at most 1.

    Parameters
    ----------
    pixels:
        ``(height, width, 3)`` linear radiance; None where the picture is not at hand.
    background:
        What rays see that meet nothing; None where that differs from ray to ray.
    rays:
        Rays traced for the picture, or for the part of it that was traced.

    Returns
    -------
    float
        The share of pixels unlike the background. Where that is not known, the rays that go on from surfaces over the
        primary ones: an upper bound, as every sample that meets a surface sends at least one, black surfaces apart.
    """
    if pixels is not None and background is not None:
        step = max(1, len(pixels) // 1024)  # a sample of the rows suffices
        unlike = np.abs(pixels[::step] - np.asarray(background, dtype=np.float32)) > 1e-3
        return float(unlike.any(axis=-1).mean())
    return min(1.0, (rays.shadow + rays.secondary) / max(1, rays.primary))


def warn_of_emptiness(share: float) -> tuple[str, ...]:
    """Warning of a picture in which hardly any pixel shows the scene; else empty."""
    if share >= LEAST_SHARE:
        return ()
    content = "nothing" if share == 0 else f"{100 * share:.1f} % of it shows anything"
    fix = 'place the scene by camera, turn, scale or shift, or light it by environment="studio"'
    return (f"the picture is nearly empty ({content}): {fix}",)
