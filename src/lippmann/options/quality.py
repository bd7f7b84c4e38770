"""How well, and by which light, a picture is rendered; and on what it runs."""

import sys
from dataclasses import dataclass
from functools import partial
from typing import Literal, TypedDict

from lippmann.errors import UsageError
from lippmann.options import texts
from lippmann.options.choices import (
    Caustics,
    Denoiser,
    Device,
    Effort,
    Integrator,
    Method,
    Order,
    PixelFilter,
    ToneMap,
)
from lippmann.options.option import Options, option

#: Stops of the largest exposure, up or down.
MOST_EXPOSURE = 40
#: Samples per pixel beyond which another one is lost in the rounding of single precision sums.
MOST_SAMPLES = 1 << 24

_scene = partial(option, group="Scene")
_light = partial(option, group="Light")
_quality = partial(option, group="Quality")
_machine = partial(option, group="Machine")
_DECIBELS = {"low": 0.0, "excludes_low": True, "high": 80.0, "rule": "must be above 0 and at most 80 dB"}


@dataclass(frozen=True)
class QualityOptions(Options):
    """How a picture is rendered. Whatever is left "auto" or None is decided by the plan of the render.

    Raises
    ------
    UsageError
        A value is unknown or out of its range, or two contradict each other.
    """

    integrator: Integrator = _scene(
        "auto",
        "path (all light), direct (emitters and sky only), classic (Whitted ray tracing: light of Tachyon and NFF "
        "scenes), or normal, depth, position, albedo of the first surface. By default what the scene was made for.",
        door="lippmann.options.integrators:INTEGRATORS",
    )
    depth: int | None = _scene(
        None,
        "Surfaces a path may meet; the primary ray's counts 1. By default 8 for path, 1 for direct, the file's own for "
        "classic.",
        low=1,
        high=4096,
    )
    exposure: float | Literal["auto"] = _light(
        "auto",
        "Stops (EV) by which light is raised or lowered. auto: 0; for files with physical light sources as many as "
        "bring the median of what is lit to mid-grey.",
        first=True,
        low=-MOST_EXPOSURE,
        high=MOST_EXPOSURE,
        rule=f"must be 'auto', or stops from {-MOST_EXPOSURE} to {MOST_EXPOSURE}",
        read=texts.exposure,
    )
    tone_map: ToneMap = _light(
        "auto",
        "pbr-neutral: highlights are compressed, not clipped; none: light as it is. auto: pbr-neutral for physically "
        "based light without `background`, none in files of linear light (EXR, 32 bits).",
    )
    effort: Effort = _quality(
        "normal",
        "draft: a first look, one sample a pixel and the fast network; normal: as the picture's size suggests, or as "
        "`spp`, `quality` or `max_time` say; final: until it is estimated at 40 dB, as for a print.",
        first=True,
    )
    quality: float | None = _quality(
        None,
        "Work until the picture is estimated to reach this PSNR in dB, such as 40, and no micro-image is worse by over "
        "12 dB.",
        first=True,
        **_DECIBELS,
    )
    quality_worst: float | None = _quality(
        None, "Work until every micro-image is estimated to reach this PSNR; takes longer.", **_DECIBELS
    )
    max_time: float | None = _quality(
        None,
        "Be done after so many seconds, loading and writing included.",
        first=True,
        low=0.0,
        excludes_low=True,
        high=sys.float_info.max,
        rule="must be seconds above 0",
    )
    spp: int | None = _quality(
        None,
        "Samples per pixel, or per sub-pixel. By default 2 to 16 as the picture's size suggests, 16 where light is not "
        "pooled, for classic as the scene has it.",
        first=True,
        low=1,
        high=MOST_SAMPLES,
    )
    method: Method = _quality(
        "auto",
        "auto: pooled where light has noise, else full; full: every ray is traced, for references; lens-view: points "
        "are reprojected from lens to lens and missed pixels traced; interpolated: those of every other lens are "
        "averaged; pooled: noise is taken out, and all lenses that see a point share its light.",
    )
    denoise: Denoiser = _quality(
        "auto",
        "none, or oidn: take the noise out with Open Image Denoise, with the effort that the samples deserve "
        "(oidn-fast and oidn-high: with a given one). auto: with `method` pooled, which auto takes.",
        metavar="[auto|none|oidn]",
    )
    caustics: Caustics = _quality(
        "auto",
        "Light that mirrors and glass throw onto other surfaces. photons: sent by the emitters; paths: as paths find "
        "it; none: without. auto: photons where there is such light.",
    )
    seed: int = _quality(0, "Of all random choices.", low=0, high=2**32 - 1)
    subpixels: bool | None = option(
        None, "A ray for every sub-pixel, at its own place. By default behind slanted sheets.", group="Display"
    )
    pixel_filter: PixelFilter = _quality(
        "auto", "box: over the pixel; point: at its centre. By default box, but for classic."
    )
    clamp_indirect: float | None = _quality(
        None,
        "Cut indirect light off above this, 1 being white: against fireflies, at the cost of true light.",
        metavar="RADIANCE",
        low=0.0,
        excludes_low=True,
        high=sys.float_info.max,
        rule="must be radiance above 0, 1 being white",
    )
    order: Order | None = _quality(
        None, "For lens-view and interpolated: default, or paper (lens by lens, as the paper did)."
    )
    respect_gloss: bool | None = _quality(
        None,
        "For lens-view and interpolated: trace what reprojection would falsify (mirrors, glass, highlights, edges). By "
        "default yes, but in the paper's order.",
    )
    layers: bool = option(
        False,
        "Add depth, position, normal, albedo and shape of what each pixel sees (OpenEXR only).",
        group="Output",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("spp", "quality", "quality_worst", "max_time"):
            if self.effort != "normal" and getattr(self, name) is not None:
                is_draft = self.effort == "draft"
                raise UsageError(
                    f"{getattr(self, name):g} beside a {self.effort}{'' if is_draft else ' picture'}",
                    parameter=name,
                    rule="a draft has one sample a pixel" if is_draft else "it works until it is good by itself",
                    fix='leave it out, or use effort="normal"',
                )


@dataclass(frozen=True)
class MachineOptions(Options):
    """Resources that a render runs on.

    Raises
    ------
    UsageError
        A value is unknown or out of its range.
    """

    device: Device = _machine("auto", "Where to render; auto: the GPU if there is one.")
    threads: int | None = _machine(None, "CPU threads, at most one per core; all cores by default.", low=1, high=4096)
    memory: int | None = _machine(
        None,
        "Memory to use, such as 2G; 60 % of the free by default. What is read from files counts, too.",
        low=1,
        high=2**63,
        rule="must be a whole number of bytes, 1 or more",
        read=texts.memory,
    )


class MachineKeywords(TypedDict, total=False):
    """:class:`MachineOptions` as keywords."""

    device: Device
    threads: int | None
    memory: int | None


class RenderKeywords(MachineKeywords, total=False):
    """:class:`QualityOptions` and :class:`MachineOptions` as keywords."""

    integrator: Integrator
    depth: int | None
    exposure: float | Literal["auto"]
    tone_map: ToneMap
    effort: Effort
    quality: float | None
    quality_worst: float | None
    max_time: float | None
    spp: int | None
    method: Method
    denoise: Denoiser
    caustics: Caustics
    seed: int
    subpixels: bool | None
    pixel_filter: PixelFilter
    clamp_indirect: float | None
    order: Order | None
    respect_gloss: bool | None
    layers: bool
