"""Numbers of 400 digits, too small ones, NaN and infinity: every option of every command is right or says its rule."""

from __future__ import annotations

import pytest
import typer

#: What each command needs to get as far as its options' values; FILE does not exist, PICTURE does.
NEEDED = {
    "render": ("FILE", "-o", "out.png"),
    "preview": ("FILE", "-o", "out.png"),
    "plan": ("FILE",),
    "quilt render": ("FILE", "-d", "looking-glass-portrait", "-o", "out.png"),
    "quilt pack": ("FILE", "-o", "out.png"),
    "quilt unpack": ("FILE", "-o", "out"),
    "info": ("PICTURE",),
    "views": ("PICTURE", "-o", "out"),
    "micro-images": ("PICTURE", "-o", "out"),
    "compose": ("FILE", "-o", "out.png"),
    "replay": ("PICTURE", "-o", "out.png", "--sweep", "--size", "16x16"),
    "refocus": ("PICTURE", "-o", "out.png", "--size", "16x16"),
    "export": ("PICTURE", "--as", "views", "-o", "out"),
    "import": ("FILE", "-o", "out.png"),
    "weave": ("FILE", "-d", "looking-glass-portrait", "-o", "out.png"),
    "interlace": ("FILE", "--lpi=60", "--ppi=600", "--size=20x20mm", "--viewing-distance=300mm", "-o", "out.tif"),
    "pitch-test": ("--lpi=60", "--ppi=600", "--size=20x20mm", "--viewing-distance=300mm", "-o", "out.tif"),
    "marks": ("FILE", "-d", "print-60lpi", "-o", "out.png"),
    "calibrate pattern": ("stripes", "-d", "seed-lenticular", "-o", "out.png"),
}
#: Options that name files, displays and machines: any text is a name.
NAMES = {"-o", "-d", "--state", "--cluster", "--csv", "--map", "--export"}
ABSURD = ("9" * 400, "1e-200", "nan", "inf", "-1")


def options_of(command):
    """The options with a value of a command, such as ``quilt render``."""
    from lippmann.cli.app import make_app

    found = typer.main.get_command(make_app())
    for word in command.split():
        found = found.commands[word]
    of_values = [each for each in found.params if each.param_type_name == "option" and not each.is_flag]
    return [each.opts for each in of_values if not NAMES & set(each.opts)]


@pytest.mark.long
@pytest.mark.parametrize(
    "command", [pytest.param(name, marks=() if name == "replay" else pytest.mark.long) for name in NEEDED]
)
def test_absurd_numbers_are_right_or_told_in_one_line(lippmann, picture, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    stands_for = {"FILE": str(tmp_path / "none.obj"), "PICTURE": str(picture)}
    words = [stands_for.get(word, word) for word in NEEDED[command]]
    for names in options_of(command):
        others = [word for word in words if word.partition("=")[0] not in names]
        for number in ABSURD:
            done = lippmann(*command.split(), *others, f"{names[0]}={number}", "-q")
            lines = [line for line in done.err.splitlines() if line.startswith("lippmann: ")]
            assert (done.code, len(lines)) in ((0, 0), (2, 1)), (names, number, done.err)
            assert len(done.err) < 1000


def test_every_command_with_numbers_is_tried():
    from lippmann.cli.app import make_app

    def walk(command, words):
        for name, each in getattr(command, "commands", {}).items():
            yield from walk(each, [*words, name])
        if not hasattr(command, "commands"):
            yield " ".join(words)

    # These serve pages, work for a cluster, or take no number but a port and threads.
    without = {"worker", "displays", "doctor", "proof", "studio", "show", "view", "compare", "reproduce", "quilt sizes"}
    assert set(walk(typer.main.get_command(make_app()), [])) - without - {"calibrate page"} == set(NEEDED)
