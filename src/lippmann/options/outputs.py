"""Options of the output: its files, the motion in it, and the machines that render it."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

from lippmann.errors import UsageError
from lippmann.options.option import Options, changed_options, option

#: The part of each frame that a film shows.
Shows = Literal["eye", "native", "rgbd", "rgbd-half", "hololuminescent"]

#: Endings of outputs that are films themselves; ``.png`` stays a picture's.
_FILMS = (".mp4", ".apng")

_frames = partial(option, default=None, group="Animation")
_cluster = partial(option, default=None, group="Cluster")


@dataclass(frozen=True)
class AccessOptions(Options):
    """Permissions of a scene's file. No file of settings can give them."""

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

    @property
    def turns(self) -> bool:
        """Whether the scene stands on a turntable."""
        return self.turntable is not None or self.swing is not None

    def __bool__(self) -> bool:
        """Whether a sequence is asked for.

        Raises
        ------
        UsageError
            An option of sequences is given, but no sequence.
        """
        if self.turns:
            for name in ("animation", "camera_path"):
                if getattr(self, name) is not None:
                    what = "a scene on a turntable moves in no other way"
                    raise UsageError(what, parameter=name, fix="leave it out")
            return True
        if self.frames is not None:
            return True
        for name in changed_options(self):
            fix = 'add frames="0:48", or turntable=48'
            if name == "eye":
                fix += "; 'lippmann preview' and 'lippmann replay' show what an eye sees of one picture"
            raise UsageError("has no meaning for a single picture", parameter=name, fix=fix)
        return False

    def with_film(self, output: Path) -> tuple["SequenceOptions", Path]:
        """An ``output`` that is a film becomes the film of frames in a folder beside it, ``NAME-frames``.

        Raises
        ------
        UsageError
            There are no frames, or ``video`` names another film.
        """
        if output.suffix.lower() not in _FILMS or output.is_dir():
            return self, output
        if not self:
            raise UsageError("a film needs frames", where=str(output), fix='add turntable=48, or frames="0:48"')
        if self.video is not None:
            raise UsageError("the output is a film already", parameter="video", fix="leave one of them out")
        # A dot would make the folder's name that of a file.
        return replace(self, video=output), output.with_name(f"{output.stem.replace('.', '-')}-frames")


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

    def __bool__(self) -> bool:
        """Whether a cluster is asked for.

        Raises
        ------
        UsageError
            A TLS file is given without one.
        """
        for name in changed_options(self) if self.cluster is None else ():
            raise UsageError("applies to a cluster only", parameter=name, fix='add cluster="tls://HOST:8786"')
        return self.cluster is not None
