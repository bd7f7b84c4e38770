"""Tuned constants of the transport of light, each with its unit, the benchmark that set it and what others cost."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TransportTuning:
    """Constants of paths, specular chains, photon look-ups and light vertices.

    Attributes
    ----------
    probe_side:
        Rays along each side of the pictures by which a scene is probed: for depths, for the panel's edges and for the
        exposure; the pilots have as many rays as such a picture, and each emitter or pair at least as many as a side.
    rounding:
        Relative error of positions that counts as rounding of single precision.
    roulette_depth:
        Surfaces after which Russian roulette may end a path.
    lanes:
        Lanes of wavefronts that are launched one after another, of photons and of steps of a live frame: on two cores
        these take as long as a whole frame of an eye, so that such frames can interleave.
    emitter_samples:
        Emitter samples at the first surface of a path that is not purely specular, in each of as many first samples of
        a pixel; half as many in later ones. A power of two keeps all points stratified.
    most_power:
        The clamp on one specular chain is white times this power of its pixel's number of chains. With 1, mirrored
        balls lose 1.5 to 2.5 dB with 128 samples, and their quality is often below its goal; with 0.5 they lose 0.5 to
        1 dB, and a ring of chrome 1.5 dB (``estimate_coverage.py``).
    small_emitter:
        Emitters are small whose area is less than this part of the square of the scene's diagonal.
    least_agreement, farthest_from_plane:
        The least cosine between the normals of a photon and of the point that it is looked up at, or of a sampled point
        and the hit there; and how far a photon may lie from the tangent plane of that point, in radii.
    steepest:
        Limit on the factor by which interpolated normals may brighten light that grazes the true surface.
    photons_of_cell:
        Most photons of a cell that one look-up reads: in the focus of a lens there are thousands. Successive samples of
        a pixel read others (``kernel_profile.py``).
    light_vertices:
        Rays from emitters for each half of a picture, of which those that hit a scattering surface give a light vertex;
        and rays of their pilot.
    uniform_share:
        Share of emitter samples, photon emissions and emitter rays that is uniform, for light that a pilot missed.
    """

    probe_side: int = 128
    rounding: float = 1e-4
    roulette_depth: int = 5
    lanes: int = 1 << 18
    emitter_samples: int = 4
    most_power: float = 0.75
    small_emitter: float = 1e-3
    least_agreement: float = 0.7
    farthest_from_plane: float = 0.4
    steepest: float = 4.0
    photons_of_cell: int = 8
    light_vertices: int = 1 << 16
    uniform_share: float = 0.1

    def rays_of_each(self, kinds: int) -> int:
        """Pilot rays per emitter, or per pair of an emitter and a caster, of which there are ``kinds``."""
        return max(self.probe_side**2 // kinds, self.probe_side)


TUNING = TransportTuning()
