"""Stages as text, read by the reader."""

import pytest

from lippmann.scene.readers.load import load_scene

HEAD = '#usda 1.0\n(\n    upAxis = "Y"\n    metersPerUnit = 1\n)\n'

TRIANGLE = """
def Mesh "{name}" {{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token subdivisionScheme = "none"
    {more}
}}
"""


def triangle(name="m", more=""):
    return TRIANGLE.format(name=name, more=more)


@pytest.fixture(scope="session", autouse=True)
def usd():
    """Tests are skipped where the library is not installed."""
    pytest.importorskip("pxr", reason="usd-core is not installed")


@pytest.fixture
def read(tmp_path):
    """Writes a stage, and other files beside it, and reads it."""

    def read(body, *, head=HEAD, files=None, **options):
        for name, data in (files or {}).items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data if isinstance(data, bytes) else data.encode())
        path = tmp_path / "stage.usda"
        path.write_text(head + body)
        return load_scene(path, **options).description

    return read
