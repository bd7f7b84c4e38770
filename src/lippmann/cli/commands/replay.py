"""``lippmann replay`` and ``lippmann refocus``: what an eye before the display sees, and pictures focused on planes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.commands.quilt import Aspect, Layout, quilt_of
from lippmann.cli.shared import options, parse
from lippmann.cli.shared.command_options import only, with_options
from lippmann.cli.shared.console import Console, naming
from lippmann.cli.shared.scene_source import output_of
from lippmann.errors import UsageError
from lippmann.options.outputs import SequenceOptions
from lippmann.options.texts import triple
from lippmann.progress import Progress, ProgressCallback

if TYPE_CHECKING:
    from lippmann.color.transfer import Transfer
    from lippmann.display import Display
    from lippmann.image import IntegralImage, LargePicture
    from lippmann.image.stored_values import FloatArray
    from lippmann.quilts.quilt import Quilt
    from lippmann.viewing.stereo import Stereo

Place = tuple[float, float, float]
Filter = Annotated[
    Literal["nearest", "linear"], typer.Option("--filter", help="Pixel filter: nearest, or linear within one lens.")
]
Size = Annotated[
    str | None,
    typer.Option(
        "--size", metavar="WIDTHxHEIGHT", help="Size of the result in pixels. Default: the panel's, at most 2048 wide."
    ),
]


@with_options
def replay(
    picture: options.Picture,
    output: options.OptionalOutput = None,
    eye: Annotated[
        str | None,
        typer.Option(
            "--eye",
            metavar="X,Y,Z",
            help="Position of the eye in mm: right, up, toward the viewer. Default: in front of the middle.",
        ),
    ] = None,
    sweep: Annotated[
        bool, typer.Option("--sweep", help="Write an animation from left to right: .mp4 or .png (APNG).")
    ] = False,
    frames: Annotated[int | None, typer.Option("--frames", help="Number of frames of the sweep. Default: 48.")] = None,
    width: Annotated[
        float | None,
        typer.Option(
            "--sweep-width", help="Width of the sweep in mm. Default: from the leftmost view to the rightmost."
        ),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            "--path", help="Write an animation along this head path: a text file with X,Y,Z in mm on each line."
        ),
    ] = None,
    sbs: Annotated[
        Literal["full", "half"] | None,
        typer.Option("--sbs", help="Two eyes side by side, the left one's picture on the left: full or half width."),
    ] = None,
    anaglyph: Annotated[bool, typer.Option("--anaglyph", help="Two eyes in one picture for red-cyan glasses.")] = False,
    eyes: Annotated[
        float | None, typer.Option("--eyes", help="Distance between the two eyes in mm. Default: 63.")
    ] = None,
    rgbd: Annotated[
        Literal["full", "half", "depth"] | None,
        typer.Option(
            "--rgbd",
            help="Colour with its depth on the right, at full or half width, or the depth alone, of a picture with "
            "--layers.",
        ),
    ] = None,
    white: Annotated[
        Literal["near", "far"], typer.Option("--white", help="Whether near or far is white beside the colours.")
    ] = "near",
    optics: Annotated[
        bool,
        typer.Option(
            "--optics",
            help="As the real lens shows it: crosstalk, blur, strips, moire, the zone's edges. The display must give a "
            "lens.",
        ),
    ] = False,
    size: Size = None,
    filter: Filter = "nearest",
    layout: Layout = None,
    aspect: Aspect = None,
    bits: options.Bits = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    film: Annotated[SequenceOptions, only("codec")],
) -> None:
    """Simulate what an eye in front of the display sees."""
    from lippmann.viewing.replay import default_eye
    from lippmann.viewing.stereo import head_path
    from lippmann.viewing.video_file import write_animation

    console = Console(quiet, as_json)
    if rgbd is not None:
        others = {"sweep": sweep, "path": path, "sbs": sbs, "anaglyph": anaglyph, "optics": optics, "codec": film.codec}
        for name in (name for name, value in others.items() if value):
            raise UsageError("does not apply to --rgbd", where=f"--{name}", fix="leave one of them out")
        _replay_depth(picture, output, eye, rgbd, white, size, bits, parse.display(display), console)
        return
    if white != "near":
        raise UsageError("applies to --rgbd only", where="--white", fix="add --rgbd full")
    stereo = _stereo(sbs, anaglyph, eyes)
    if path is not None and (sweep or eye is not None):
        raise UsageError("the path says where the eye is", where="--path", fix="leave out --sweep and --eye")
    moves = sweep or path is not None
    output = output_of(output, picture, "-sweep.mp4" if moves else "-seen.png")
    _check_output(output, film, moves=moves, stereo=stereo is not None, bits=bits)
    if not sweep and (width is not None or frames is not None):
        flag = "--frames" if width is None else "--sweep-width"
        raise UsageError("applies to a sweep only", where=flag, fix="add --sweep")
    places = None if path is None else head_path(path)
    source, target = _open_source(picture, display, layout, aspect)
    position = default_eye(target) if eye is None else triple(eye, "--eye")
    see = _view_of(source, target, size, filter, console, optics=optics, stereo=stereo)
    result: dict[str, Any] = {"output": str(output), "eye": list(position), "filter": filter, "optics": optics}
    if stereo is not None:
        result |= {"stereo": stereo[0], "eyes": stereo[1]}
    by = "" if stereo is None else f" by two eyes {stereo[1]:g} mm apart"
    transfer = source.provenance.transfer
    if not moves:
        _write_eye_views(see(position), output, stereo, bits, transfer)
        console.result(result, f"{output}: seen{by} from {_position(position)}")
        return
    if places is None:
        places = _sweep_before(target, position, width, frames)
    with console.progress() as progress:
        write_animation(_draw(see, places, progress), output, transfer=transfer, codec=film.codec)
    start, stop = places[0], places[-1]
    result |= {"frames": len(places), "start": list(start), "stop": list(stop)}
    console.result(result, f"{output}: {len(places)} frames, seen{by} from {_position(start)} to {_position(stop)}")


def _view_of(
    source: IntegralImage | LargePicture | Quilt,
    display: Display,
    size: str | None,
    filter: Literal["nearest", "linear"],
    console: Console,
    *,
    optics: bool,
    stereo: tuple[Stereo, float] | None,
) -> Callable[[Place], FloatArray]:
    """The function that gives what one eye, or the two of ``stereo``, see from a place."""
    from lippmann.quilts.quilt import Quilt
    from lippmann.viewing.quilt_views import replay_quilt
    from lippmann.viewing.stereo import stereo_pair

    pixels, framed = _size_of(size, display, console)
    if optics and isinstance(source, Quilt):
        rule = "a quilt is seen without lenses"
        raise UsageError("this is a quilt", where="--optics", rule=rule, fix="weave it for its display first")

    def replay_from(place: Place) -> FloatArray:
        if isinstance(source, Quilt):
            return framed(replay_quilt(source, display, place, size=pixels, linear=filter == "linear"))
        return framed(source.replay(place, size=pixels, filter=filter, optics=optics))

    return replay_from if stereo is None else lambda place: stereo_pair(replay_from, place, *stereo)


def _write_eye_views(
    picture: FloatArray, output: Path, stereo: tuple[Stereo, float] | None, bits: int | None, transfer: Transfer
) -> None:
    """Write what one eye or two see, two as a file of a pair where ``output`` is one."""
    from lippmann.codecs.stereo_pairs import PAIRS
    from lippmann.image.write import write_plain_picture
    from lippmann.viewing.stereo import write_pair

    if stereo is not None and output.suffix.lower() in PAIRS:
        write_pair(picture, output, stereo[0], transfer)
    else:
        write_plain_picture(picture, output, bits=bits, transfer=transfer)


def _sweep_before(display: Display, middle: Place, width: float | None, frames: int | None) -> list[Place]:
    """Places of an eye that sweeps ``width`` mm from left to right about ``middle``; by default over all views.

    That is from the middle of the outermost pixel under a lens to that of the other one: at the edges of the view
    cone, half a pixel farther, the views flip, and an eye sees those of both sides at once.
    """
    from lippmann.display.view_cone import cone_tangent
    from lippmann.viewing.replay import path_of_eye

    reach = width
    if reach is None:
        width_of_pixel = 1 + math.tan(math.radians(abs(display.lens_array.slant)))  # across the lenses, with its height
        reach = 2 * middle[2] * cone_tangent(display) * (1 - width_of_pixel / display.pixels_per_lens[0])
    start, stop = ((middle[0] + side * reach / 2, *middle[1:]) for side in (-1, 1))
    return path_of_eye(start, stop, 48 if frames is None else frames)


def _draw(
    picture_from: Callable[[Place], FloatArray], places: Sequence[Place], progress: ProgressCallback
) -> Iterator[FloatArray]:
    """What the eye sees from place to place."""
    for number, place in enumerate(places, 1):
        yield picture_from(place)
        progress(Progress("draw", number, len(places)))


def _check_output(output: Path, film: SequenceOptions, *, moves: bool, stereo: bool, bits: int | None) -> None:
    """Refuse an output that is not for one picture of an eye or two, or for an animation."""
    from lippmann.codecs.stereo_pairs import PAIRS
    from lippmann.image.write import check_output
    from lippmann.runtime.atomic_write import check_writable
    from lippmann.viewing.video_file import check_animation_path

    if moves:
        if bits not in (None, 8):
            raise UsageError(str(bits), where="--bits", rule="animations have 8", fix="leave it out")
        check_animation_path(output, film.codec)
        check_writable(output)
        return
    if film.codec is not None:
        raise UsageError("applies to an animation only", where="--codec", fix="add --sweep, or leave it out")
    if output.suffix.lower() not in PAIRS:
        check_output(output, bits)
        return
    if not stereo or bits not in (None, 8):
        raise UsageError("is for two eyes", where=str(output), rule="of 8 bits", fix="add --sbs full")
    check_writable(output)


def _replay_depth(
    picture: Path,
    output: Path | None,
    eye: str | None,
    form: Literal["full", "half", "depth"],
    white: Literal["near", "far"],
    size: str | None,
    bits: int | None,
    display: Display | None,
    console: Console,
) -> None:
    """``lippmann replay --rgbd``."""
    from lippmann.codecs.rgbd_names import RgbdForm
    from lippmann.image.read import read_picture
    from lippmann.viewing import color_and_depth as rgbd

    how = RgbdForm(half=form == "half", white=white)
    path = output_of(output, picture, "_depth.exr" if form == "depth" else ".png")
    path = path if form == "depth" else rgbd.named(path, how)
    rgbd.check_depth_path(path, rgbd.DEPTH_FILES if form == "depth" else rgbd.RGBD_FILES)
    if bits not in (None, 8, 16) or (form == "depth" and (bits or white != "near")):
        what = "--white" if form == "depth" and not bits else "--bits"
        rule = "depth alone is distance, of the bits that its file has; beside colours codes have 8 or 16"
        raise UsageError("cannot be", where=what, rule=rule)
    image = read_picture(picture, display=display)
    position = None if eye is None else triple(eye, "--eye")
    pixels = None if size is None else parse.size(size, "--size")
    with naming(picture):
        distance = rgbd.visible_distance(image, position, pixels)
        near, far = rgbd.range_of(distance)
    if form == "depth":
        rgbd.write_depth(distance, path)
    else:
        codes = rgbd.rgbd_codes(image, how, position, between=(near, far), bits=bits or 8, size=pixels)
        rgbd.write_rgbd(codes, path)
    result = {"output": str(path), "rgbd": form, "white": white, "near": near, "far": far}
    console.result(result, f"{path}: depth from {near:.1f} to {far:.1f} mm before the eye")


def refocus(
    picture: options.Picture,
    output: options.OptionalOutput = None,
    plane: Annotated[
        float | None,
        typer.Option("--plane", help="Height of the focus plane in mm, positive toward the viewer."),
    ] = None,
    planes: Annotated[
        str | None,
        typer.Option(
            "--planes",
            help="Focal stack: FIRST:LAST:COUNT, such as -40:40:9. The output is a folder, a .tif of pages, or an "
            "animation (.png, .mp4).",
        ),
    ] = None,
    size: Size = None,
    layout: Layout = None,
    aspect: Aspect = None,
    bits: options.Bits = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Refocus on a plane, or on several, as a camera whose aperture is as wide as the field of view."""
    from lippmann.image.write import check_output, write_plain_picture
    from lippmann.quilts.quilt import Quilt
    from lippmann.viewing.focal_stack import check_stack_path, write_planes
    from lippmann.viewing.quilt_views import refocus_quilt
    from lippmann.viewing.refocus import focal_planes

    console = Console(quiet, as_json)
    if (plane is None) == (planes is None):
        raise UsageError("say --plane or --planes", rule="mm before the lens plane, which is 0, or FIRST:LAST:COUNT")
    heights = [] if planes is None else parse.steps(planes, "--planes")
    output = output_of(output, picture, "-planes" if plane is None else "-refocused.png")
    if plane is None:
        check_stack_path(output, bits)
    else:
        check_output(output, bits)
    planes_asked = heights if plane is None else [plane]
    source, target = _open_source(picture, display, layout, aspect)
    transfer = source.provenance.transfer
    pixels, framed = _size_of(size, target, console)
    if isinstance(source, Quilt):
        focused = refocus_quilt(source, target, planes_asked, size=pixels)
    else:
        focused = focal_planes(source, planes_asked, size=pixels)
    focused = (framed(each) for each in focused)
    if plane is not None:
        write_plain_picture(next(focused), output, bits=bits, transfer=transfer)
        console.result({"output": str(output), "plane": plane}, f"{output}: focused at {plane:g} mm")
        return
    with console.progress() as progress:
        write_planes(focused, heights, output, bits=bits, transfer=transfer, progress=progress)
    line = f"{output}: {len(heights)} planes, focused at {heights[0]:g} to {heights[-1]:g} mm"
    console.result({"output": str(output), "planes": heights}, line)


def _open_source(
    picture: Path, display: str | None, layout: str | None, aspect: float | None
) -> tuple[IntegralImage | LargePicture | Quilt, Display]:
    """The picture or the quilt in a file, and the display that shows it."""
    from lippmann.image.streamed import open_picture
    from lippmann.viewing.quilt_views import quilt_display

    quilt = quilt_of(picture, layout, aspect)
    if quilt is not None:
        return quilt, quilt_display(quilt, parse.display(display), str(picture))
    image = open_picture(picture, display=parse.display(display))
    return image, image.display


def _size_of(
    size: str | None, display: Display, console: Console
) -> tuple[tuple[int, int] | None, Callable[[FloatArray], FloatArray]]:
    """Pixels of the panel in a picture of ``--size``, None where it is not given, and what frames it to that size."""
    from lippmann.viewing.replay import check_size, in_middle

    if size is None:
        return None, lambda picture: picture
    whole = check_size(parse.size(size, "--size"))
    inside = display.panel.size_inside(*whole)
    if inside != whole:
        console.remark(f"the panel has another shape than {size}: it fills {inside[0]}x{inside[1]} in the middle")
    return inside, lambda picture: in_middle(picture, whole)


def _stereo(sbs: Literal["full", "half"] | None, anaglyph: bool, eyes: float | None) -> tuple[Stereo, float] | None:
    """How two eyes become one picture, and their distance in mm; None for one eye."""
    from lippmann.display.stereo import EYE_DISTANCE
    from lippmann.viewing.stereo import eyes_of

    if sbs is not None and anaglyph:
        raise UsageError("a picture is one or the other", where="--anaglyph", fix="leave out --sbs or --anaglyph")
    stereo: Stereo | None = "anaglyph" if anaglyph else sbs
    if stereo is None:
        if eyes is not None:
            raise UsageError("there is one eye", where="--eyes", fix="add --sbs full, --sbs half or --anaglyph")
        return None
    distance = EYE_DISTANCE if eyes is None else eyes
    eyes_of((0.0, 0.0, 1.0), distance)
    return stereo, distance


def _position(eye: tuple[float, float, float]) -> str:
    return f"({eye[0]:.0f}, {eye[1]:.0f}, {eye[2]:.0f}) mm"
