"""Ctrl-C is known for what it is, however deep it was wrapped."""

from __future__ import annotations

import lippmann.cli.app


def test_an_interrupt_inside_a_compiled_loop_is_an_interrupt(monkeypatch, capsys):
    def wrapped(*arguments, **options):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise RuntimeError("dr.while_loop(): encountered an exception") from error

    monkeypatch.setattr(lippmann.cli.app, "app", wrapped)
    assert lippmann.cli.run(["info", "x.png"]) == 130
    assert capsys.readouterr().err == "lippmann: stopped; nothing was written\n"
