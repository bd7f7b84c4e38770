"""What is written, what moves in it, and which machines render it."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

from lippmann.options.option import Options, option

#: What a film shows of each frame.
Shows = Literal["eye", "native", "rgbd", "rgbd-half", "hololuminescent"]

_frames = partial(option, default=None, group="Animation")
_cluster = partial(option, default=None, group="Cluster")


@dataclass(frozen=True)
class AccessOptions(Options):
    """What a scene's file may do. No file of settings can say it."""

    allow_outside: bool = option(False, "Let a scene file refer to files outside its own folder.", group="Scene")


@dataclass(frozen=True)
class SequenceOptions(Options):
    """Frames of a scene that moves or turns, and a film of them; without any of these a picture at rest."""

    turntable: int | None = _frames(
        help="Render so many frames of a whole turn of the scene about its upright axis; display and light stand "
        "still. The output is a film (.mp4), a folder or a name with %04d.",
        first=True,
    )
    swing: float | None = _frames(help="Swing the scene to and fro by so many degrees in all, instead of a whole turn.")
    frames: str | None = _frames(
        help="Render frames of a scene that moves: FIRST:STOP or FIRST:STOP:STEP, such as 0:48 for 0 to 47; 0: is all. "
        "The output is then a film (.mp4), a folder or a name with %04d."
    )
    fps: float | None = _frames(help="Frames per second of an animation and of the film; 24.")
    animation: str | None = _frames(help="A glTF file's animation by name; its first by default.")
    camera_path: Path | None = _frames(help="Fly through a Tachyon or NFF scene along this .cam file.")
    fixed_noise: bool = option(
        False, "Give all frames the same noise. By default each has its own, so none stands still.", group="Animation"
    )
    video: Path | None = _frames(
        help="Write a film (.mp4, .png) of what an eye sees of the frames, or with a name such as "
        "film_qs8x6a0.75.mp4 of their quilts."
    )
    eye: str | None = _frames(
        help="Where the film's eye is: X,Y,Z in mm, z toward the viewer; central. Of quilts also 'sweep': the eye goes "
        "to and fro across their views."
    )
    shows: Shows = option(
        "eye",
        "What the film shows: what an eye sees; the panel's native pixels, each code kept; colour beside depth (rgbd; "
        "near is white; needs `layers`); or what the player of a Hololuminescent display takes.",
        group="Animation",
    )
    codec: Literal["h264", "hevc", "vp9", "av1", "h264-rgb", "vp9-rgb"] | None = _frames(
        help="How an .mp4 is coded: h264 plays everywhere up to 4096 pixels; hevc, vp9 and av1 up to 8192; h264-rgb "
        "and vp9-rgb keep each code. Default: h264, or hevc where a side is longer."
    )


@dataclass(frozen=True)
class ClusterOptions(Options):
    """A Dask cluster to render on."""

    cluster: str | None = _cluster(
        help="Render on a Dask cluster: tls://HOST:8786 (scheduler; tcp:// is open to everyone who can reach it), or "
        "local:N (N workers on this machine). Needs the extra 'cluster'."
    )
    tls_ca: Path | None = _cluster(help="Certificate of the authority (PEM), for tls://.")
    tls_cert: Path | None = _cluster(help="Certificate of this machine (PEM).")
    tls_key: Path | None = _cluster(help="Private key of this machine (PEM).")
