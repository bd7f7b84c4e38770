"""Options that several commands share, each said once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.shared import parse
from lippmann.cli.shared.completion import complete_displays, complete_scenes
from lippmann.cli.shared.state_defaults import read_defaults
from lippmann.rendering.request import choices

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but errors.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="The file to write; its ending names the format.")]
OptionalOutput = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="The file to write; its ending names the format. By default named after the input, in this folder.",
        show_default=False,
    ),
]
Open = Annotated[bool, typer.Option("--open", help="View the result in a browser once it is written.")]
Folder = Annotated[Path, typer.Option("--output", "-o", help="The folder to write; it appears whole or not at all.")]
Picture = Annotated[Path, typer.Argument(help="A picture that Lippmann wrote (PNG, EXR, TIFF or Zarr).")]
DisplayName = Annotated[
    str,
    typer.Option(
        "--display",
        "-d",
        help="A name (see 'lippmann displays'), a TOML file, a device's visual.json, or print:... or monitor:...",
        autocompletion=complete_displays,
    ),
]
PictureDisplay = Annotated[
    str | None, typer.Option("--display", "-d", help="The display of a picture that does not carry its own.")
]
Scene = Annotated[
    str,
    typer.Argument(
        help="A .glb, .gltf, .obj, .ply, .spz, .sog, .stl, .blend, .usd, Mitsuba .xml, Tachyon .dat or .nff file, a "
        "volume (.nii, .nii.gz, .vdb, .npy, .npz, .vol, a DICOM folder), a VTK file, a photograph with depth, or a "
        "bundled scene's name.",
        autocompletion=complete_scenes,
    ),
]
Up = Annotated[
    Literal["y", "z", "-y"] | None,
    typer.Option(
        "--up",
        help="Which axis points up in OBJ, PLY (y by default), STL (z) and splat files (-y; of .spz y).",
        show_default=False,
    ),
]
Crop = Annotated[
    str | None,
    typer.Option(
        "--crop",
        help="Of splats, points and volumes, keep what is in the box X0,Y0,Z0,X1,Y1,Z1 (y up, after --unit-scale).",
        show_default=False,
    ),
]
UnitScale = Annotated[
    float | None,
    typer.Option(
        "--unit-scale",
        help="Factor on the coordinates of Gaussian splats, whose files have no unit: for --crop and --place display.",
        show_default=False,
    ),
]
MinOpacity = Annotated[
    float | None,
    typer.Option(
        "--min-opacity",
        help="Leave out Gaussian splats of less opacity (0 to 1): most floaters are faint.",
        show_default=False,
    ),
]
Variants = Annotated[
    list[str] | None,
    typer.Option(
        "--variant",
        metavar="[SET=]CHOICE",
        help="Choose a variant: of a USD stage SET=CHOICE, for all prims that have it, or /PRIM:SET=CHOICE for one "
        "(repeatable); of a glTF file's materials its name.",
        show_default=False,
    ),
]
DepthMap = Annotated[
    Path | None,
    typer.Option(
        "--depth-map",
        help="The depth of a photograph: .pfm, .npy, .exr (metres), a picture of 16 bits (millimetres) or of 8 bits "
        "(brighter is nearer).",
        show_default=False,
    ),
]
TransferFunction = Annotated[
    str | None,
    typer.Option(
        "--transfer-function",
        help="Colours and opacities of a volume: ct-bone, ct-soft, mr, grey, fire, or a .toml or .json file. By "
        "default what suits its values.",
        show_default=False,
    ),
]
Window = Annotated[
    str | None,
    typer.Option(
        "--window",
        metavar="LOW,HIGH",
        help="Lay the transfer function of a volume between these values.",
        show_default=False,
    ),
]
Series = Annotated[
    str | None,
    typer.Option(
        "--series",
        help="Of several volumes the one to show: a DICOM series' number, description or UID, a NIfTI volume's number, "
        "an array's name (also of VTK's files).",
        show_default=False,
    ),
]
Integrator = Annotated[
    choices.Integrator,
    typer.Option(
        "--integrator",
        help="path (all light), direct (emitters and sky only), classic (light of Tachyon and NFF scenes), or normal, "
        "depth, position, albedo. By default what the scene was made for.",
    ),
]
Depth = Annotated[int | None, typer.Option("--depth", help="Surfaces a path may meet; the primary ray's counts 1.")]
Spp = Annotated[
    int | None,
    typer.Option(
        "--spp",
        help="Samples per pixel. By default 2 to 16 as the picture's size suggests, for classic as the scene has it.",
    ),
]
Seed = Annotated[int, typer.Option("--seed", help="Of all random choices.")]
PixelFilter = Annotated[
    choices.PixelFilter,
    typer.Option("--pixel-filter", help="box: over the pixel; point: at its centre. By default box, but for classic."),
]
Caustics = Annotated[
    choices.Caustics,
    typer.Option(
        "--caustics",
        help="Light that mirrors and glass throw onto other surfaces. photons: sent by the emitters; paths: as paths"
        " find it; none: without. auto: photons where there is such light.",
    ),
]
ClampIndirect = Annotated[
    float | None,
    typer.Option(
        "--clamp-indirect",
        metavar="RADIANCE",
        help="Cut indirect light off above this, 1 being white: against fireflies, at the cost of true light.",
    ),
]
Device = Annotated[choices.Device, typer.Option("--device", help="Where to render; auto: the GPU if there is one.")]
Threads = Annotated[int | None, typer.Option("--threads", help="CPU threads; all cores by default.")]


def _limit_inputs(text: str | None) -> str | None:
    """Hold what is read from files to the limit, too, from the moment that it is known."""
    from lippmann.runtime.input_memory import limit_inputs

    limit_inputs(parse.memory(text))
    return text


Memory = Annotated[
    str | None,
    typer.Option(
        "--memory",
        help="Memory to use, such as 2G; 60 % of the free by default. What is read from files counts, too.",
        callback=_limit_inputs,
    ),
]
Environment = Annotated[
    Path | None, typer.Option("--environment", help="Light the scene by this picture of the surroundings (EXR, HDR).")
]
Background = Annotated[
    str | None, typer.Option("--background", help="Colour seen where nothing is hit: R,G,B, linear, 0 to 1.")
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Let a scene file refer to files outside its own folder.")
]
Exposure = Annotated[
    str,
    typer.Option(
        "--exposure",
        help="Stops (EV) by which light is raised or lowered. auto: 0; for files with physical light sources what "
        "brings the median of what is lit to mid-grey.",
    ),
]
ToneMap = Annotated[
    choices.ToneMap,
    typer.Option(
        "--tone-map",
        help="pbr-neutral: highlights are compressed, not clipped; none: light as it is. auto: pbr-neutral in PNG "
        "pictures without --background, none in formats for data.",
    ),
]
SingleScattering = Annotated[
    bool,
    typer.Option(
        "--single-scattering",
        help="Shade rough metal and glass exactly by glTF's formulas, which lose light between microfacets.",
    ),
]
LightTurn = Annotated[
    str | None,
    typer.Option(
        "--light-turn",
        metavar="AZIMUTH[,ELEVATION]",
        help="Turn light from far away, degrees to the right and up: the environment, the studio, directional lights.",
        show_default=False,
    ),
]
LightStrength = Annotated[
    float, typer.Option("--light-strength", metavar="FACTOR", help="Factor on the scene's own light sources.")
]
EnvironmentStrength = Annotated[
    float,
    typer.Option("--environment-strength", metavar="FACTOR", help="Factor on light of the environment or the studio."),
]
State = Annotated[
    Path | None,
    typer.Option(
        "--state",
        help="Take scene, display and settings from this file of the studio; options given beside it win.",
        callback=read_defaults,
        is_eager=True,
        show_default=False,
    ),
]
Method = Annotated[
    choices.Method,
    typer.Option(
        "--method",
        help="auto: pooled where light has noise, else full; full: every ray is traced, for references; "
        "lens-view: points are carried from lens to lens and missed pixels traced; "
        "interpolated: those of every other lens are averaged; "
        "pooled: noise is taken out, and all lenses that see a point share its light.",
    ),
]
Order = Annotated[
    choices.Order | None,
    typer.Option("--order", help="For lens-view and interpolated: default, or paper (lens by lens, as the paper did)."),
]
RespectGloss = Annotated[
    bool | None,
    typer.Option(
        "--respect-gloss/--no-respect-gloss",
        help="For them: trace what carrying over would falsify (mirrors, glass, highlights, edges). "
        "By default yes, but in the paper's order.",
        show_default=False,
    ),
]
Camera = Annotated[str | None, typer.Option("--camera", help="Place the display by this camera of the scene file.")]
Place = Annotated[
    str | None,
    typer.Option(
        "--place",
        help="fit: the scene fills the panel; camera: as the scene's camera looks; "
        "display: scene units are its mm. By default a bundled scene's own camera, else fit.",
    ),
]
Turn = Annotated[str | None, typer.Option("--turn", help="Turn the scene: YAW[,PITCH[,ROLL]] in degrees.")]
Shift = Annotated[str | None, typer.Option("--shift", help="Move the scene: X,Y,Z in mm.")]
Scale = Annotated[float, typer.Option("--scale", help="Enlarge the scene about the display's centre.")]
DepthScale = Annotated[
    str,
    typer.Option(
        "--depth-scale",
        help="Scale the scene's depth about the lens plane: 1 shows it whole, auto as much as the display resolves.",
    ),
]
PopOut = Annotated[
    float | None, typer.Option("--pop-out", help="Share of the scene's depth in front of the lens plane, 0 to 1.")
]
Effort = Annotated[
    choices.Effort,
    typer.Option(
        "--effort",
        help="draft: a first look, one sample a pixel and the fast network; normal: as the picture's size suggests, or "
        "as --spp, --quality or --max-time say; final: until it is estimated at 40 dB, as for a print.",
    ),
]
Quality = Annotated[
    float | None,
    typer.Option(
        "--quality",
        help="Work until the picture is estimated to reach this PSNR in dB, such as 40, and no micro-image is worse by "
        "over 12 dB.",
    ),
]
QualityWorst = Annotated[
    float | None,
    typer.Option("--quality-worst", help="Work until every micro-image is estimated to reach this PSNR; takes longer."),
]
QualityMean = Annotated[float | None, typer.Option("--quality-mean", hidden=True, help="What --quality is now.")]
MaxTime = Annotated[
    float | None,
    typer.Option("--max-time", help="Be done after so many seconds, loading and writing included."),
]
Denoise = Annotated[
    choices.Denoiser,
    typer.Option(
        "--denoise",
        metavar="[auto|none|oidn]",
        help="none, or oidn: take the noise out with Open Image Denoise, with the effort that the rays deserve. "
        "auto: with --method pooled, which auto takes.",
    ),
]
Layers = Annotated[
    bool,
    typer.Option(
        "--layers", help="Add depth, position, normal, albedo and shape of what each pixel sees (OpenEXR only)."
    ),
]
Subpixels = Annotated[
    bool | None,
    typer.Option(
        "--subpixels/--no-subpixels",
        help="A ray for every sub-pixel, at its own place. By default behind slanted sheets.",
        show_default=False,
    ),
]
Bits = Annotated[
    int | None, typer.Option("--bits", help="Bits per value: PNG 8, 16; EXR 16, 32; TIFF and Zarr 8, 16, 32.")
]
Eye = Annotated[str, typer.Option("--eye", help="The eye's place: X,Y,Z in mm, z toward the viewer.")]
