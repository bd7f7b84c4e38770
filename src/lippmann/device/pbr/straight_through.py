"""Which shapes of a Mitsuba scene may let rays straight through: alpha masks, blended surfaces, thin panes."""

from __future__ import annotations

from lippmann.device.types import BSDF, Shape


def is_instance(shape: Shape) -> bool:
    """Whether a shape shows a group of others, which are out of sight: it tells a surface that none of them has."""
    return bool(shape.class_name() == "Instance")


def may_pass(shape: Shape) -> bool:
    """Whether a shape may let rays straight through; an instance may."""
    return is_instance(shape) or has_null(shape.bsdf())


def has_null(surface: BSDF) -> bool:
    """Whether a surface has a null lobe."""
    import mitsuba as mi

    return bool(mi.has_flag(surface.flags(), mi.BSDFFlags.Null))
