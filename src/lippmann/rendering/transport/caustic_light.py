"""Light of caustics that a surface scatters, by the photons about a point."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, BSDFPtr, Color3f, Float, Spectrum, SurfaceInteraction3f, UInt32, Vector3f
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.sharp_events import facing_normal
from lippmann.rendering.transport.tuning import TUNING


def caustic_light(
    photons: PhotonMap,
    si: SurfaceInteraction3f,
    bsdf: BSDFPtr,
    lobe: Vector3f,
    lambert: Color3f,
    wide: Bool,
    stream: SampleStream,
    further: UInt32,
    choice: Float,
    seen: Bool,
    active: Bool,
) -> Spectrum:
    """Radiance toward ``si.wi`` of the photons about a point.

    The sum over all of them by the Lambertian part of the surface, and by the rest of its scattering that of one for
    all, where its lobes are wide enough for that.

    Parameters
    ----------
    lobe, lambert, wide:
        Of the surface, see :mod:`.sharp_events`.
    further:
        Surfaces that light may still have met before.
    choice:
        Uniform in [0, 1): draws the one photon.
    seen:
        Whether the point is seen by sharp events alone.
    """
    parts = dr.select(seen, mi.UInt32(TUNING.photon_parts), 1)
    part = (stream.key + stream.index) & (parts - 1)
    half = mi.UInt32(stream.half)
    found = photons.gather(si, facing_normal(si), lobe, half, further, choice, seen, active, part, parts)
    light = lambert * found.irradiance * dr.inv_pi
    wo = si.to_local(found.toward)
    wide = active & wide & (dr.max(found.flux) > 0) & (wo.z * si.wi.z > 0)
    rest = bsdf.eval(mi.BSDFContext(), si, wo, wide) / dr.abs(wo.z) - lambert * dr.inv_pi
    return dr.select(active, light, 0) + dr.select(wide, rest * found.flux, 0)
