"""The library names its parameters, the command line its options."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import lippmann as package
from lippmann.cli.app import make_app
from lippmann.cli.shared.command_options import in_options, option_of, translate
from lippmann.errors import UsageError

assert make_app  # whose module says which commands there are
SOURCE = Path(package.__file__).parent
#: Parameters of the library that no command has.
OF_THE_LIBRARY = {
    "form",
    "effort",
    "stereo",
    "pick",
    "framed_by",
    "height",
    "row_step",
    "placement",
    "pupil",
    "light",
    "progress",
    "number",
}
#: Files whose texts are for other programs: pip, oiiotool, a style sheet's variables, Dask's own command, Blender,
#: commands that are run.
OTHER_PROGRAMS = {
    "runtime/engine.py",
    "codecs/exr.py",
    "scene/mitsuba_plugins.py",
    "scene/readers/blend/export.py",
    "scene/readers/blend/export_script.py",
    "scene/readers/blend/find_blender.py",
    "reproduce/style.py",
    "studio_app/command_line.py",
    "studio_app/render_jobs.py",
    "cluster/worker_preload.py",
    "runtime/llvm_install.py",
}
#: Whole commands, named as such.
COMMANDS = re.compile(r"lippmann (?:export|compare|weave)[\w `-]*--\w+|``--json``")


def library():
    for path in sorted(SOURCE.rglob("*.py")):
        name = path.relative_to(SOURCE).as_posix()
        if not name.startswith("cli/"):
            yield name, ast.parse(path.read_text(encoding="utf-8"))


@pytest.mark.long
def test_every_parameter_that_an_error_names_is_an_option():
    named = {
        keyword.value.value: name
        for name, tree in library()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        for keyword in node.keywords
        if keyword.arg == "parameter" and isinstance(keyword.value, ast.Constant)
    }
    assert len(named) > 20
    unknown = {parameter: name for parameter, name in named.items() if option_of(parameter) == parameter}
    assert {parameter for parameter in unknown if parameter not in OF_THE_LIBRARY} == set(), unknown


@pytest.mark.long
def test_the_library_says_no_flag():
    said = [
        (name, node.value)
        for name, tree in library()
        if name not in OTHER_PROGRAMS
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if re.search(r"(?<![\w-])--[a-z]", COMMANDS.sub("", node.value))
    ]
    assert said == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('use method="full"', "use --method full"),
        ("go on with resume=True, or not", "go on with --resume, or not"),
        ("respect_gloss=False helps", "--no-respect-gloss helps"),
        ("say display=..., with 3 x 4", "say --display, with 3 x 4"),
        ("use shift=0,0,Z instead", "use --shift 0,0,Z instead"),
        ("add camera_path=FILE.cam for a flight", "add --camera-path FILE.cam for a flight"),
        ('place="fit"', "--place fit"),
        ("nothing=3 is named so", "nothing=3 is named so"),
        ("spp=4.", "--spp 4."),
    ],
)
def test_settings_become_options(text, said):
    assert translate(text) == said


def test_an_error_says_the_option_after_the_file():
    error = UsageError("1 is too small", where="a.png", parameter="quality", rule="a", fix='use method="full"')
    assert in_options(error) == "a.png: --quality: 1 is too small; a; use --method full"
    assert str(error) == 'a.png: quality: 1 is too small; a; use method="full"'
    assert in_options(UsageError("odd", parameter="form")) == "form: odd"
