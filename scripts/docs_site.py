"""Pages that MkDocs builds beside the files of ``docs/``: one for every command, from the command line's own help;
and what it adds to pages: the list of commands, the options, and the tables of ``docs/reference/properties``.

MkDocs calls the functions named ``on_...``; ``mkdocs.yml`` names this file as a hook.
"""

from __future__ import annotations

import html
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import typer.main
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

COMMANDS = "reference/commands/"
PROPERTIES = "reference/properties.md"
OPTIONS = "reference/python/options.md"
#: Roles of Sphinx in docstrings, as Markdown leaves them: ``:class:<code>~a.b.Name</code>``.
ROLE = re.compile(r":[a-z]+:(?=<code>)(<code>)(?:~[\w.]*\.)?")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the pages of a folder where the navigation names the folder."""
    docs = Path(config.docs_dir)
    pages = [f"{COMMANDS}index.md", *(f"{COMMANDS}{'-'.join(path)}.md" for path, _ in leaves(command_tree()))]
    config.nav = _expanded(config.nav, {COMMANDS: pages}, docs)
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the commands."""
    for path, command in leaves(command_tree()):
        uri = f"{COMMANDS}{'-'.join(path)}.md"
        files.append(File.generated(config, uri, content=command_page(path, command)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Add the list of commands, the options and the tables of properties to the pages that introduce them."""
    if page.file.src_uri == f"{COMMANDS}index.md":
        return f"{markdown}\n{overview(list(leaves(command_tree())))}"
    if page.file.src_uri == OPTIONS:
        return f"{markdown}\n{options()}"
    if page.file.src_uri == PROPERTIES:
        tables = sorted((Path(config.docs_dir) / "reference" / "properties").glob("*.toml"))
        return f"{markdown}\n{properties([tomllib.loads(table.read_text('utf-8')) for table in tables])}"
    return markdown


def on_page_content(content: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Drop the roles of Sphinx from docstrings."""
    return ROLE.sub(r"\1", content)


def properties(tables: list[dict[str, Any]]) -> str:
    """The tables of the properties of file formats, by title."""
    parts = []
    for table in sorted(tables, key=lambda table: str(table["title"]).casefold()):
        rows = [f"| {_cell(row['name'])} | {row['is']} | {_cell(row['how'])} |" for row in table["rows"]]
        head = "| property | is | how |\n|---|---|---|"
        parts.append("\n".join([f"## {table['title']}\n", f"{_cell(table['source'])}.\n", head, *rows]))
    return "\n\n".join(parts) + "\n"


def options() -> str:
    """The tables of the options of a render, as Python and the studio's files have them."""
    from lippmann.options.light import LightOptions
    from lippmann.options.option import default_of, options_of
    from lippmann.options.placement import PlacementOptions
    from lippmann.options.quality import MachineOptions, QualityOptions
    from lippmann.options.scene import SceneOptions

    parts = []
    for kind, where in (
        (SceneOptions, "Keywords of `load_scene`."),
        (LightOptions, "`light` of `load_scene`: the class, or a dict of its fields."),
        (PlacementOptions, "`placement` of `render` and the others: the class, or a dict of its fields."),
        (QualityOptions, "Keywords of `render`, `render_to_file`, `render_quilt`, `preview` and `plan`."),
        (MachineOptions, "Keywords of the same calls, and of `studio`."),
    ):
        rows = [
            f"| {_code(each.name)} | {_cell(its.help_in_python)} | {_code(repr(default_of(each)))} |"
            for each, its in options_of(kind)
        ]
        parts.append(
            "\n".join([f"## {kind.__name__}\n", f"{where}\n", "| option | meaning | default |", "|---|---|---|", *rows])
        )
    return "\n\n".join(parts) + "\n"


@cache
def command_tree() -> Any:
    """The command line as a tree of Click's commands."""
    from lippmann.cli.app import make_app

    return typer.main.get_command(make_app())


def leaves(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every command that does something, with the words that call it, in the order of the help."""
    if not hasattr(command, "commands"):
        yield path, command
        return
    for name, child in command.commands.items():
        if not child.hidden:
            yield from leaves(child, (*path, name))


def overview(commands: list[tuple[tuple[str, ...], Any]]) -> str:
    """The table of all commands."""
    rows = [
        f"| [`lippmann {' '.join(path)}`]({'-'.join(path)}.md) | {_cell(_summary(one))} |" for path, one in commands
    ]
    return "\n".join(["| command | what it does |", "|---|---|", *rows]) + "\n"


def command_page(path: tuple[str, ...], command: Any) -> str:
    """The page of one command: usage, arguments, options."""
    context = command.make_context(path[-1], [], resilient_parsing=True)
    records: dict[str, list[tuple[str, str]]] = {"argument": [], "option": []}
    for parameter in command.params:
        record = parameter.get_help_record(context)
        if record is not None:
            records[parameter.param_type_name].append(record)
    usage = " ".join(["lippmann", *path, *(_usage(parameter) for parameter in command.params if _usage(parameter))])
    usage += " [OPTIONS]" if records["option"] else ""
    parts = [f"# lippmann {' '.join(path)}", html.escape(command.help or "", quote=False), f"```text\n{usage}\n```"]
    if records["argument"]:
        rows = [f"| {_code(name)} | {_cell(_without_default(text))} |" for name, text in records["argument"]]
        parts.append("\n".join(["## Arguments\n", "| argument | meaning |", "|---|---|", *rows]))
    if records["option"]:
        rows = [
            f"| {_code(name)} | {_cell(_without_default(text))} | {_default(text)} |"
            for name, text in records["option"]
        ]
        parts.append("\n".join(["## Options\n", "| option | meaning | default |", "|---|---|---|", *rows]))
    return "\n\n".join(parts) + "\n"


def _expanded(nav: Any, generated: dict[str, list[str]], docs: Path) -> Any:
    if isinstance(nav, list):
        return [_expanded(item, generated, docs) for item in nav]
    if isinstance(nav, dict):
        return {title: _expanded(item, generated, docs) for title, item in nav.items()}
    if not nav.endswith("/"):
        return nav
    if nav in generated:
        return generated[nav]
    names = sorted(path.name for path in (docs / nav).glob("*.md"))
    return [nav + name for name in sorted(names, key=lambda name: name != "index.md")]


def _summary(command: Any) -> str:
    return (command.help or "").split("\n\n")[0]


def _usage(parameter: Any) -> str:
    if parameter.param_type_name != "argument":
        return ""
    name = parameter.name.upper().rstrip("_") + ("..." if parameter.nargs == -1 else "")
    return name if parameter.required else f"[{name}]"


def _without_default(text: str) -> str:
    return re.sub(r"\s*\[(default: [^]]*|required)\]\s*$", "", text)


def _default(text: str) -> str:
    found = re.search(r"\[(?:default: ([^]]*)|(required))\]\s*$", text)
    if found is None:
        return ""
    return found[2] or _code(found[1])


def _code(text: str) -> str:
    return "`" + " ".join(text.split()) + "`"


def _cell(text: str | None) -> str:
    return html.escape(" ".join((text or "").split()), quote=False).replace("|", "\\|").replace("*", "\\*")
