"""Options of commands, made from the dataclasses of :mod:`lippmann.options`; messages and studio files in their words.

A command takes such a dataclass as a parameter; :func:`with_options` puts an option for each of its fields in its
place, reads their words, and hands the command the whole. Help shows options by what they are about. Its headings are
typer's panels (``rich_help_panel``), which typer itself draws with ``rich``: that takes 120 ms to import and as long
again for a page, most of the time that ``--help`` may take. So they are written here as plain text::

    @with_options
    def plan(scene: Scene, *, quality: Annotated[QualityOptions, without("layers")], light: LightOptions) -> None: ...
"""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import Field, dataclass, field
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin

import typer
from typer.core import TyperCommand, TyperGroup

from lippmann.cli.shared.examples import EXAMPLES
from lippmann.errors import LippmannError, OutputError, UsageError
from lippmann.options.choices import REUSING
from lippmann.options.forms import LEFT_OUT, REUSES_NOTHING, Form
from lippmann.options.option import Option, Options, default_of, kinds_of, options_of
from lippmann.options.quality import MachineOptions

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
_RARE = frozenset({"as_json", "correct", "headroom", "quiet", "bits", "maps", "resume"})

#: Commands that may write over what they read: the page of a calibration refines a display's file.
_MAY_CHANGE = frozenset({"page"})
#: Options that name what is written.
_WRITTEN = frozenset({"--output", "--csv", "--map", "--maps", "--export", "--video"})


class HelpfulCommand(TyperCommand):
    """A command whose options stand in groups, those that few need left out of the first help, with examples below."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if not ctx.resilient_parsing:
            _refuse_empty(args)
        rest: list[str] = super().parse_args(ctx, args)
        return rest

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


def _refuse_empty(words: Sequence[str]) -> None:
    """Refuse words without a letter, which as a path would be this folder."""
    for before, word in zip(["", *words], words, strict=False):
        name, is_joined, value = word.partition("=")
        if not word or (is_joined and not value and name.startswith("--")):
            option = name or before
            where = option if option.startswith("-") else "an argument"
            raise UsageError("is empty", where=where, fix="give it a value, or leave it out")


def check_outputs(values: Iterable[tuple[Iterable[str], object]]) -> None:
    """Refuse a command whose output is one of its inputs, under whatever name: links and hard links count.

    Parameters
    ----------
    values:
        The names of each parameter of the command, and its value; text that names no file is none.

    Raises
    ------
    OutputError
        An output is a file that another parameter names.
    """
    read: list[Path] = []
    written_to: list[Path] = []
    for names, value in values:
        (read if _WRITTEN.isdisjoint(names) else written_to).extend(_files(value))
    for written in written_to:
        for path in read:
            if os.path.samefile(written, path):
                raise OutputError(f"is '{path}', which is read", where=str(written), fix="choose another name")


def _files(value: object) -> Iterator[Path]:
    """The files and folders that there are of those that a value may name."""
    for each in value if isinstance(value, list | tuple) else (value,):
        if isinstance(each, str | Path):
            try:
                if os.path.exists(each):
                    yield Path(each)
            except (OSError, ValueError):  # no file can have such a name
                continue


class HelpfulGroup(TyperGroup):
    """A group whose commands stand in groups themselves, with examples below."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        records: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            command: Any = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                line = " ".join((command.help or "").partition("\n\n")[0].split())
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


T = TypeVar("T", bound=Options)


@dataclass(frozen=True)
class Subset:
    """Which options of a dataclass a command has; the others stay at their defaults.

    ``refused`` are words that it does not take, by their options.
    """

    names: tuple[str, ...]
    are_left_out: bool
    refused: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def has(self, name: str) -> bool:
        """Whether the command has this option."""
        return (name in self.names) is not self.are_left_out


def only(*names: str) -> Subset:
    """These options alone."""
    return Subset(names, are_left_out=False)


def without(*names: str) -> Subset:
    """All options but these."""
    return Subset(names, are_left_out=True)


def for_form(form: Form) -> Subset:
    """The options, and of them the words, that a form of picture has."""
    return Subset(LEFT_OUT[form], are_left_out=True, refused={"method": REUSING} if form in REUSES_NOTHING else {})


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose parameters that are option dataclasses have become options."""
    signature = inspect.signature(command, eval_str=True)
    groups: dict[str, tuple[type[Options], list[tuple[Field[Any], Option]]]] = {}
    parameters = []
    for parameter in signature.parameters.values():
        kind, subset = _dataclass_of(parameter.annotation)
        if kind is None:
            parameters.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY))
            continue
        chosen = [(each, its) for each, its in options_of(kind) if subset.has(each.name)]
        groups[parameter.name] = kind, chosen
        parameters += [_parameter(each, its, subset.refused.get(each.name, ())) for each, its in chosen]
    options = {each.name: its for _, chosen in groups.values() for each, its in chosen}
    if len(parameters) > MANY:
        parameters.append(_HELP_ALL)

    def run(**values: Any) -> None:
        values.pop(_HELP_ALL.name, None)
        made = {name: _make(kind, chosen, values) for name, (kind, chosen) in groups.items()}
        own = {name: value for name, value in values.items() if name not in options}
        with _limit_inputs(made.values()):
            command(**own, **made)

    run.__name__, run.__doc__, run.__module__ = command.__name__, command.__doc__, command.__module__
    run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.options = options  # type: ignore[attr-defined]
    return run


def _make(kind: type[T], chosen: list[tuple[Field[Any], Option]], values: Mapping[str, Any]) -> T:
    return kind(**{each.name: _value(each, its, values[each.name]) for each, its in chosen})


def _dataclass_of(annotation: Any) -> tuple[type[Options] | None, Subset]:
    kind, *notes = get_args(annotation) if get_origin(annotation) is Annotated else (annotation,)
    subset = next((note for note in notes if isinstance(note, Subset)), without())
    return (kind, subset) if isinstance(kind, type) and issubclass(kind, Options) else (None, subset)


def _parameter(each: Field[Any], its: Option, refused: tuple[str, ...]) -> inspect.Parameter:
    """A field as typer's parameter; where its words are read here, None stands for its default."""
    default, kind, help_text = default_of(each), its.words or each.type, its.help_in_flags
    if refused:
        kind = Literal[tuple(word for word in get_args(kind) if word not in refused)]
        help_text = "; ".join(part for part in help_text.split("; ") if not part.startswith(refused))
    if its.read is not None:
        kind, default = its.words or (str | None), default if isinstance(default, str) else its.default_text
    metavar = its.metavar
    if its.door:  # words of plugins are known later
        kind, metavar = str, f"[{'|'.join(get_args(kind))}]"
    flag = its.flag_of(each.name)
    if bool in kinds_of(kind) and default is None:
        flag = f"{flag}/--no-{flag[2:]}"
    parameter = typer.Option(
        flag,
        help=help_text,
        metavar=metavar,
        rich_help_panel=its.group,
        show_default=default is not None and default is not False,
    )
    return inspect.Parameter(
        each.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, parameter]
    )


def _value(each: Field[Any], its: Option, words: Any) -> Any:
    """The value of an option's words."""
    if its.read is None:
        return words
    return default_of(each) if words is None or words in ([], ()) else its.read(words, its.flag_of(each.name))


def _limit_inputs(made: Iterable[Options]) -> AbstractContextManager[None]:
    """Limit the memory that input files may take to ``--memory``, where it is given."""
    memory = next((each.memory for each in made if isinstance(each, MachineOptions)), None)
    if memory is None:
        return nullcontext()
    from lippmann.runtime.machine import limit_inputs

    return limit_inputs(memory)


def _show_all(context: typer.Context, is_asked: bool) -> None:
    if is_asked and not context.resilient_parsing:
        context.meta[ALL] = True
        print(context.get_help())
        raise typer.Exit


_HELP_ALL = inspect.Parameter(
    "help_all",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[
        bool, typer.Option("--help-all", help="Show all options and exit.", is_eager=True, callback=_show_all)
    ],
)


#: Parameters whose options have other names than they have.
_OTHERWISE: dict[str, Sequence[str]] = {
    "layout": ["--as"],
    "grid": ["--views"],
}
#: ``name="value"``, ``name=True``, ``name=3.5`` or, for any value, ``name=...``.
_SETTING = re.compile(r"\b([a-z_]+)=(?:\"([^\"]*)\"|(\.\.\.|[\w+-]+(?:\.\w+)*))")


def in_options(error: LippmannError, words: Sequence[str] = ()) -> str:
    """The line that says ``error`` on the command line; of an option's names it says the one among ``words``."""
    where = ": ".join(part for part in (error.where, option_of(error.parameter, words)) if part)
    texts = {name: translate(getattr(error, name)) for name in ("what", "rule", "fix")}
    return str(LippmannError(texts["what"], where=where, rule=texts["rule"], fix=texts["fix"]))


def option_of(parameter: str, words: Sequence[str] = ()) -> str:
    """The option of a parameter, by its name among ``words`` where it has several; its own name where it has none."""
    said = {word.partition("=")[0] for word in words}
    return next((name for name in _names(parameter) if name in said), _option(parameter) or parameter)


def translate(text: str) -> str:
    """``text`` with settings of parameters as options."""
    return _SETTING.sub(_as_option, text)


def _as_option(match: re.Match[str]) -> str:
    name, quoted, plain = match.groups()
    option = _option(name)
    if option is None:
        return match[0]
    if plain in ("True", "..."):
        return option
    if plain == "False":
        return f"--no-{option[2:]}"
    return f"{option} {plain if quoted is None else quoted}"


def commands_are(*make_app: Callable[[], typer.Typer]) -> None:
    """Say which commands there are, those at hand first: their options are the words of what follows."""
    _makers[:] = make_app
    _options.cache_clear()


_makers: list[Callable[[], typer.Typer]] = []


def _option(parameter: str) -> str | None:
    return next(iter(_names(parameter)), None)


def _names(parameter: str) -> Sequence[str]:
    """Long names of a parameter's option, of the command at hand where it has one: to load all commands takes time."""
    return next((known[parameter] for make in _makers if parameter in (known := _options(make))), ())


@cache
def _options(make_app: Callable[[], typer.Typer]) -> Mapping[str, Sequence[str]]:
    """Names of options by those of their parameters; arguments by theirs, in capitals."""
    names: dict[str, Sequence[str]] = {}
    for command in _commands(typer.main.get_command(make_app())):
        for parameter in command.params:
            if parameter.name is not None:
                long = [option for option in parameter.opts if option.startswith("--")]
                names.setdefault(parameter.name, long or [parameter.name.upper()])
    return _OTHERWISE | names


def _commands(command: Any) -> Iterator[Any]:
    """A command of click's, whose home moved between releases of typer, and those below it."""
    yield command
    for each in getattr(command, "commands", {}).values():
        yield from _commands(each)


#: Options of renders in frames have another eye than previews.
_OF_PREVIEWS = ("preview",)


def read_defaults(context: typer.Context, state: Path | None) -> Path | None:
    """Let what the file ``state`` says stand for options that are not given.

    Raises
    ------
    UsageError
        The file cannot be read, or a setting is out of its range.
    """
    if state is None or context.resilient_parsing:
        return state
    from lippmann.studio_app.command_line import option_values
    from lippmann.studio_app.state_toml import read_state

    read = read_state(state)
    known = {parameter.name for parameter in context.command.params}
    texts: dict[str, object] = {"scene": read.scene, **option_values(read)}
    if read.eye is not None and context.command.name in _OF_PREVIEWS:
        texts["eye"] = ",".join(repr(part) for part in read.eye)
    context.default_map = {name: text for name, text in texts.items() if name in known}
    return state
