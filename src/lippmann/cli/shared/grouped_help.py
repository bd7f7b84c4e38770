"""Help: options by what they are about, commands by what one does with them, and examples to begin with.

The headings are typer's panels (``rich_help_panel``). Typer itself draws them with ``rich``, which takes 120 ms to
import and as long again for a page: most of the time that ``--help`` may take. So they are written here as plain text.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from typer.core import TyperCommand, TyperGroup

from lippmann.cli.shared.examples import EXAMPLES
from lippmann.cli.shared.outputs import check_outputs

#: Headings of options, in their order; what has none stands under the last.
OPTION_GROUPS = (
    "Arguments",
    "Scene",
    "Placement",
    "Display",
    "Light",
    "Quality",
    "Output",
    "Print",
    "Animation",
    "Cluster",
    "Machine",
    "Options",
)

#: Commands with fewer parameters show all of them, in one list.
MANY = 24
#: Key of a context in which help shows all options.
ALL = "lippmann.all_options"
#: Parameters beside the options of :mod:`lippmann.options` that the first help leaves out.
_RARE = frozenset({"as_json", "correct", "quiet", "bits", "maps", "resume"})

#: Commands that may write over what they read: the page of a calibration refines a display's file.
_MAY_CHANGE = frozenset({"page"})


class HelpfulCommand(TyperCommand):
    """A command whose options stand in groups, those that few need left out of the first help, with examples below."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        known = getattr(self.callback, "options", {})
        parameters = self.get_params(ctx)
        is_large = len(parameters) > MANY
        records: dict[str, list[tuple[str, str]]] = {title: [] for title in OPTION_GROUPS}
        for parameter in parameters:
            record = parameter.get_help_record(ctx)
            is_rare = parameter.name in _RARE if parameter.name not in known else not known[parameter.name].first
            if record is None or (is_large and is_rare and ALL not in ctx.meta):
                continue
            title = "Arguments"
            if parameter.param_type_name == "option":
                title = (getattr(parameter, "rich_help_panel", None) or "Options") if is_large else "Options"
            records[title].append(record)
        _write(formatter, records)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        _write_examples(ctx, formatter)

    def invoke(self, ctx: Any) -> Any:
        if ctx.info_name not in _MAY_CHANGE:
            check_outputs((parameter.opts, ctx.params.get(parameter.name)) for parameter in self.params)
        return super().invoke(ctx)


class HelpfulGroup(TyperGroup):
    """A group whose commands stand in groups themselves, with examples below."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        records: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            command: Any = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                line = (command.help or "").strip().split("\n")[0]
                records.setdefault(command.rich_help_panel or "Commands", []).append((name, line))
        _write(formatter, records)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        _write_examples(ctx, formatter)


def _write(formatter: Any, records: dict[str, list[tuple[str, str]]]) -> None:
    for title, lines in records.items():
        if lines:
            with formatter.section(title):
                formatter.write_dl(lines)


def _write_examples(ctx: Any, formatter: Any) -> None:
    words = ctx.command_path.split()[1:]
    examples: Iterable[str] = EXAMPLES.get(" ".join(words) or "lippmann", ())
    if examples:
        with formatter.section("Examples"):
            for line in examples:
                # Lines to copy are not wrapped.
                formatter.write(f"{'':>{formatter.current_indent}}{line}\n")
