"""What the commands say: results on standard output, remarks and progress on standard error."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from lippmann import printable
from lippmann.cli.shared.option_names import translated
from lippmann.progress import ProgressCallback, silent
from lippmann.progress_bar import PlainProgress, bar


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

    def remark(self, line: str) -> None:
        """One line that is no result: a note or a warning, its parameters as options."""
        if not self.quiet:
            print(printable.one_line(translated(line)), file=sys.stderr)

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
    """What a picture says of its own error, as :attr:`Provenance.estimate` holds it; a quilt's parts are views."""
    from lippmann.rendering.estimate.psnr import Estimate

    return Estimate.from_dict(estimate).in_words(part)
