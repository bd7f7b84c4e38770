"""The section of ``docs/background/measurements.md`` on scene files of others, from ``conformance.py``."""

from __future__ import annotations

from typing import Any

from conformance_sets import SETS

#: Reasons of refusals that are told one by one; the rest is summed up.
_REASONS = 24


def describe(result: dict[str, Any]) -> str:
    """All of the section, in Markdown."""
    sets, limits = result["sets"], result["limits"]
    seconds, gigabytes = limits["seconds"], limits["bytes"] / 1e9
    total = {key: sum(found[key] for found in sets.values()) for key in ("files", "valid", "valid_rendered")}
    share = total["valid_rendered"] / total["valid"]
    return f"""## Scene files of others (`conformance.py`)

Every scene file of public sets, rendered for a display of 48x48 pixels with 4 samples per pixel, within {seconds:g} s
of processor time and {gigabytes:g} GB each. A fault is a traceback, a warning or the end of the process; everything
else that is not rendered is refused in one line.

A file counts as *valid* if it shows triangles and is sound. Khronos' own validator decides for glTF 2.0, Mitsuba itself
for its XML; errors of the validator on bounds, weights and alignment alone do not count against a file. Files of other
formats are valid unless their set names them as damaged. Not valid are files that name another one which their set
lacks, and glTF 1.0. Most inputs of the tests of validators and readers are not valid, on purpose. Files that require
an extension that nobody knows are valid.

Of {total["valid"]} valid files, {total["valid_rendered"]} are rendered ({share:.1%}).

{_sets_table(sets)}

{_reasons_table(sets)}

Valid files that are not rendered:

{_missed_table(sets)}

Pictures in which the display shows less than 1 %: {_nothing(sets)}
"""


def _sets_table(sets: dict[str, Any]) -> str:
    rows = ["| set | files | rendered | refused | over time | over memory | faults | valid | of these rendered |"]
    rows.append("|---|---|---|---|---|---|---|---|---|")
    for name, found in sets.items():
        title = f"[{SETS[name].title}]({SETS[name].address}) ({SETS[name].license})" if name in SETS else name
        outcomes = found["outcomes"]
        faults = outcomes.get("fault", 0) + outcomes.get("died", 0)
        cells = (outcomes.get(kind, 0) for kind in ("rendered", "refused", "over time", "over memory"))
        rows.append(
            f"| {title} | {found['files']} | {' | '.join(map(str, cells))} | {faults} "
            f"| {found['valid']} | {found['valid_rendered']} |"
        )
    return "\n".join(rows)


def _reasons_table(sets: dict[str, Any]) -> str:
    counts: dict[str, int] = {}
    for found in sets.values():
        for reason, each in found["refusals"].items():
            counts[reason] = counts.get(reason, 0) + each["files"]
    ordered = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    rows = ["| refused, by the rule that the line tells | files |", "|---|---|"]
    rows += [f"| {_cell(reason)} | {count} |" for reason, count in ordered[:_REASONS]]
    if rest := ordered[_REASONS:]:
        rows.append(f"| {len(rest)} other rules | {sum(count for _, count in rest)} |")
    return "\n".join(rows)


def _missed_table(sets: dict[str, Any]) -> str:
    rows = ["| set | file | outcome |", "|---|---|---|"]
    for name, found in sets.items():
        for each in found["valid_not_rendered"]:
            rows.append(f"| {name} | `{each['file']}` | {_cell(each['line'] or each['outcome'])} |")
    return "\n".join(rows)


def _nothing(sets: dict[str, Any]) -> str:
    by_cause: dict[str, list[str]] = {}
    for name, found in sets.items():
        for file, cause in found["shows_nothing"].items():
            by_cause.setdefault(cause, []).append(f"`{file.rpartition('/')[2]}` ({name})")
    told = (f"{cause}: {', '.join(files)}" for cause, files in sorted(by_cause.items()))
    return ("; ".join(told) or "none") + "."


def _cell(text: str) -> str:
    """Text within a table: no bars, no markup."""
    return text.replace("|", "\\|").replace("<", "&lt;").replace("_", "\\_").replace("*", "\\*")
