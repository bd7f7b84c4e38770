"""What is begun is undone, whatever ends it, and whenever that strikes."""

import pytest

from lippmann.runtime import unfinished
from lippmann.runtime.unfinished import Unfinished, undo_all, undone


@pytest.fixture(autouse=True)
def _none_left(monkeypatch):
    monkeypatch.setattr(unfinished, "_undos", {})
    yield
    assert not unfinished._undos


def test_a_block_is_undone_at_its_end(tmp_path):
    place = tmp_path / "half"
    with undone(lambda: place.unlink(missing_ok=True)):
        place.touch()
    assert not place.exists()


def test_an_interrupt_in_the_very_end_is_made_good(tmp_path):
    place, tries = tmp_path / "half", []

    def undo() -> None:
        tries.append(1)
        if len(tries) == 1:
            raise KeyboardInterrupt
        place.unlink(missing_ok=True)

    with pytest.raises(KeyboardInterrupt), undone(undo):
        place.touch()
    assert place.exists()
    undo_all()
    assert not place.exists()


def test_one_that_cannot_be_undone_does_not_keep_the_others(tmp_path):
    place = tmp_path / "half"
    place.touch()
    Unfinished(place.unlink)
    Unfinished((tmp_path / "missing").unlink)
    settled = Unfinished(tmp_path.rmdir)
    settled.settle()
    undo_all()
    assert list(tmp_path.iterdir()) == []
