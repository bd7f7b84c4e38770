"""What a render is asked for, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

from lippmann.errors import UsageError

if TYPE_CHECKING:
    from lippmann.display import Display

Method = Literal["auto", "full", "lens-view", "interpolated", "pooled"]
Order = Literal["default", "paper"]
IntegratorName = Literal["classic", "path", "direct", "normal", "depth", "position", "albedo"]
PixelFilter = Literal["box", "point"]
Device = Literal["auto", "cpu", "gpu"]
Denoiser = Literal["auto", "none", "oidn", "oidn-fast", "oidn-high"]

#: The methods that reuse points of one micro-image in others.
REUSING: tuple[Method, ...] = ("lens-view", "interpolated")
#: Integrators that gather light; the others name a property of a surface.
LIGHT: tuple[IntegratorName, ...] = ("classic", "path", "direct")
#: Those whose light can be pooled.
POOLED_LIGHT: tuple[IntegratorName, ...] = ("path", "direct")

#: Samples per pixel where nothing is said.
DEFAULT_SPP = 16
#: Surfaces per path where nothing is said.
DEFAULT_DEPTH = {"classic": 2, "path": 8, "direct": 1}


@dataclass(frozen=True)
class RenderSettings:
    """How a picture is made.

    Parameters
    ----------
    method:
        The renderer: ``full`` traces every ray; ``lens-view`` carries points from micro-image to micro-image and traces
        the pixels that none reached; ``interpolated`` averages those of every other micro-image from its neighbours;
        ``pooled`` lets all micro-images that show a point share its denoised light; ``auto`` leaves the choice to
        :func:`~lippmann.rendering.request.resolve.decide`.
    order:
        For ``lens-view`` and ``interpolated``: ``paper`` goes lens by lens as the paper does; ``default`` (None is the
        same) in the order that traces fewer pixels.
    respect_gloss:
        For them, too: trace what reprojection would falsify, such as mirrors, glass and highlights. None: in the
        default order, not in the paper's, which does not know how.
    integrator:
        ``classic`` (Tachyon's and NFF's light models, for scenes made for them), ``path`` (all light), ``direct``
        (light that comes straight from lamps and sky), or a property of the first surface without any light:
        ``normal``, ``depth``, ``position``, ``albedo``.
    depth:
        Surfaces a path may meet, the primary ray's counting 1; None for the integrator's own default.
    spp:
        Samples per pixel (or sub-pixel), at least 1; None for 16, or with a quality or a time for as many as that
        takes.
    quality, quality_mean:
        PSNR in dB that every micro-image, or the whole picture, is to reach by its own estimate.
    max_time:
        Seconds of tracing after which the best picture so far is taken.
    seed:
        Of all random choices, 0 to 2**32 - 1.
    subpixels:
        A ray for each sub-pixel, at its own place.
    pixel_filter:
        ``box`` spreads the samples over the pixel, ``point`` takes its centre.
    denoise:
        What takes the noise out of the finished picture: ``oidn`` is Intel's Open Image Denoise with the effort that
        the traced rays deserve (:mod:`~lippmann.rendering.denoise.cost_model`), ``oidn-fast`` and ``oidn-high`` name
        one; ``auto`` leaves it to the method.
    layers:
        Add depth, position, normal, albedo and shape of what each pixel sees to the picture's maps.
    device, threads, memory:
        Where it runs; ``memory`` in bytes, None for 60 % of what is free.
    """

    method: Method = "full"
    order: Order | None = None
    respect_gloss: bool | None = None
    integrator: IntegratorName = "path"
    depth: int | None = None
    spp: int | None = None
    quality: float | None = None
    quality_mean: float | None = None
    max_time: float | None = None
    seed: int = 0
    subpixels: bool = False
    pixel_filter: PixelFilter = "box"
    denoise: Denoiser = "none"
    layers: bool = False
    device: Device = "auto"
    threads: int | None = None
    memory: int | None = None

    def __post_init__(self) -> None:
        for field, allowed in (
            ("method", get_args(Method)),
            ("order", (None, *get_args(Order))),
            ("integrator", get_args(IntegratorName)),
            ("pixel_filter", get_args(PixelFilter)),
            ("device", get_args(Device)),
            ("denoise", get_args(Denoiser)),
        ):
            value = getattr(self, field)
            if value not in allowed:
                raise UsageError(
                    f"'{value}' is not known",
                    where=f"--{field.replace('_', '-')}",
                    rule=f"known are {', '.join(word for word in allowed if word)}",
                )
        _check_whole("depth", self.depth, 1, 4096)
        _check_whole("spp", self.spp, 1, 2**24)
        _check_whole("seed", self.seed, 0, 2**32 - 1)
        _check_whole("threads", self.threads, 1, 4096)
        _check_whole("memory", self.memory, 1, 2**63)
        if self.denoises and self.integrator not in LIGHT:
            raise UsageError(
                f"{self.integrator} has no noise",
                where="--denoise",
                rule=f"it is for {', '.join(LIGHT)}",
                fix="leave it out",
            )
        if self.method == "pooled" and self.integrator not in POOLED_LIGHT:
            raise UsageError(
                f"the light of {self.integrator} cannot be pooled",
                where="--integrator",
                rule=f"--method pooled works with {' and '.join(POOLED_LIGHT)}",
                fix="use --method full",
            )
        if self.method == "pooled" and self.denoise == "none":
            raise UsageError(
                "pooled needs the denoiser",
                where="--denoise",
                rule="pooled shares denoised light",
                fix="use --method full, or leave --denoise out",
            )
        self._check_reuse()

    def _check_reuse(self) -> None:
        """Options that belong together, or that do not."""
        if self.method not in REUSING:
            for name, value in (("--order", self.order), ("--respect-gloss", self.respect_gloss)):
                if value is not None:
                    raise UsageError(
                        f"{self.method} carries no points over",
                        where=name,
                        rule=f"it is for --method {' and '.join(REUSING)}",
                        fix="leave it out",
                    )
            return
        if self.order == "paper" and self.respect_gloss:
            raise UsageError(
                "the paper's order takes every colour as it is",
                where="--respect-gloss",
                rule="it is for --order default",
                fix="leave one of the two out",
            )
        if self.subpixels:
            raise UsageError(
                f"{self.method} carries whole pixels over",
                where="--subpixels",
                rule="a sub-pixel has rays of its own",
                fix="use --method full",
            )
        if self.integrator not in LIGHT:
            raise UsageError(
                f"{self.method} carries light over, and {self.integrator} gathers none",
                where="--integrator",
                rule=f"it works with {', '.join(LIGHT)}",
                fix="use --method full",
            )

    @property
    def denoises(self) -> bool:
        """Whether noise is taken out whatever comes."""
        return self.denoise not in ("none", "auto")

    @property
    def shares_light(self) -> bool:
        """Whether denoised light is shared between the micro-images."""
        return self.method == "pooled"

    def keeps_colors(self, display: Display) -> bool:
        """Whether the rays of sub-pixels keep all three colours, whichever is shown, for a denoiser to use.

        Under cylinders; on arrays, whose micro-images are short in both directions, that was better here, worse there.
        """
        return self.subpixels and self.denoise != "none" and display.lens_array.layout == "lenticular"

    @property
    def careful(self) -> bool:
        """Whether what reprojection would falsify is traced."""
        return self.order != "paper" if self.respect_gloss is None else self.respect_gloss

    @property
    def samples(self) -> int:
        """Samples per pixel where nothing else says when to stop."""
        return DEFAULT_SPP if self.spp is None else self.spp

    @property
    def surfaces(self) -> int:
        """The depth that will be used."""
        return DEFAULT_DEPTH.get(self.integrator, 1) if self.depth is None else self.depth


def _check_whole(name: str, value: int | None, low: int, high: int) -> None:
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise UsageError(f"{value!r} will not do", where=f"--{name}", rule=f"a whole number from {low} to {high}")
