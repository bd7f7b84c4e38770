"""Tuned constants of films, each with its unit and the measurement that set it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FilmTuning:
    """Constants of key frames, cuts and shared light.

    Attributes
    ----------
    frames_of_key, frames_of_light:
        Every so many frames one has half-buffers; and where light is passed on.
    frames_of_link:
        Every so many frames of a moving display one passes on the light that it took; of one at rest every
        ``frames_of_key``.
    samples_kept:
        Samples of a frame after a key frame, as a share of the key frame's (``docs/research/films.md`` has all and
        half).
    farthest:
        The farthest that anything moves without a cut, as a share of the display's width: a turn by 39 degrees moves
        the panel's edges so far.
    pixels_of_probe:
        Of so many pixels one has a probe.
    probe_reach:
        Pixels to either side whose probes are averaged.
    direct_reach:
        Likewise, of those of direct light.
    bounce_reach:
        Likewise, of probes whose change counts as a share of all light (``docs/research/films.md`` has half).
    largest_change:
        Largest mean change of probes, less its standard error, as a share of the light of both.
    least_known:
        Least share of pixels that show the same light, else all are traced (``docs/research/films.md`` has half and
        three quarters).
    least_traced:
        Least share of traced pixels by which flicker is estimated: it is finite where none was, at 20 dB more.
    moments:
        Moments, spread evenly over an animation, whose boxes together stand for all that it ever fills.
    rounding:
        A frame that rounding puts this far (frames) beyond an animation's end still belongs to it.
    """

    frames_of_key: int = 4
    frames_of_light: int = 32
    frames_of_link: int = 2
    samples_kept: float = 0.75
    farthest: float = 1 / 3
    pixels_of_probe: int = 4
    probe_reach: int = 8
    direct_reach: int = 2
    bounce_reach: int = 64
    largest_change: float = 0.02
    least_known: float = 2 / 3
    least_traced: float = 0.01
    moments: int = 65
    rounding: float = 1e-3


TUNING = FilmTuning()
