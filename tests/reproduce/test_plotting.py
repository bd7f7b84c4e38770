"""Charts are the same whatever settings of Matplotlib lie about, and in every run."""

from __future__ import annotations

import os
import subprocess
import sys

import matplotlib
import pytest

from lippmann.reproduce.charts import Series, chart

DRAW = """
import locale, os, sys
from pathlib import Path
here = os.getcwd()
from lippmann.reproduce.charts import Series, chart
assert "matplotlib" not in sys.modules
drawn = chart([Series([(1, 2)], "s", "red", "m")], ("x", "y"), title="t")
import matplotlib
assert os.getcwd() == here
assert locale.setlocale(locale.LC_NUMERIC) == "C"
assert not matplotlib.rcParams["text.usetex"]
Path("chart.svg").write_text(drawn)
"""

#: Settings of a working folder: each would change the chart or the process, or end the import.
HOSTILE = {
    "settings": b"svg.fonttype: path\ntext.usetex: True\naxes.formatter.use_locale: True\nxtick.bottom: False\n",
    "no text": b"\xff\xfe",
}


def drawn():
    return chart([Series([(1, 2)], "s", "red", "m")], ("x", "y"), title="t")


@pytest.mark.long_cases("no text")
@pytest.mark.slow
@pytest.mark.parametrize("settings", sorted(HOSTILE))
def test_settings_of_the_working_folder_are_not_read(tmp_path, settings):
    (tmp_path / "matplotlibrc").write_bytes(HOSTILE[settings])
    environment = os.environ | {"LC_ALL": "C.UTF-8"}
    done = subprocess.run(
        [sys.executable, "-c", DRAW],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "chart.svg").read_text() == drawn()


def test_settings_of_the_program_stay_its_own():
    plain = drawn()
    with matplotlib.rc_context({"svg.fonttype": "path", "xtick.bottom": False, "lines.linestyle": "--"}):
        assert drawn() == plain
        assert matplotlib.rcParams["svg.fonttype"] == "path"
