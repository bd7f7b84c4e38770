"""Arguments and options of commands that are no options of a render, each said once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.shared.command_options import read_defaults
from lippmann.cli.shared.completion import complete_displays, complete_scenes

Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on standard output.", rich_help_panel="Output")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but errors.", rich_help_panel="Output")]
Bits = Annotated[
    int | None,
    typer.Option(
        "--bits",
        help="Bits per value: PNG 8, 16; EXR 16, 32; TIFF and Zarr 8, 16, 32. Default: the input's where its pixels "
        "are kept, else 8, of EXR 32.",
        rich_help_panel="Output",
    ),
]
Correct = Annotated[
    Literal["none", "lens"],
    typer.Option(
        "--correct",
        help="lens: choose the pixels whose light through the display's real lenses comes nearest to what is meant, "
        "for cylindrical lenses of a known thickness.",
        rich_help_panel="Display",
    ),
]
Headroom = Annotated[
    float,
    typer.Option(
        "--headroom",
        help="Keep a corrected picture's light so far from black and white, a share of white: 0 to 0.25. Room for the "
        "correction, at the price of contrast.",
        rich_help_panel="Display",
    ),
]
Output = Annotated[Path, typer.Option("--output", "-o", help="The file to write; its ending names the format.")]
OptionalOutput = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="The file to write; its ending names the format. By default named after the input, in this folder.",
        show_default=False,
        rich_help_panel="Output",
    ),
]
Open = Annotated[
    bool,
    typer.Option("--open", help="View the result in a browser once it is written.", rich_help_panel="Output"),
]
Folder = Annotated[Path, typer.Option("--output", "-o", help="The folder to write; it appears whole or not at all.")]
OptionalFolder = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="The folder to write; it appears whole or not at all. By default named after the picture, in this folder.",
        show_default=False,
    ),
]
Picture = Annotated[Path, typer.Argument(help="A picture that Lippmann wrote (PNG, EXR, TIFF or Zarr).")]
DisplayName = Annotated[
    str,
    typer.Option(
        "--display",
        "-d",
        "--target",
        help="A name (see 'lippmann displays'), a TOML file, a device's visual.json, or print:... or monitor:...",
        autocompletion=complete_displays,
        rich_help_panel="Display",
    ),
]
PictureDisplay = Annotated[
    str | None, typer.Option("--display", "-d", help="The display of a picture that does not carry its own.")
]
Scene = Annotated[
    str,
    typer.Argument(
        help="A .glb, .gltf, .obj, .ply, .stl, .3mf, .off, .blend, .usd, Mitsuba .xml, Tachyon .dat or .nff file, "
        "Gaussian splats (.ply, .spz, .sog), points (.ply, .xyz, .csv, .las), a molecule (.pdb, .cif, .sdf), a volume "
        "(.nii, .nrrd, .vdb, .npy, a DICOM folder), a VTK file, a photograph with depth, or a bundled scene's name.",
        autocompletion=complete_scenes,
    ),
]
State = Annotated[
    Path | None,
    typer.Option(
        "--state",
        help="Take scene, display and settings from this file of the studio; options given beside it win.",
        callback=read_defaults,
        is_eager=True,
        show_default=False,
        rich_help_panel="Scene",
    ),
]
Eye = Annotated[str, typer.Option("--eye", help="The eye's place: X,Y,Z in mm, z toward the viewer.")]
