"""Options that several commands share, each said once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but errors.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="The file to write; its ending names the format.")]
Folder = Annotated[Path, typer.Option("--output", "-o", help="The folder to write; it appears whole or not at all.")]
Picture = Annotated[Path, typer.Argument(help="A picture that Lippmann wrote (PNG, EXR, TIFF or Zarr).")]
DisplayName = Annotated[
    str,
    typer.Option(
        "--display",
        "-d",
        help="A name (see 'lippmann displays'), a TOML file, a device's visual.json, or print:... or monitor:...",
    ),
]
PictureDisplay = Annotated[
    str | None, typer.Option("--display", "-d", help="The display of a picture that does not carry its own.")
]
Scene = Annotated[
    str,
    typer.Argument(
        help="A .glb, .gltf, .obj, .ply, .stl, Mitsuba .xml, Tachyon .dat or .nff file, or a bundled scene's name."
    ),
]
Integrator = Annotated[
    str,
    typer.Option(
        "--integrator",
        help="path (all light), direct (lamps and sky only), classic (light of Tachyon and NFF scenes), or normal, "
        "depth, position, albedo. By default what the scene was made for.",
    ),
]
Depth = Annotated[int | None, typer.Option("--depth", help="Surfaces a path may meet; the primary ray's counts 1.")]
Spp = Annotated[
    int | None, typer.Option("--spp", help="Samples per pixel; 16 by default, for classic as the scene has it.")
]
Seed = Annotated[int, typer.Option("--seed", help="Of all random choices.")]
PixelFilter = Annotated[
    str,
    typer.Option("--pixel-filter", help="box: over the pixel; point: at its centre. By default box, but for classic."),
]
Device = Annotated[str, typer.Option("--device", help="auto, cpu or gpu.")]
Threads = Annotated[int | None, typer.Option("--threads", help="CPU threads; all cores by default.")]
Memory = Annotated[str | None, typer.Option("--memory", help="Memory to use, such as 2G; 60 % of the free by default.")]
Environment = Annotated[
    Path | None, typer.Option("--environment", help="Light the scene by this picture of the surroundings (EXR, HDR).")
]
Background = Annotated[
    str | None, typer.Option("--background", help="Colour seen where nothing is hit: R,G,B, linear, 0 to 1.")
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Let a scene file refer to files outside its own folder.")
]
Bits = Annotated[
    int | None, typer.Option("--bits", help="Bits per value: PNG 8, 16; EXR 16, 32; TIFF and Zarr 8, 16, 32.")
]
Eye = Annotated[str, typer.Option("--eye", help="The eye's place: X,Y,Z in mm, z toward the viewer.")]
