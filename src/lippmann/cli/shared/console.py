"""Output of the commands: results on standard output, remarks and progress on standard error.

Of a picture: the object of ``--json``, remarks, depths and seconds.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

from lippmann import printable
from lippmann.cli.shared.command_options import translate
from lippmann.errors import LippmannError
from lippmann.progress import ProgressCallback, silent
from lippmann.progress_bar import PlainProgress, bar
from lippmann.wording import depths_in_words

if TYPE_CHECKING:
    from lippmann.image import Provenance


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let errors that name neither a file nor a parameter name ``path``."""
    try:
        yield
    except LippmannError as error:
        if not error.where and not error.parameter:
            error.where = str(path)
        raise


@dataclass(frozen=True)
class Console:
    """How one command talks: ``quiet`` says nothing but errors, ``as_json`` prints one object at the end."""

    quiet: bool = False
    as_json: bool = False

    def result(self, values: Mapping[str, object], lines: str | Sequence[str] = "") -> None:
        """The outcome: the object with ``--json``, else ``lines`` for people, as one text or one by one."""
        if self.as_json:
            print(printable.json_text(json.dumps(values, ensure_ascii=False, allow_nan=False)))
        elif lines and not self.quiet:
            print(printable.lines(lines) if isinstance(lines, str) else "\n".join(map(printable.one_line, lines)))

    def remark(self, *lines: str) -> None:
        """Lines that are no result: notes and warnings, their parameters as options."""
        for line in () if self.quiet else lines:
            print(printable.one_line(translate(line)), file=sys.stderr)

    @contextmanager
    def progress(self) -> Iterator[ProgressCallback]:
        """A progress bar on a terminal, a line now and then elsewhere, nothing when quiet."""
        if self.quiet:
            yield silent
        elif sys.stderr.isatty():
            with bar() as callback:
                yield callback
        else:
            yield PlainProgress()


def estimate_in_words(estimate: Mapping[str, object], part: str = "micro-image") -> str:
    """A picture's own error in words, as :attr:`Provenance.estimate` holds it; a quilt's parts are views."""
    from lippmann.rendering.estimate.psnr import Estimate

    words = Estimate.from_dict(estimate).in_words(part)
    if "flicker" not in estimate:
        return words
    from lippmann.sequences.flicker import flicker_in_words

    return f"{words}, {flicker_in_words(estimate)}"


def remarks(console: Console, made: Provenance) -> None:
    """Print the remarks on a picture."""
    console.remark(depth_line(made))
    if "auto" in made.options:
        console.remark(f"auto: {made.options['auto']}")
    console.remark(*made.notes)
    if made.estimate is not None:
        console.remark(f"estimated PSNR {estimate_in_words(made.estimate)}")


def report(output: Path, size: tuple[int, int], provenance: Provenance) -> dict[str, object]:
    """The object that ``--json`` prints of a render."""
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
    """Range of depth of the scene, beside the depth budget of the display."""
    ranges = (cast("tuple[float, float]", made.options[key]) for key in ("depth_range", "depth_budget"))
    (back, front), (far, near) = ranges
    return f"scene {depths_in_words(back, front)}; depth budget of the display {depths_in_words(far, near)}"


def add_seconds(provenance: Provenance, **seconds: float) -> Provenance:
    """Time spent outside the renderer belongs to its stage and to the total."""
    added = dict(provenance.seconds)
    for stage, value in seconds.items():
        added[stage] = added.get(stage, 0.0) + value
        added["total"] = added.get("total", 0.0) + value
    return replace(provenance, seconds=added)
