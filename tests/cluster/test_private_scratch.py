"""Who starts workers removes all that they leave."""

import os
import subprocess
import sys
import tempfile

import pytest

pytest.importorskip("distributed")

from lippmann.cluster.private_scratch import private_scratch

#: A worker that is killed in the middle of its work.
KILLED = """
import os, tempfile
from lippmann.runtime.atomic_write import scratch_folder
with scratch_folder("lippmann-scene-"):
    tempfile.mkstemp()
    os.kill(os.getpid(), 9)
"""


def test_what_killed_workers_leave_goes_with_the_folder_of_who_started_them(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    with private_scratch() as folder:
        subprocess.run([sys.executable, "-c", KILLED], check=False)
        tempfile.mkdtemp()  # as Dask's threads do for certificates
        assert len(os.listdir(folder)) == 3
        assert os.listdir(tmp_path) == [os.path.basename(folder)]
    assert os.listdir(tmp_path) == []
    assert tempfile.gettempdir() == os.environ["TMPDIR"] == str(tmp_path)
