"""Splats of browsers' viewers: 32 bytes each."""

import struct

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.splats.activation import SH_0

RECORD = struct.pack("<6f8B", 1, 2, 3, 0.1, 0.2, 0.3, 255, 0, 51, 204, 128 + 77, 128, 128, 128 + 102)


def test_places_sizes_colours_and_rotations(tmp_path):
    (tmp_path / "a.splat").write_bytes(RECORD * 2)
    scene = load_scene(tmp_path / "a.splat", up="y")
    splats = scene.description.splats
    assert splats.centers.tolist() == [[1, 2, 3]] * 2
    assert splats.scales[0] == pytest.approx([0.1, 0.2, 0.3])
    assert splats.opacities[0] == pytest.approx(0.8)
    assert splats.rotations[0] == pytest.approx(np.array([0, 0, 102, 77]) / np.hypot(102, 77), abs=1e-6)
    assert splats.harmonics[0, 0] * SH_0 + 0.5 == pytest.approx([1, 0, 0.2], abs=1e-6)
    assert load_scene(tmp_path / "a.splat").description.splats.centers[0].tolist() == [1, -2, -3]


def test_a_file_that_is_cut_short_is_refused(tmp_path):
    (tmp_path / "a.splat").write_bytes(RECORD[:-1])
    with pytest.raises(SceneError, match=r"a\.splat: holds 31 bytes; a splat has 32; is it cut short\?"):
        load_scene(tmp_path / "a.splat")
