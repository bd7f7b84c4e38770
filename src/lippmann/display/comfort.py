"""Whether two eyes fuse the depth of a scene in front of a display, in words."""

from __future__ import annotations

import math

from lippmann.display.display import Display
from lippmann.display.stereo import COMFORTABLE, EYE_DISTANCE, depth_of_disparity, disparity

#: Crossed and uncrossed disparity in degrees that 84 % of 392 viewers fuse: S. Nagata, "Distributions of 'vergence
#: fusional stereoscopic limit'", Trans. VR Soc. Japan 7 (2002).
FUSED = 1.84, 2.04


def fusion_warning(display: Display, back: float, front: float) -> str:
    """One line if a scene from z = ``back`` to ``front`` mm has more disparity than eyes fuse; else empty."""
    distance = display.viewing_distance
    if math.isinf(distance) or _lies_within(FUSED, display, back, front):
        return ""
    near, far = depth_of_disparity(*FUSED, distance, eyes_of_viewer(display))
    fused = f"{far:.0f} to {near:.0f} mm" if math.isfinite(far) else f"all up to {near:.0f} mm"
    return (
        f"the scene reaches from {back:.0f} to {front:.0f} mm; from {distance:.0f} mm away most eyes fuse {fused}, "
        "what lies beyond is seen double: flatten or shift it"
    )


def _lies_within(limits: tuple[float, float], display: Display, back: float, front: float) -> bool:
    """Whether a scene has at most these crossed and uncrossed degrees of disparity, to a nanometre of depth."""
    near, far = depth_of_disparity(*limits, display.viewing_distance, eyes_of_viewer(display))
    return far - 1e-6 <= back and front <= near + 1e-6


def eyes_of_viewer(display: Display) -> float:
    """Distance between the eyes of a display's viewer in mm."""
    return EYE_DISTANCE if display.stereo is None else display.stereo.eyes


def comfort_in_words(display: Display, back: float, front: float) -> str:
    """Disparity of a scene from z = ``back`` to ``front`` mm, and whether it is comfortable.

    Empty where the viewing distance is infinite.
    """
    distance, eyes = display.viewing_distance, eyes_of_viewer(display)
    if math.isinf(distance) or front >= distance:
        return ""
    behind, before = (disparity(z, distance, eyes) for z in (back, front))
    verdict = "strains" if _lies_within(FUSED, display, back, front) else "too much to fuse"
    if _lies_within((COMFORTABLE, COMFORTABLE), display, back, front):
        verdict = "comfortable"
    return (
        f"{verdict}: disparity from {behind:.2f} degrees at the back to {before:.2f} at the front, seen from "
        f"{distance:.0f} mm with eyes {eyes:.0f} mm apart (up to {COMFORTABLE:.0f} is comfortable, up to "
        f"{FUSED[0]:.1f} fuses)"
    )
