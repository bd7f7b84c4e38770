"""Help in groups: options by what they are about, commands by what one does with them, and examples to begin with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from typer.core import TyperCommand, TyperGroup

from lippmann.cli.shared.kept_inputs import check_outputs

#: Options of the commands that render and look, by group; the rest stand under "Options". The last are rarely used.
OPTION_GROUPS: Mapping[str, tuple[str, ...]] = {
    "Scene": (
        "--state",
        "--up",
        "--variant",
        "--depth-map",
        "--transfer-function",
        "--window",
        "--series",
        "--crop",
        "--unit-scale",
        "--min-opacity",
        "--integrator",
        "--depth",
        "--allow-outside",
    ),
    "Placement": ("--camera", "--place", "--turn", "--shift", "--scale", "--depth-scale", "--pop-out"),
    "Display": (
        "--display",
        "--subpixels",
        "--views",
        "--size",
        "--layout",
        "--aspect",
        "--eye",
        "--eyes",
        "--sbs",
        "--anaglyph",
        "--pixels",
        "--plain",
    ),
    "Light": (
        "--environment",
        "--environment-strength",
        "--light-turn",
        "--light-strength",
        "--background",
        "--exposure",
        "--tone-map",
    ),
    "Quality": (
        "--effort",
        "--quality",
        "--quality-worst",
        "--max-time",
        "--spp",
        "--method",
        "--denoise",
        "--caustics",
        "--seed",
    ),
    "Output": ("--output", "--open", "--bits", "--layers", "--maps", "--resume", "--json", "--quiet"),
    "Print": (
        "--lpi",
        "--print-lpi",
        "--ppi",
        "--viewing-distance",
        "--thickness",
        "--index",
        "--field",
        "--bleed",
        "--marks",
        "--icc",
        "--mirror",
    ),
    "Animation": (
        "--turntable",
        "--swing",
        "--frames",
        "--fps",
        "--animation",
        "--camera-path",
        "--video",
        "--codec",
        "--sweep",
        "--sweep-width",
        "--path",
    ),
    "Cluster": ("--cluster", "--tls-ca", "--tls-cert", "--tls-key"),
    "Machine": ("--device", "--threads", "--memory"),
    "Rarely needed": ("--pixel-filter", "--clamp-indirect", "--single-scattering", "--order", "--respect-gloss"),
}
_REST, _HELP = "Options", "--help"

#: Commands by what one does with them.
COMMAND_GROUPS: Mapping[str, tuple[str, ...]] = {
    "Render": ("render", "preview", "plan", "quilt"),
    "Look": ("studio", "view", "show", "replay", "refocus", "info", "compare"),
    "From and to other pictures": ("interlace", "weave", "views", "micro-images", "compose", "export", "import"),
    "Displays and prints": ("displays", "calibrate", "pitch-test", "marks"),
    "Program": ("doctor", "worker", "reproduce"),
}

#: Two examples of each command; a sub-command's words are joined by a blank.
EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "lippmann": ("lippmann render model.glb --display looking-glass-portrait --open", "lippmann preview model.glb"),
    "render": (
        "lippmann render model.glb --display looking-glass-portrait --open",
        "lippmann render teapot --display print --lpi 60 --ppi 720 --size 8x10in -o teapot.tif",
    ),
    "preview": ("lippmann preview model.glb --turn 30", "lippmann preview model.glb --display panel-4k -o seen.png"),
    "plan": ("lippmann plan model.glb --display panel-8k", "lippmann plan teapot --spp 64 --memory 4G"),
    "worker": (
        "lippmann worker tcp://10.0.0.1:8786",
        "lippmann worker tls://render.example:8786 --tls-ca ca.pem --tls-cert me.pem --tls-key me.key",
    ),
    "displays": ("lippmann displays", "lippmann displays --json"),
    "doctor": ("lippmann doctor", "lippmann doctor --json"),
    "info": ("lippmann info model.png", "lippmann info model.png --json"),
    "views": ("lippmann views model.png -o views", "lippmann views model.exr -o views --format png"),
    "micro-images": (
        "lippmann micro-images model.png -o lenses",
        "lippmann micro-images model.exr -o lenses",
    ),
    "compose": ("lippmann compose views -o again.png", "lippmann compose lenses -o again.exr --bits 32"),
    "replay": (
        "lippmann replay model.png --sweep",
        "lippmann replay model.png --sbs half --eye 20,0,600 -o pair.png",
    ),
    "refocus": (
        "lippmann refocus model.png --plane -20 -o back.png",
        "lippmann refocus model.exr --planes -40:40:9 -o stack",
    ),
    "export": ("lippmann export model.exr --as hci -o scene", "lippmann export model.exr --as eslf -o scene.png"),
    "import": ("lippmann import scene -o model.exr", "lippmann import scene.png --as eslf -o model.exr"),
    "studio": ("lippmann studio", "lippmann studio model.glb --display looking-glass-portrait"),
    "show": ("lippmann show model.png", "lippmann show model.exr --display my-display.toml"),
    "view": ("lippmann view model.png", "lippmann view model.png --export model.html"),
    "interlace": (
        "lippmann interlace photos/*.jpg --lpi 60 --ppi 720 --size 8x10in -o print.tif",
        "lippmann interlace day.jpg night.jpg --lenses across --lpi 40 --ppi 600 --size 20x15cm -o flip.tif",
    ),
    "weave": (
        "lippmann weave city_qs8x6a0.75.png --display looking-glass-portrait -o city.png",
        "lippmann weave photos --display panel-4k --views nearest -o photos.tif",
    ),
    "pitch-test": (
        "lippmann pitch-test --lpi 60 --ppi 720 --size 20x10cm -o test.tif",
        "lippmann pitch-test --lpi 75 --ppi 1440 --size 8x4in --strips 31 -o test.tif",
    ),
    "marks": (
        "lippmann marks print.tif -o marked.tif --job-sheet job.pdf",
        "lippmann marks print.png --margin 0.5in -o marked.png",
    ),
    "compare": ("lippmann compare reference.exr test.png", "lippmann compare reference.exr test.exr --json"),
    "reproduce": ("lippmann reproduce -o report", "lippmann reproduce --quick -o report"),
    "quilt render": (
        "lippmann quilt render model.glb --display portrait",
        "lippmann quilt render model.glb --turntable 48 --video turn_qs8x6a0.75.mp4 -o frames",
    ),
    "quilt pack": (
        "lippmann quilt pack views -o city_qs8x6a0.75.png",
        "lippmann quilt pack views --bits 16 -o city_qs8x6a0.75.tif",
    ),
    "quilt unpack": (
        "lippmann quilt unpack city_qs8x6a0.75.png -o views",
        "lippmann quilt unpack city_qs8x6a0.75.png --bits 16 -o views",
    ),
    "quilt sizes": ("lippmann quilt sizes", "lippmann quilt sizes --json"),
    "calibrate pattern": (
        "lippmann calibrate pattern stripes --display panel-4k -o stripes.png",
        "lippmann calibrate pattern pitch --display panel-4k --fields 15 -o pitch.png",
    ),
    "calibrate page": (
        "lippmann calibrate page panel-4k -o my-panel.toml",
        "lippmann calibrate page my-panel.toml --no-browser -o better.toml",
    ),
}


class HelpfulCommand(TyperCommand):
    """A command whose options stand in groups, with examples below."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        records = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                records[_long(parameter.opts)] = record
        grouped = {name for names in OPTION_GROUPS.values() for name in names}
        is_large = len(records) > _LARGE
        sections = dict(OPTION_GROUPS) if is_large else {}
        rest = [name for name in records if not is_large or name not in grouped]
        arguments = [name for name in rest if not name.startswith("-")]
        _write(formatter, "Arguments", (records[name] for name in arguments))
        for title, names in sections.items():
            _write(formatter, title, (records[name] for name in names if name in records))
        _write(formatter, _REST, (records[name] for name in rest if name not in arguments))

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        _write_examples(ctx, formatter)

    def invoke(self, ctx: Any) -> Any:
        if ctx.info_name not in _MAY_CHANGE:
            check_outputs((parameter.opts, ctx.params.get(parameter.name)) for parameter in self.params)
        return super().invoke(ctx)


class HelpfulGroup(TyperGroup):
    """A group whose commands stand in groups themselves, with examples below."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        records = {}
        for name in self.list_commands(ctx):
            command = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                records[name] = (name, (command.help or "").strip().split("\n")[0])
        sections = {title: [name for name in names if name in records] for title, names in COMMAND_GROUPS.items()}
        if ctx.parent is not None or not any(sections.values()):
            sections = {}
        placed = {name for names in sections.values() for name in names}
        for title, names in sections.items():
            _write(formatter, title, (records[name] for name in names))
        _write(formatter, "Commands", (record for name, record in records.items() if name not in placed))

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        _write_examples(ctx, formatter)


#: Commands that may write over what they read: the page of a calibration refines a display's file.
_MAY_CHANGE = frozenset({"page"})

#: Commands with fewer options have them in one list.
_LARGE = 20


def _long(names: Iterable[str]) -> str:
    """The long name of an option, the only one of an argument."""
    given = list(names)
    return next((name for name in given if name.startswith("--")), given[0])


def _write(formatter: Any, title: str, records: Iterable[tuple[str, str]]) -> None:
    found = list(records)
    if found:
        with formatter.section(title):
            formatter.write_dl(found)


def _write_examples(ctx: Any, formatter: Any) -> None:
    words = ctx.command_path.split()[1:]
    examples = EXAMPLES.get(" ".join(words) or "lippmann", ())
    if examples:
        with formatter.section("Examples"):
            for line in examples:
                # Lines to copy are not wrapped.
                formatter.write(f"{'':>{formatter.current_indent}}{line}\n")
