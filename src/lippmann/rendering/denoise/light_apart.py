"""Light that goes past the denoiser.

Seen light, where the renderer keeps it apart, has hardly any noise, and highlights that a denoiser takes for such: it
goes past the network and past what is shared. Where it is far beyond white, so does other light as far as it is: the
skirt of a narrow lobe is not sharp, and shows enough of a mirrored emitter for the network to make the pixels beside it
white, too. The noise of what is beyond white is not seen.

The network is shown nothing that is far beyond white: it would make the pixels around one path white that has happened
upon an emitter. A pixel that is as bright all the same after it is as bright as its samples.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
#: What is above this linear value the network is not shown. From 4 to 16 the PSNR of the bundled scenes moves by 0.1 dB
#: at most (docs/research/seen-light.md).
FAR_BEYOND_WHITE = 8.0
#: Part of that from which on what the network makes of a pixel is taken to be still as bright.
_STILL_FAR = 0.75


def clean_light(
    noisy: Floats, seen: Floats | None, denoise: Callable[[Floats], Floats], share: Callable[[Floats], Floats] | None
) -> list[Floats]:
    """What was traced without its noise; and, where light is shared, with shared light as well.

    Parameters
    ----------
    noisy:
        ``(H, W, 3)`` linear.
    seen:
        What of it is seen light; None where that is not known.
    denoise:
        From a noisy picture to a clean one.
    share:
        From a clean picture to one whose parts share their light; None where they do not.

    Returns
    -------
    list
        Pictures of the shape of ``noisy``: one, or two.
    """
    limit = np.float32(FAR_BEYOND_WHITE)
    rest, past, cut = noisy, None, None
    if seen is not None:
        past = seen + np.where(seen > limit, np.maximum(noisy - seen - limit, 0), np.float32(0))
        rest = noisy - past
    if (rest > limit).any():
        cut = np.maximum(rest - limit, np.float32(0))
        rest = np.minimum(rest, limit)
    clean = denoise(rest)
    found = []
    for version in [clean] if share is None else [clean, share(clean)]:
        whole = version
        if cut is not None:
            whole = whole + np.where(version >= np.float32(_STILL_FAR) * limit, cut, np.float32(0))
        found.append(whole if past is None else whole + past)
    return found


def remove_excess(picture: Floats, excess: Floats | None) -> Floats:
    """``picture`` without what of it rests on single chains of seen light, not below 0."""
    return picture if excess is None else np.maximum(picture - excess, np.float32(0))
