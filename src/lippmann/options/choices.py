"""The words that a request is made of; loads nothing, so that help texts can list them at once."""

from __future__ import annotations

from typing import Literal

Method = Literal["auto", "full", "lens-view", "interpolated", "pooled"]
Order = Literal["default", "paper"]
Integrator = Literal["auto", "classic", "path", "direct", "normal", "depth", "position", "albedo"]
PixelFilter = Literal["auto", "box", "point"]
Correction = Literal["none", "lens"]
#: How much a picture may take: ``draft`` is one sample and the fast network, ``final`` a quality for a print.
Effort = Literal["draft", "normal", "final"]
Device = Literal["auto", "cpu", "gpu"]
#: ``auto``: ``pbr-neutral`` for physically based light, but before a background whose colour was asked for, and in
#: files for data.
ToneMap = Literal["auto", "none", "pbr-neutral"]
Denoiser = Literal["auto", "none", "oidn", "oidn-fast", "oidn-high"]
#: ``auto``: photons where a few of them land in the picture.
Caustics = Literal["auto", "photons", "paths", "none"]

#: The methods that reuse points of one micro-image in others.
REUSING: tuple[Method, ...] = ("lens-view", "interpolated")
#: Integrators that gather light and may be reused; those of plugins gather light, too.
LIGHT: tuple[Integrator, ...] = ("classic", "path", "direct")
#: Integrators that tell a property of a surface, which has no noise.
PROPERTIES: tuple[Integrator, ...] = ("normal", "depth", "position", "albedo")
#: Those whose light can be pooled.
POOLED_LIGHT: tuple[Integrator, ...] = ("path", "direct")

#: Why a value is this one that was not left open.
ASKED = "as asked for"
