"""Noise taken out of a picture by Intel's Open Image Denoise, in the package ``pyoidn``.

That is a neural network which knows pictures of path tracers; guides (albedo and normal of what each pixel sees) tell
it which edges are the scene's. It runs on the GPU if the engine does; else on the CPU, with threads of its own beside
Dr.Jit's: neither pins them to cores.
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import UsageError
from lippmann.rendering.denoise.oidn_device import filtered
from lippmann.runtime import machine
from lippmann.runtime.engine_lock import exclusive

if TYPE_CHECKING:
    from pyoidn import Filter as OidnFilter

FloatArray = NDArray[np.float32]
Effort = Literal["high", "fast"]

#: The network's names of the qualities. In between lies "balanced": with clean guides 0.5 dB better than "fast" for
#: twice its time, without them the same as "high".
_QUALITY = {"high": "OIDN_QUALITY_HIGH", "fast": "OIDN_QUALITY_FAST"}

#: The network halves pictures four times: the pixels of such squares are seen together.
NETWORK_STEP = 16


def denoise(
    color: NDArray[np.generic],
    albedo: NDArray[np.generic] | None = None,
    normal: NDArray[np.generic] | None = None,
    *,
    clean_guides: bool = False,
    exposure: float | None = None,
    effort: Effort = "high",
    turned: bool = False,
    threads: int | None = None,
) -> FloatArray:
    """The picture without its noise.

    Parameters
    ----------
    color:
        ``(H, W, 3)`` linear RGB, finite.
    albedo, normal:
        Guides of the same shape: reflectance in [0, 1], and vectors with components in [-1, 1] of any frame (the zero
        vector where nothing is seen). They may be noisy. A normal needs an albedo beside it.
    clean_guides:
        The guides hold no noise: finer detail is kept, and so would noise be. With the effort
        ``high`` that takes twice the time.
    exposure:
        What values are multiplied by for the network, and divided by again: the same for all parts of one picture. None
        suits it to the picture's brightness.
    effort:
        ``fast`` takes half the time of ``high``, a fifth with clean guides, for about 1 dB.
    turned:
        The network is shown all upside down and from right to left. What it gets wrong it gets wrong another way then,
        so that the mean of two pictures of which one was turned is nearer to the truth.
    threads:
        CPU threads; None for all cores that the process may use.

    Returns
    -------
    ``(H, W, 3)`` float32; the arguments are left as they are.

    Raises
    ------
    UsageError
        ``pyoidn`` is missing, or an argument is not as said above.
    EngineError
        Open Image Denoise fails.
    """
    if albedo is None and normal is not None:
        raise UsageError(
            "a normal without an albedo is no guide", parameter="denoise", fix="give both, or the albedo alone"
        )
    if effort not in get_args(Effort):
        raise UsageError.unknown("effort", effort, get_args(Effort), parameter="effort")
    images = {"color": _picture(color, "color")}
    for name, guide in (("albedo", albedo), ("normal", normal)):
        if guide is not None:
            images[name] = _picture(guide, name)
            if images[name].shape != images["color"].shape:
                rule = f"that of the picture is {images['color'].shape}"
                raise UsageError(f"the {name} has the shape {images[name].shape}", parameter="denoise", rule=rule)
    options = {"hdr": True, "cleanAux": clean_guides and albedo is not None}
    if not turned:
        return _filtered(images, options, effort, threads, exposure)
    shown = {name: _turned(image) for name, image in images.items()}
    height, width = images["color"].shape[:2]
    result = _filtered(shown, options, effort, threads, exposure)[-height:, -width:]
    return np.ascontiguousarray(result[::-1, ::-1])


def _turned(image: FloatArray) -> FloatArray:
    """Upside down and from right to left.

    It is filled up to whole steps, so that the network sees the same pixels together as else; mirrored, for it would
    take pixels that are repeated for something that is there.
    """
    height, width = image.shape[:2]
    before = (-height % NETWORK_STEP, 0), (-width % NETWORK_STEP, 0), (0, 0)
    return np.pad(image[::-1, ::-1], before, mode="reflect")


def _picture(values: NDArray[np.generic], name: str) -> FloatArray:
    """Packed float32, as the C library wants it."""
    array = np.ascontiguousarray(values, dtype=np.float32)
    if array.ndim != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise UsageError(f"the {name} has the shape {array.shape}", parameter="denoise", rule="it must be (H, W, 3)")
    if not np.isfinite(array).all():
        # The network would smear a single one over its whole neighbourhood.
        raise UsageError(f"the {name} holds values that are not finite", parameter="denoise", fix="replace them")
    return array


def _filtered(
    images: dict[str, FloatArray],
    options: dict[str, bool],
    effort: Effort,
    threads: int | None,
    exposure: float | None = None,
) -> FloatArray:
    pyoidn = load_denoiser()

    def set_up(work: OidnFilter) -> None:
        for name, value in options.items():
            work.set_bool(name, value)
        if exposure is not None:
            work.set_float("inputScale", exposure)
        work.set_quality(getattr(pyoidn, _QUALITY[effort]))

    # One device serves one filter at a time, and its threads do not survive a fork.
    with exclusive():
        return filtered(pyoidn, images, set_up, threads or machine.usable_cores())


def load_denoiser() -> ModuleType:
    """The library, so that it is known to be there before anything is rendered.

    Raises
    ------
    UsageError
        It is not installed.
    """
    try:
        import pyoidn
    except ImportError:
        raise UsageError(
            "Open Image Denoise is not installed", parameter="denoise", fix='install it: pip install "pyoidn>=2.5"'
        ) from None
    module: ModuleType = pyoidn
    return module


def denoiser_version() -> str | None:
    """Versions of Open Image Denoise and its package, such as ``2.5.1 (pyoidn 2.5.1.0)``; None if it cannot be used."""
    from importlib.metadata import version

    try:
        pyoidn = load_denoiser()
        with pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CPU) as device:
            # The library's own numbers: packages of one version may hold different ones.
            numbers = [device.get_int(f"version{part}") for part in ("Major", "Minor", "Patch")]
    except (UsageError, OSError):  # not installed, or a library that does not load: reported where it is used
        return None
    return f"{'.'.join(map(str, numbers))} (pyoidn {version('pyoidn')})"
