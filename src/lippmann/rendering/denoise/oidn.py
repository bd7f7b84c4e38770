"""Denoising by Intel's Open Image Denoise, from the package ``pyoidn``.

The network is trained on pictures of path tracers. Guides (albedo and normal of what each pixel sees) show it the edges
of the scene. It runs on the GPU if the engine does; else on the CPU, with threads of its own beside Dr.Jit's.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack, closing
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import EngineError, UsageError
from lippmann.rendering.film.memory_model import NETWORK_MOST
from lippmann.runtime import engine, machine
from lippmann.runtime import open_image_denoise as library
from lippmann.runtime.engine_lock import exclusive

FloatArray = NDArray[np.float32]
#: Between the two lies "balanced": with clean guides 0.5 dB better than "fast" for twice its time, without them the
#: same as "high".
Effort = Literal["high", "fast"]

#: Side of the squares of pixels that the network processes together: it halves pictures four times.
NETWORK_STEP = 16


def denoise(
    color: NDArray[np.generic],
    albedo: NDArray[np.generic] | None = None,
    normal: NDArray[np.generic] | None = None,
    *,
    clean_guides: bool = False,
    effort: Effort = "high",
    rotated: bool = False,
    threads: int | None = None,
) -> FloatArray:
    """The denoised picture.

    Parameters
    ----------
    color:
        ``(H, W, 3)`` linear RGB, finite; white is 1.
    albedo, normal:
        Guides of the same shape: reflectance in [0, 1], and vectors with components in [-1, 1] of any frame (the zero
        vector where nothing is seen). They may be noisy. A normal needs an albedo beside it.
    clean_guides:
        Whether the guides hold no noise: the network then keeps their finest detail. With the effort ``high`` that
        takes twice the time.
    effort:
        ``fast`` takes half the time of ``high``, a fifth with clean guides, for about 1 dB.
    turned:
        Rotate the network's input by 180 degrees, and its output back. The network's errors then differ, so that they
        partly cancel in the mean of a rotated and an unrotated result.
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
    images = {"color": _wrap_picture(color, "color")}
    for name, guide in (("albedo", albedo), ("normal", normal)):
        if guide is not None:
            images[name] = _wrap_picture(guide, name)
            if images[name].shape != images["color"].shape:
                rule = f"that of the picture is {images['color'].shape}"
                raise UsageError(f"the {name} has the shape {images[name].shape}", parameter="denoise", rule=rule)
    options = {
        "hdr": True,
        "cleanAux": clean_guides and albedo is not None,
        # White is 1, in every part of a picture and however bright it is.
        "inputScale": 1.0,
        "maxMemoryMB": NETWORK_MOST >> 20,
        "quality": library.QUALITIES[effort],
    }
    load_denoiser()
    height, width = images["color"].shape[:2]
    if rotated:
        images = {name: _rotate(images.pop(name)) for name in list(images)}  # frees each unturned image
    # One device serves one filter at a time, and its threads do not survive a fork.
    with exclusive():
        result = _filter_images(images, options, threads or machine.usable_cores())
    if not rotated:
        return result
    return np.ascontiguousarray(result[-height:, -width:][::-1, ::-1])


def _rotate(image: FloatArray) -> FloatArray:
    """The image rotated by 180 degrees and padded to whole steps of the network by reflection.

    So the network groups the same pixels as without rotation. Repeated pixels would look like an object to it.
    """
    height, width = image.shape[:2]
    before = (-height % NETWORK_STEP, 0), (-width % NETWORK_STEP, 0), (0, 0)
    return np.pad(image[::-1, ::-1], before, mode="reflect")


def _wrap_picture(values: NDArray[np.generic], name: str) -> FloatArray:
    """Packed float32, as the C library takes it."""
    array = np.ascontiguousarray(values, dtype=np.float32)
    if array.ndim != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise UsageError(f"the {name} has the shape {array.shape}", parameter="denoise", rule="it must be (H, W, 3)")
    if not np.isfinite(array).all():
        # The network would spread a single NaN over the pixels around it.
        raise UsageError(f"the {name} holds values that are not finite", parameter="denoise", fix="replace them")
    return array


def load_denoiser() -> None:
    """Load the library, so that a missing one is reported before anything is rendered.

    Raises
    ------
    UsageError
        It is not installed.
    EngineError
        It does not load.
    """
    if not machine.has_denoiser():
        raise UsageError(
            "Open Image Denoise is not installed", parameter="denoise", fix='install it: pip install "pyoidn>=2.5"'
        )
    try:
        library.load()
    except OSError as error:
        raise _failure(str(error)) from error


def denoiser_version() -> str | None:
    """Versions of Open Image Denoise and its package, such as ``2.5.1 (pyoidn 2.5.1.0)``; None if it cannot be used."""
    from importlib.metadata import version

    try:
        load_denoiser()
    except (UsageError, EngineError):  # not installed, or a library that does not load: reported where it is used
        return None
    with closing(library.Device(library.DEVICE_TYPE_CPU)) as device:
        # The library's own numbers: packages of one version may hold different ones.
        numbers = [device.number(f"version{part}") for part in ("Major", "Minor", "Patch")]
    return f"{'.'.join(map(str, numbers))} (pyoidn {version('pyoidn')})"


# ---- Devices: the GPU if the engine runs there, else the CPU ----

#: Devices by their number of CPU threads, None for the GPU's. Each is made once: that takes longer than to denoise a
#: small picture.
_devices: dict[int | None, library.Device] = {}


def _filter_images(images: dict[str, FloatArray], options: Mapping[str, float], threads: int) -> FloatArray:
    """Output of a filter for ``images``, packed ``(H, W, 3)``, by the filter's input names.

    Falls back to the CPU where the GPU fails, for example for lack of memory.

    Raises
    ------
    EngineError
        Open Image Denoise fails on the CPU.
    """
    if engine.runs_on_gpu() and library.is_cuda_available():
        try:
            return _denoise_on_gpu(images, options)
        except EngineError:
            pass
    return _denoise_on_cpu(images, options, threads)


def _denoise_on_cpu(images: dict[str, FloatArray], options: Mapping[str, float], threads: int) -> FloatArray:
    output = np.empty_like(next(iter(images.values())))
    # Dr.Jit's threads share the cores: pinned ones would wait for each other.
    device = _make_device(threads, library.DEVICE_TYPE_CPU, numThreads=threads, setAffinity=False)
    with library.open_filter(device, images, options) as work:
        for name, image in (*images.items(), ("output", output)):
            work.set_image(name, image)
        work.run()
        _check(device)
    return output


def _denoise_on_gpu(images: dict[str, FloatArray], options: Mapping[str, float]) -> FloatArray:
    """As :func:`_filter_images`, on copies in the memory of the GPU."""
    output = np.empty_like(next(iter(images.values())))
    device = _make_device(None, library.DEVICE_TYPE_CUDA)
    with ExitStack() as stack:
        work = stack.enter_context(library.open_filter(device, images, options))
        for name, image in (*images.items(), ("output", output)):
            buffer = stack.enter_context(closing(library.Buffer(device, image.nbytes)))
            _check(device)
            if image is not output:
                buffer.write(image)
            work.set_image(name, image, buffer)
        work.run()
        _check(device)
        buffer.read(output)
        _check(device)
    return output


def _make_device(threads: int | None, kind: int, **options: int) -> library.Device:
    if threads not in _devices:
        device = library.Device(kind, **options)
        _check(device)
        _devices[threads] = device
    return _devices[threads]


def _check(device: library.Device) -> None:
    message = device.error()
    if message:
        raise _failure(message)


def _failure(message: str) -> EngineError:
    return EngineError(f"Open Image Denoise fails: {message}", parameter="denoise", fix='render with denoise="none"')
