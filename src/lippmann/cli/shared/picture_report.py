"""What a command says of the picture that it made: the object of ``--json``, remarks, depths and seconds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

from lippmann.cli.shared.console import Console, estimate_in_words
from lippmann.wording import depths_in_words

if TYPE_CHECKING:
    from lippmann.image import Provenance


def remarks(console: Console, made: Provenance) -> None:
    """What is to be known of a picture beside its figures."""
    console.remark(depth_line(made))
    if "auto" in made.options:
        console.remark(f"auto: {made.options['auto']}")
    for note in made.notes:
        console.remark(note)
    if made.estimate is not None:
        console.remark(f"estimated PSNR {estimate_in_words(made.estimate)}")


def report(output: Path, size: tuple[int, int], provenance: Provenance) -> dict[str, object]:
    """What ``--json`` says of a render."""
    return {
        "output": str(output),
        "size": list(size),
        "method": provenance.method,
        "integrator": provenance.integrator,
        "depth": provenance.depth,
        "spp": provenance.spp,
        "seed": provenance.seed,
        "traced_fraction": provenance.traced_fraction,
        "pixel_shares": dict(provenance.pixel_shares),
        "estimate": None if provenance.estimate is None else dict(provenance.estimate),
        "rays": dict(provenance.rays),
        "seconds": dict(provenance.seconds),
        "options": dict(provenance.options),
        "notes": list(provenance.notes),
    }


def depth_line(made: Provenance) -> str:
    """Where the scene lies, beside what the display can resolve."""
    ranges = (cast("tuple[float, float]", made.options[key]) for key in ("depth_range", "resolvable_range"))
    (back, front), (far, near) = ranges
    return f"scene {depths_in_words(back, front)}; the display resolves {depths_in_words(far, near)}"


def add_seconds(provenance: Provenance, **seconds: float) -> Provenance:
    """Time spent outside the renderer belongs to its stage and to the total."""
    added = dict(provenance.seconds)
    for stage, value in seconds.items():
        added[stage] = added.get(stage, 0.0) + value
        added["total"] = added.get("total", 0.0) + value
    return replace(provenance, seconds=added)
