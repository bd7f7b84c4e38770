"""What a picture's file says of its light: exposure, light that is missing or cut off, and what its error may hide."""

from __future__ import annotations

from collections.abc import Mapping

from lippmann.rendering.estimate.psnr import Estimate
from lippmann.rendering.estimate.tuning import TUNING
from lippmann.rendering.request.render_request import RenderRequest


def stated_error(estimate: Estimate | None, choices: Mapping[str, object]) -> dict[str, object] | None:
    """The estimate as files hold it; None where light is missing that no difference between samples tells of.

    Parameters
    ----------
    estimate:
        None where there is none.
    choices:
        What was chosen for the picture, by the names of its options, and found: ``caustics`` here.
    """
    if estimate is None or _misses_caustics(choices):
        return None
    return estimate.to_dict()


def is_among_mirrors(choices: Mapping[str, object]) -> bool:
    """Whether sharp surfaces may mirror emitters so small that samples miss them.

    Caustics tell that are not left to paths.
    """
    return choices.get("caustics", "paths") != "paths"


def light_notes(
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
    if estimate is not None and samples < TUNING.few_among_mirrors and is_among_mirrors(choices):
        notes.append(
            f"fewer than {TUNING.few_among_mirrors} samples may all have missed bright light among mirrors: intervals "
            "of the PSNR reach down farther"
        )
    if request.clamp_indirect is not None:
        notes.append(
            f"indirect light above {request.clamp_indirect:g} is cut off: bright light is lost, not only noise"
        )
    return tuple(notes)


def _misses_caustics(choices: Mapping[str, object]) -> bool:
    return choices.get("caustics") == "paths"
