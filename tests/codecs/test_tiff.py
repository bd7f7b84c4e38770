"""TIFF files: the pixels are those of the file itself, whatever its description says."""

from __future__ import annotations

import builtins
import io

import numpy as np
import pytest
import tifffile

from lippmann.display.panel import PixelWindow
from lippmann.image import open_file
from lippmann.image.streamed import pixels_of_file

OME = """<?xml version="1.0" encoding="UTF-8"?><!DOCTYPE OME [<!ENTITY other SYSTEM "file://{folder}/secret.tif">]>
<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06" UUID="urn:uuid:00000000-0000-0000-0000-000000000001">
<Image ID="Image:0"><Pixels ID="Pixels:0" DimensionOrder="XYCZT" Type="uint8" SizeX="60" SizeY="40" SizeC="3" SizeZ="1"
SizeT="1"><Channel ID="Channel:0:0" SamplesPerPixel="3"/><TiffData IFD="0" PlaneCount="1">
<UUID FileName="secret.tif">urn:uuid:00000000-0000-0000-0000-000000000002</UUID></TiffData></Pixels></Image></OME>"""


@pytest.fixture
def opened(monkeypatch):
    """The names of all files that are opened."""
    names, plain = [], builtins.open

    def noted(file, *options, **more):
        names.append(str(file))
        return plain(file, *options, **more)

    for module in (builtins, io):  # the latter's is used by paths
        monkeypatch.setattr(module, "open", noted)
    return names


def test_a_description_that_names_another_file_is_not_followed(tmp_path, opened):
    values = np.random.default_rng(0).integers(0, 256, (40, 60, 3), dtype=np.uint8)
    description = OME.format(folder=tmp_path)
    for name, pixels in (("a.tif", values), ("secret.tif", 255 - values)):
        tifffile.imwrite(tmp_path / name, pixels, photometric="rgb", description=description, metadata=None)
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        assert file.is_ome  # the library itself would look for the other file, were it asked for a series
    opened.clear()
    assert open_file(tmp_path / "a.tif").width == 60
    np.testing.assert_array_equal(open_file(tmp_path / "a.tif").decode()[0], values)
    window = PixelWindow(0, 0, 60, 40)
    np.testing.assert_array_equal(pixels_of_file(open_file(tmp_path / "a.tif")).window(window), values)
    assert [name for name in opened if name.endswith("a.tif")] == 3 * [str(tmp_path / "a.tif")]
    assert not any(name.endswith("secret.tif") for name in opened)
