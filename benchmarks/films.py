"""Films: processor time of a frame, its error, flicker and memory, an earlier checkout and this one side by side.

Time on two cores: an estimated three hours for all films on the seed display, and an hour for one on a Portrait.

python benchmarks/films.py OTHER [--today CHECKOUT] [--films "KIND OF SCENE"...] [--display NAME]
    [--given FOLDER] [--time-only] [--runs N] [--last FRAME]

``OTHER`` is the folder of an earlier checkout, run as ``defaults.py`` runs it. The seconds of a frame are those of a
command for many frames less those of one for few, divided by how many more: starting up falls out. Processor time of
the whole tree of processes, medians of ``--runs`` of the two checkouts in turn, after one that compiles the kernels.
``--depth-scale 0.5`` is said everywhere, so that both show much the same native pixels; where the files say that they
stand otherwise, each checkout has its own reference.

A frame's error is against two long plain renderings with seeds of their own, A and B: the mean of (P - A)(P - B), in
which their noise cancels. Flicker is the same of the differences of successive frames. Both are told of native pixels
and of what an eye at rest in the middle sees, in codes of sRGB. ``--fixed-noise`` is judged beside it, this checkout
alone. References are kept in ``--cache``. ``--given`` names the
folder with Khronos' ``ClearCoatTest``.
Writes ``benchmarks/results/films.json``, where rows of other films and displays stay.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defaults import HERE, Checkout, psnr
from films_scenes import Film, films
from harness import save, saved

#: Frames of the shorter of the two commands whose times are taken from each other; a film of one frame is a still.
FEW = range(1)
#: Frames that are judged, and samples of each of their two references.
JUDGED, REFERENCE_SAMPLES = range(5), 32
SEEDS = (991, 992)
#: What is kept of a frame's own estimate.
STATED = ("psnr", "psnr_low", "psnr_high", "flicker")
PLAIN = ["--method", "full", "--denoise", "none", "--spp", str(REFERENCE_SAMPLES)]
#: What of a picture's options decides what its native pixels show.
SHOWN = ("depth_scale", "depth_range", "tone_map", "exposure")

_PROGRAM = "from lippmann.cli import main; main()"
Frames = Sequence[NDArray[Any]]


def render(checkout: Checkout, film: Film, display: str, frames: range, out: Path, more: Sequence[str] = ()) -> Any:
    """Frames of a film as files in the folder ``out``; seconds and peak memory."""
    which = f"{frames.start}:{frames.stop}:{frames.step}"
    words = ["render", *film.words, "-d", display, "--depth-scale", "0.5", "-q", "--frames", which]
    return checkout.run(_PROGRAM, [*words, *more, "-o", str(out / "%04d.png")])


def read(folder: Path) -> list[Any]:
    import lippmann

    return [lippmann.read_picture(folder / f"{number:04d}.png") for number in JUDGED]


def codes(images: Sequence[Any], eye: bool) -> list[NDArray[Any]]:
    """Frames in codes of sRGB, 0 to 1, as native pixels or as an eye in the middle sees them."""
    from lippmann.color.transfer import encode_srgb

    return [encode_srgb(image.replay() if eye else image.pixels) for image in images]


def judge(images: Sequence[Any], references: Sequence[Sequence[Any]]) -> dict[str, Any]:
    """PSNR of frames and of their changes, of native pixels and as an eye sees them, in dB; and what frames state."""
    found: dict[str, Any] = {}
    for name, eye in (("", False), ("eye_", True)):
        shown, a, b = (codes(each, eye) for each in (images, *references))
        found[f"{name}psnr"] = _agreement(shown, a, b)
        found[f"{name}flicker"] = _agreement(*(np.diff(np.stack(each), axis=0) for each in (shown, a, b)))
        found[f"{name}reference"] = psnr((np.stack(a) - np.stack(b)) / 2)
        if not eye:
            found["frames"] = [_agreement(*each) for each in zip(shown, a, b, strict=True)]
    estimates = [image.provenance.estimate for image in images]
    return {**found, "estimates": [each and {name: each.get(name) for name in STATED} for each in estimates]}


def _agreement(shown: Any, a: Any, b: Any) -> float:
    """The PSNR of frames against two references, whose own noise is of two kinds and cancels."""
    shown, a, b = (np.stack(each).astype(np.float64) for each in (shown, a, b))
    return float(-10 * np.log10(max(np.mean((shown - a) * (shown - b)), 1e-12)))


def references(checkout: Checkout, film: Film, display: str, folder: Path) -> list[list[Any]]:
    """Two long renderings of the frames that are judged, kept in ``folder``."""
    for seed in SEEDS:
        (folder / str(seed)).mkdir(parents=True, exist_ok=True)
        if not (folder / str(seed) / f"{JUDGED[-1]:04d}.png").exists():
            render(checkout, film, display, JUDGED, folder / str(seed), [*PLAIN, "--bits", "16", "--seed", str(seed)])
    return [read(folder / str(seed)) for seed in SEEDS]


def measure(checkouts: dict[str, Checkout], film: Film, scratch: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Figures of one film by checkout."""
    display, many = options.display, range(options.last + 1)
    sides: dict[str, dict[str, Any]] = {name: {} for name in checkouts}
    for name, checkout in checkouts.items():
        (scratch / name).mkdir()
        (scratch / "timed" / name).mkdir(parents=True)
        render(checkout, film, display, JUDGED, scratch / name)
        render(checkout, film, display, many, scratch / "timed" / name)  # compiles the kernels of all frames
    spent: dict[tuple[str, range], list[dict[str, float]]] = {}
    for _ in range(options.runs):
        for name, checkout in checkouts.items():
            out = scratch / "timed" / name
            for frames in (FEW, many):
                spent.setdefault((name, frames), []).append(render(checkout, film, display, frames, out))
    medians = {
        key: {what: statistics.median(run[what] for run in runs) for what in ("cpu", "peak")}
        for key, runs in spent.items()
    }
    images = {name: read(scratch / name) for name in checkouts}
    shows = {name: [all_[0].provenance.options.get(key) for key in SHOWN] for name, all_ in images.items()}
    for name, side in sides.items():
        side["seconds"] = (medians[name, many]["cpu"] - medians[name, FEW]["cpu"]) / options.last
        side |= {"still_peak": medians[name, FEW]["peak"], "peak": medians[name, many]["peak"]}
        first = images[name][0].provenance
        side |= {"spp": first.spp, "stated": (first.estimate or {}).get("psnr")}
    measured = {**sides, "runs": options.runs, "last": options.last}
    if options.time_only:
        return measured
    alike = _same(*shows.values())
    fixed = {}
    for name, side in sides.items():
        own = "today" if alike else name
        version = checkouts[own].commit()
        kept = options.cache / "films" / f"{film.name}_{display}_{REFERENCE_SAMPLES}_{version}".replace(" ", "_")
        long = references(checkouts[own], film, display, kept)
        side |= judge(images[name], long)
        if name == "today":
            (scratch / "fixed").mkdir()
            render(checkouts[name], film, display, JUDGED, scratch / "fixed", ["--fixed-noise"])
            fixed = judge(read(scratch / "fixed"), long)
    return {**measured, "fixed": fixed, "alike": alike}


def _same(a: list[Any], b: list[Any]) -> bool:
    return all(
        one == other or (isinstance(one, (float, list)) and other is not None and np.allclose(one, other, atol=1e-4))
        for one, other in zip(a, b, strict=True)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path)
    parser.add_argument("--today", type=Path, default=HERE)
    parser.add_argument("--films", nargs="*", help="such as 'turntable of teapot'; default all")
    parser.add_argument("--display", default="seed-lenticular")
    parser.add_argument("--given", type=Path, help="folder of models that somebody else made")
    parser.add_argument("--time-only", action="store_true", help="no references: time and memory alone")
    parser.add_argument("--runs", type=int, default=3, help="whose median counts: single ones may differ by a quarter")
    parser.add_argument("--last", type=int, default=32, help="last frame that is timed")
    parser.add_argument("--cache", type=Path, default=Path.home() / ".cache" / "lippmann-benchmarks")
    options = parser.parse_args()
    known, missing = films(options.cache, options.given)
    wanted = list(known) if options.films is None else options.films
    if unknown := set(wanted) - set(known):
        raise SystemExit(f"no such film: {', '.join(sorted(unknown))}; there are: {', '.join(known)}")
    checkouts = {"other": Checkout(options.other), "today": Checkout(options.today)}
    commits = {name: checkout.commit() for name, checkout in checkouts.items()}
    kept = saved("films")
    rows = kept.get("rows", [])
    if options.films is not None:
        missing = kept.get("missing", {})  # of all films, which were not asked for
    for name in wanted:
        with tempfile.TemporaryDirectory() as folder:
            found = measure(checkouts, known[name], Path(folder), options)
        place = {"film": name, "seen": known[name].seen, "display": options.display, "commits": commits}
        rows = [row for row in rows if (row["film"], row["display"]) != (name, options.display)]
        rows.append({**place, **found})
        save("films", {"missing": missing, "rows": rows}, show=False)
        print(name, options.display, json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
