"""Frames that other processes render: the same files as those of one process."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.image import Provenance
from lippmann.image.preview import Preview
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime.atomic_write import replacing_folder
from lippmann.sequences.files import save_sequence
from lippmann.sequences.turntable import open_turntable

ESTIMATE = {"psnr": 40.0, "psnr_low": 38.0, "psnr_high": 42.0, "worst": 30.0, "worst_low": 28.0, "by_chance": 44.0}


@dataclass(frozen=True)
class Form:
    """Frames that hold what they were asked for, in a folder of two files."""

    settings: ClassVar[dict[str, str]] = {}

    def render(self, scene, display, request, progress, build):
        asked = request.seed, request.samples, bool(request.judged_by)
        return Preview(np.array([asked]), Provenance(method="full", spp=request.samples, estimate=ESTIMATE))

    def write(self, frame, path, bits):
        with replacing_folder(path) as folder:
            (folder / "deep").mkdir()
            (folder / "values").write_bytes(frame.pixels.tobytes())
            (folder / "deep" / "provenance").write_text(f"{frame.provenance.estimate} {frame.provenance.options}")

    def provenance(self, path):
        return Provenance()


def save(folder, frames, **how):
    folder.mkdir(exist_ok=True)
    motion, display = open_turntable(lippmann.load_scene("teapot"), 80), load_display("seed-lenticular")
    request = RenderRequest(device="cpu")
    name = folder / "f_%02d.zarr"
    with save_sequence(
        motion, name, lambda k: folder / f"f_{k}.zarr", display, frames, request, form=Form(), **how
    ) as saved:
        return [(frame.number, frame.resumed) for frame in saved]


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_frames_are_the_same_in_any_order_and_after_an_interruption(engine, tmp_path):
    frames, told = [2, 3, 4, 31, 32, 33, 70], []
    save(tmp_path / "here", frames)

    def elsewhere(windows, total, put):
        for window in windows:
            sent = pickle.loads(pickle.dumps(window))
            assert len(sent.moments) == len({*sent.frames, *(number // 4 * 4 for number in sent.frames)})
            render = sent.open(None)
            for number in reversed(sent.frames):
                if total == 7 and number == 32:
                    raise KeyboardInterrupt
                put(render(number)())

    with pytest.raises(KeyboardInterrupt):
        save(tmp_path / "there", frames, runner=elsewhere, progress=told.append)
    assert [report.done for report in told] == [0, 1, 2, 3, 4, 5]
    rest = save(tmp_path / "there", frames, runner=elsewhere, resume=True)
    assert rest == [(2, True), (3, True), (4, True), (31, True), (32, False), (33, True), (70, False)]
    assert contents(tmp_path / "there") == contents(tmp_path / "here")
