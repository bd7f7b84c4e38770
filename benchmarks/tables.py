"""Writes the tables of ``docs/background/measurements.md`` from ``results/``: figures are never copied by hand.

Time on two cores: about a second.

python benchmarks/tables.py
"""

from __future__ import annotations

import json
import statistics
import textwrap
from pathlib import Path
from typing import Any

import caustics_tables
import conformance_tables
import defaults_tables
import drafts_tables
import equal_error_tables
import estimate_coverage_tables
import film_encoding
import films_tables
import first_picture_tables
import goals_tables
import half_and_double
import kernel_profile_tables
import light_vertices_tables
import photon_share_tables
import scene_file_tables
import studio_tables
from harness import RESULTS, saved

README = Path(__file__).parent.parent / "README.md"
BEGIN, END = "<!-- methods -->", "<!-- /methods -->"
CAUSTICS_PAGE = Path(__file__).parent.parent / "docs" / "background" / "caustics.md"
LIGHT_VERTICES_PAGE = Path(__file__).parent.parent / "docs" / "background" / "light-vertices.md"
PAGE = Path(__file__).parent.parent / "docs" / "background" / "measurements.md"

HEAD = """# Measurements

Made by `benchmarks/tables.py` from `benchmarks/results/*.json`, which the scripts of the same names write. Times are
medians of several warm runs, interleaved where things are compared; absolute times are the machine's that is named,
the ratios are what counts.
"""


def main() -> None:
    sections = [HEAD]
    for name, describe in SECTIONS.items():
        path = RESULTS / f"{name}.json"
        if path.exists():
            result = json.loads(path.read_text())
            sections.append(describe(result) + "\n" + _machine(result["machine"]))
            if name == "methods":
                _into_readme(result)
            if name == "caustics":
                _into_page(CAUSTICS_PAGE, name, caustics_tables.rows(result))
            if name == "light_vertices":
                _into_page(LIGHT_VERTICES_PAGE, name, light_vertices_tables.rows(result))
            if name in QUILTS_PAGE_TABLES:
                _into_page(QUILTS_PAGE, name, QUILTS_PAGE_TABLES[name](result))
    PAGE.write_text("\n".join(_broken("\n".join(sections).split("\n"))))
    _into_page(MATERIALS_PAGE, "furnace", _furnace(saved("furnace")))


def _machine(machine: dict[str, Any]) -> str:
    return (
        f"Measured on {machine['processor']}, {machine['cores']} cores, with Mitsuba {machine['mitsuba']} and "
        f"Dr.Jit {machine['drjit']}, {machine['date']}.\n"
    )


def _full_rate(result: dict[str, Any]) -> str:
    ours, theirs = (1000 * result["seconds"][name]["median"] for name in ("full", "mitsuba"))
    return f"""## `full` against Mitsuba's own integrator (`full_rate.py`)

Direct light, {result["scene"]}, 512x512 pixels, 1 sample per pixel, the same rays.

| | time | rate |
|---|---|---|
| `full`, with ledger and copy to the host | {ours:.1f} ms | {result["rate_relative_to_mitsuba"]:.0%} |
| Mitsuba's `direct` | {theirs:.1f} ms | 100% |

Target: at least {result["target"]:.0%}.
"""


def _large_frame(result: dict[str, Any]) -> str:
    width, height = result["size"]
    per_sample = result["nanoseconds_per_sample"]
    return f"""## A large frame in bounded memory (`large_frame.py`)

{width}x{height} pixels, path light, {result["spp"]} samples per pixel, limit {result["memory_limit"] / 2**30:.0f} GiB.

| | measured | target |
|---|---|---|
| peak resident memory | {result["peak_resident_bytes"] / 1e9:.2f} GB | {result["target_peak_bytes"] / 1e9:.1f} GB |
| time per sample | {per_sample["large"]:.0f} ns | |
| time per sample of a frame of 262 000 pixels | {per_sample["small"]:.0f} ns | |
| ratio | {result["time_per_sample_relative_to_small"]:.2f} | {result["target_relative"]} |
"""


def _command(result: dict[str, Any]) -> str:
    names = {
        "render": "`lippmann render teapot --integrator direct --spp 1`, 512x512, warm cache",
        "help": "`lippmann --help`",
        "import": "`import lippmann`",
        "python": "for comparison: Python alone",
    }
    rows = [
        f"| {text} | {result['seconds'][name]['median']:.2f} s | {_seconds(result['targets'].get(name))} |"
        for name, text in names.items()
    ]
    return "\n".join(["## Whole commands (`command.py`)", "", "| | median | target |", "|---|---|---|", *rows, ""])


def _methods(result: dict[str, Any]) -> str:
    return "\n".join([f"## Methods, {result['scene']} (`methods.py`)", "", *_method_rows(result), ""])


def _method_rows(result: dict[str, Any]) -> list[str]:
    rows = [
        f"| `{row['method']}`{row['options']} | {row['spp']} | {row['seconds']:.2f} s | {row['psnr']:.1f} dB "
        f"| {row['psnr_worst']:.1f} dB | {row['traced_fraction']:.0%} |"
        for row in result["rows"]
    ]
    header = "| method | samples per pixel | time | PSNR | worst micro-image | pixels traced |"
    return [header, "|---|---|---|---|---|---|", *rows]


def _into_readme(result: dict[str, Any]) -> None:
    """The table of methods stands in the README, between its two marks."""
    page = README.read_text()
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    README.write_text("\n".join([before + BEGIN, *_method_rows(result), END]) + after)


def _into_page(page: Path, name: str, rows: list[str]) -> None:
    """A table stands in a page between two marks of its name."""
    begin, end = f"<!-- {name} -->", f"<!-- /{name} -->"
    before, _, rest = page.read_text().partition(begin)
    _, _, after = rest.partition(end)
    page.write_text("\n".join([before + begin, *_broken(rows), end]) + after)


def _broken(lines: list[str]) -> list[str]:
    """Lines of text of at most 120 columns; those of tables, pictures and headings stay as they are."""
    return [part for line in lines for part in ([line] if line[:1] in "|!#" else _parts(line))]


def _parts(line: str) -> list[str]:
    indent = "  " if line.startswith("- ") else ""
    return textwrap.wrap(line, 120, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False) or [line]


def _weave(result: dict[str, Any]) -> str:
    width, height = result["panel"]
    return "\n".join(
        [
            "## A direct rendering against a weave (`weave.py`)",
            "",
            f"{width}x{height} pixels of a nominal Looking Glass Portrait with sub-pixels of their own, and a quilt of "
            f"{result['views']} views of {result['view'][0]}x{result['view'][1]} pixels. "
            "[Quilts](quilts.md) says what they are judged by.",
            "",
            *_weave_rows(result),
            "",
        ]
    )


def _weave_rows(result: dict[str, Any]) -> list[str]:
    rows = ["| scene | way | samples per pixel | PSNR |", "|---|---|---|---|"]
    for scene, found in result["results"].items():
        rows += [f"| {scene} | {row['way']} | {row['spp']} | {row['psnr']:.1f} dB |" for row in found["rows"]]
    return rows


def _weave_with_picture(result: dict[str, Any]) -> list[str]:
    return [
        "![What an eye sees: direct, woven with linear and with nearest views](../images/weave.png)",
        "",
        "*What an eye on the right of the cone sees of the panel's middle: rendered directly, woven with "
        "`--views linear`, and with `--views nearest`.*",
        "",
        *_weave_rows(result),
    ]


def _cycles(result: dict[str, Any]) -> str:
    width, height = result["panel"]
    rows = "\n".join(_cycles_rows(result))
    return f"""## Against Blender's Cycles (`cycles.py`)

The glTF teapot for a nominal Looking Glass Portrait: 48 views of {result["view"][0]}x{result["view"][1]} pixels, or
the native frame of {width}x{height}x3 sub-pixels; two threads each. Every program is judged by its own long rendering
({result["reference_spp"]} samples). Target: at no lower PSNR {result["target"]:g} times faster.

{rows}
"""


def _cycles_rows(result: dict[str, Any]) -> list[str]:
    cycles = result["cycles"]
    rows = [
        "| | samples | processor time | PSNR | times less |",
        "|---|---|---|---|---|",
        f"| Cycles {cycles['blender']}, 48 views, with its denoiser | {cycles['spp']} | {cycles['cpu_seconds']:.0f} s "
        f"| {cycles['psnr']:.1f} dB | 1 |",
    ]
    for name, title in (
        ("quilt", "Lippmann's quilt"),
        ("native", "Lippmann's native frame"),
    ):
        # Tries with fewer samples, which fall short of Cycles' PSNR, have no ratio.
        for one in result[name]["tries"]:
            ratio = f"{result['times_less_cpu'][name]:.1f}" if one == result[name]["chosen"] else ""
            method = one.get("method", "pooled" if name == "quilt" else "full")
            way = f"{title}, `--method {method} --denoise {one['denoise']}`"
            rows.append(f"| {way} | {one['spp']} | {one['cpu_seconds']:.0f} s | {one['psnr']:.1f} dB | {ratio} |")
    rows += ["", _cycles_remark(result)]
    return rows


def _cycles_remark(result: dict[str, Any]) -> str:
    timed = "all views" if result["views_timed"] == 48 else f"{result['views_timed']} views, whose mean stands for all"
    return f"Processor time is that of all threads. Cycles was timed over {timed}, beside other work."


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:g} s"


def _tachyon(result: dict[str, Any]) -> str:
    rows = "\n".join(
        f"| {one['scene']} | {one['size']} | {one['ray_depth']} | {one['seconds']['tachyon_cpu']['median']:.2f} s "
        f"| {one['seconds']['lippmann_cpu']['median']:.2f} s | {one['times_faster']:.1f} "
        f"| {one['times_faster_wall']:.1f} | {one['target']:g} | {one['megarays_per_processor_second']:.0f} M/s |"
        for one in result["results"]
    )
    return f"""## The classic light model against Tachyon (`tachyon.py`)

The same files from their own cameras, {result["threads"]} threads each, run in turn, pairs of runs: {result["runs"]}.
Processor time of tracing alone, ours with warm kernels; other work ran beside. "Times faster" is the median over pairs.
Wall times compare Tachyon's own "Ray Tracing Time" with ours. Rays are ours, per processor second.

| scene | pixels a side | ray depth | Tachyon | Lippmann | times faster | by wall time | target | rays |
|---|---|---|---|---|---|---|---|---|
{rows}
"""


def _reuse(result: dict[str, Any]) -> str:
    titles = {
        "small": "The paper's display, 512x512 pixels, classic light, ray depth 2, one ray a pixel",
        "large": "The same optics, 3840x2160 pixels (480 lenses of 8 pixels)",
        "dear": "1920x1080 pixels, path light, emitters of some size, 16 samples a pixel",
    }
    parts = [
        """## Reusing points (`reuse.py`)

Seconds are those of tracing and reuse; *saved* is the share of `full`'s time. The paper's PSNR is its average over the
micro-images. [Reprojection](reprojection.md) says what the ways mean. Pictures of 512x512 pixels are timed in processor
seconds of one thread; the larger ones were timed by the clock on two cores, with an earlier version of the bridges."""
    ]
    header = "| scene | way | pixels traced | time | full | saved | paper's PSNR | worst micro-image |"
    for name, rows in result["results"].items():
        lines = [
            f"| {row['scene']} | {row['way']} | {row['pixel_shares']['traced']:.0%} | {row['seconds']:.3f} s "
            f"| {row['full_seconds']:.3f} s | {row['saved']:.0%} | {row['paper_mean_psnr']:.1f} dB "
            f"| {row['worst_psnr']:.1f} dB |"
            for row in rows
        ]
        parts.append("\n".join([f"### {titles[name]}", "", header, "|---|---|---|---|---|---|---|---|", *lines]))
    return "\n\n".join(parts) + "\n"


QUILTS_PAGE = Path(__file__).parent.parent / "docs" / "background" / "quilts.md"
QUILTS_PAGE_TABLES = {"weave": _weave_with_picture, "cycles": _cycles_rows}


MATERIALS_PAGE = PAGE.parent.parent / "reference" / "materials.md"


def _furnace(result: dict[str, Any]) -> list[str]:
    """Furnaces, for the page of materials."""

    def shares(values: list[float]) -> str:
        return " | ".join(f"{value:.1%}" for value in values)

    angles = " | ".join(f"{cosine:g}" for cosine in result["cosines"])
    head = f"| surface, white | {angles} | single scattering: {angles} |\n|{'---|' * (1 + 2 * len(result['cosines']))}"
    surfaces = [
        f"| {name} | {shares(row['compensated'])} | {shares(row['single'])} |"
        for name, row in result["surfaces"].items()
    ]
    balls = [f"| {name} | {row['compensated']:.1%} | {row['single']:.1%} |" for name, row in result["balls"].items()]
    return [head, *surfaces, "", "| whole body | kept | single scattering |", "|---|---|---|", *balls]


def _cluster(result: dict[str, Any]) -> str:
    targets = result["targets"]
    ways = list(next(iter(result["sizes"].values()))["seconds"])
    rows = []
    for size, measured in result["sizes"].items():
        times = (
            f"{statistics.median(measured['seconds'][way]):.1f} s ({statistics.median(spent):.0f} s)"
            for way, spent in measured["processor_seconds"].items()
        )
        ratios = (f"{measured[name]:.2f}" for name in ("speed_up", "overhead", "processor_overhead"))
        rows.append(f"| {size} | {' | '.join((*times, *ratios))} |")
    table = "\n".join(rows)
    return f"""## Clusters on one machine (`cluster.py`)

Path light, 4 samples per pixel, written as TIFF; workers warm, with one thread each. In brackets the processors' time.
"Speed-up" is that of two workers against one (target: {targets["speed_up"]:g}), "overhead" their time over that of two
threads in one process (target: at most {targets["overhead"]:g}), and the same of the processors' time; medians of three
runs in turn, each with its own ratio.

| pixels | {" | ".join(ways)} | speed-up | overhead | of processors |
|---|{"---|" * (len(ways) + 3)}
{table}
"""


def _huge(result: dict[str, Any]) -> str:
    width, height = result["size"]
    method, denoise = result.get("method", "full"), result.get("denoise", "none")
    option = "" if denoise == "none" else f" --denoise {denoise}"
    target = f"{result['target_peak_bytes'] / 1e9:.0f} GB"
    rows = []
    for ending, run in result["renders"].items():
        small = sum(one["nanoseconds_per_pixel"] for one in run["small"]) / 2
        rows.append(
            f"| `{ending}` | {run['peak_resident_bytes'] / 1e9:.2f} GB | {run['bytes'] / 1e9:.2f} GB "
            f"| {run['seconds']:.0f} s | {run['nanoseconds_per_pixel']:.0f} ns | {small:.0f} ns "
            f"| {run['relative_to_small']:.2f} | {run['cpu_relative_to_small']:.2f} |"
        )
    table = "\n".join(rows)
    return f"""## A picture larger than memory, `{method}{option}` (`huge.py`)

{width}x{height} pixels of a 60-lpi print, direct light, 1 sample per pixel, `--memory`
{result["memory_limit"] / 1e9:.0f} GB; beside it a picture of {result["small"][0]}x{result["small"][1]} pixels.
Targets: a peak of at most {target}, time per pixel at most {result["target_relative"]} of the small picture's. The
clock counts what else ran on the machine, processor time does not.

| file | peak | size | time | per pixel | small, per pixel | ratio | ratio of processor time |
|---|---|---|---|---|---|---|---|
{table}
"""


def _huge_commands(result: dict[str, Any]) -> str:
    width, height = result["size"]
    rows = "\n".join(
        f"| {name} | {run['seconds']:.0f} s | {run['cpu_seconds']:.0f} s | {run['peak_resident_bytes'] / 1e9:.2f} GB |"
        for name, run in result["commands"].items()
    )
    pictures = "the pictures of `huge.py`"
    if result["repeated"] is not None:
        pictures = "a rendered picture of {}x{} again and again".format(*result["repeated"])
    return f"""## Commands on a picture larger than memory (`huge.py`, `huge_commands.py`)

{width}x{height} pixels of a 60-lpi print with 8 bits per channel: {pictures}. Each command is a process of its own.
`quilt` and `weave` go by the largest quilt there is, 16384x16384 pixels, and `weave` writes the print; `view` sends its
page and {result["commands"]["view"]["tiles"]} tiles of 2048x2048 pixels. Target: a peak of at most
{result["target_peak_bytes"] / 1e9:.0f} GB. Processor time is that of all threads; other work on the machine makes the
clock's longer.

| command | time | processor time | peak |
|---|---|---|---|
{rows}
"""


def _fuzz(result: dict[str, Any]) -> str:
    rows = []
    for name, runs in result["targets"].items():
        inputs, seconds, finds = (sum(run[key] for run in runs) for key in ("inputs", "cpu_seconds", "finds"))
        rows.append(f"| {name} | {inputs:,} | {seconds:.0f} | {finds} |".replace(",", " "))
    limits = result["limits"]
    return f"""## Damaged inputs (`fuzz.py`)

Every input has to end in a result or in an error of one line within {limits["seconds"]:g} s of CPU time and
{limits["bytes"] >> 20} MiB, and nothing may be printed. Finds are inputs that did not, before what they showed was
mended, and damaged `.mat` files and Zarr chunks for which SciPy and zstd reserve gigabytes that they never use; the
plain suite replays them.

| reader | inputs | CPU seconds | finds |
|---|---|---|---|
{chr(10).join(rows)}
"""


def _viewer(result: dict[str, Any]) -> str:
    found = result["median"]
    width, height = result["pixels"]
    return f"""## The viewer's page (`viewer.py`)

A picture of {width} x {height} pixels in Chromium with a software renderer, shown {result["canvas"]} pixels wide;
medians of {result["runs"]} runs.

| | measured | target |
|---|---|---|
| from asking for the page to the whole picture, file not yet read | {found["open_s"]:.2f} s | 3 s |
| from one eye to the next | {found["eye_ms"]:.1f} ms | |
| pictures a second while it sways | {found["sway_fps"]:.1f} | 30 |
"""


SECTIONS = {
    "methods": _methods,
    "first_picture": first_picture_tables.describe,
    "defaults": defaults_tables.describe,
    "caustics": caustics_tables.describe,
    "photon_share": photon_share_tables.describe,
    "light_vertices": light_vertices_tables.describe,
    "equal_error": equal_error_tables.describe,
    "goals": goals_tables.describe,
    "films": films_tables.describe,
    "film_encoding": film_encoding.describe,
    "drafts": drafts_tables.describe,
    "estimate_coverage": estimate_coverage_tables.describe,
    "reuse": _reuse,
    "weave": _weave,
    "cycles": _cycles,
    "splats": scene_file_tables.splats,
    "blender": scene_file_tables.blender,
    "blend_cycles": scene_file_tables.blend_cycles,
    "volumes": scene_file_tables.volumes,
    "formats": scene_file_tables.formats,
    "tachyon": _tachyon,
    "full_rate": _full_rate,
    "kernel_profile": kernel_profile_tables.describe,
    "half_and_double": half_and_double.describe,
    "large_frame": _large_frame,
    "huge": _huge,
    "huge_pooled_oidn-fast": _huge,
    "huge_commands": _huge_commands,
    "command": _command,
    "viewer": _viewer,
    "studio": studio_tables.section,
    "studio_command": studio_tables.command_section,
    "studio_pages": studio_tables.pages_section,
    "cluster": _cluster,
    "fuzz": _fuzz,
    "conformance": conformance_tables.describe,
}

if __name__ == "__main__":
    main()
