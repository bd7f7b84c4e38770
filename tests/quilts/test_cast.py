"""Quilts that Looking Glass Bridge is told to show."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.errors import DisplayError
from lippmann.quilts.cast import cast_quilt
from lippmann.quilts.quilt import Quilt, QuiltLayout

QUILT = Quilt(np.zeros((256, 320, 3), np.uint8), QuiltLayout(4, 2, 0.75))


def test_bridge_is_told_file_and_layout(fake_bridge, tmp_path):
    assert cast_quilt(QUILT, tmp_path / "seen.png") == ["LKG-P00001"]
    asked = fake_bridge.asked[2:]
    assert [endpoint for endpoint, _ in asked] == [
        "delete_playlist",
        "instance_playlist",
        "insert_playlist_entry",
        "play_playlist",
    ]
    assert len({values["name"] for _, values in asked}) == 1
    entry = asked[2][1]
    assert entry["uri"] == (tmp_path / "seen.png").as_posix()
    shown = {key: entry[key] for key in ("cols", "rows", "aspect", "view_count", "isRGBD")}
    assert shown == {"cols": 4, "rows": 2, "aspect": 0.75, "view_count": 8, "isRGBD": 0}
    assert asked[3][1]["head_index"] == -1


def test_without_a_panel_nothing_is_played(fake_bridge, tmp_path):
    fake_bridge.devices = []
    with pytest.raises(DisplayError, match="finds no panel"):
        cast_quilt(QUILT, tmp_path / "seen.png")
    assert len(fake_bridge.asked) == 2
