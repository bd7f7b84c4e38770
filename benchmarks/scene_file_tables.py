"""The tables of scene files of real size in ``docs/background/measurements.md``."""

from __future__ import annotations

from typing import Any


def splats(result: dict[str, Any]) -> str:
    rows = [
        "| splats | file | rays | reading | preparing | whole render | per ray | memory at most |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in result["rows"]:
        rows.append(
            f"| {row['splats']:,} | {row['file_bytes'] / 1e6:.0f} MB | {row['rays'] / 1e6:.1f} M | "
            f"{row['load_seconds']:.1f} s | {row['build_seconds']:.1f} s | {row['render_seconds']:.0f} s | "
            f"{1e6 * row['render_seconds'] / row['rays']:.1f} us | {row['peak_bytes'] / 2**30:.1f} GiB |"
        )
    width, height = result["rows"][0]["pixels"]
    return f"""## Gaussian splats (`splats.py`)

Splats sampled from the bundled `{result["scene"]}`, with harmonics of degree 3, for `{result["display"]}`:
{width}x{height} pixels, whose sub-pixels have rays of their own. Seconds are the processor's, of all threads together,
as the machine was shared: two cores of one's own take half of them.

{chr(10).join(rows)}
"""


def blender(result: dict[str, Any]) -> str:
    rows = [
        "| instances | triangles | `.blend` | as glTF | Blender, start to end | reading the glTF file |",
        "|---|---|---|---|---|---|",
    ]
    for row in result["rows"]:
        export, read = (row[f"{step}_seconds"]["median"] for step in ("export", "read"))
        rows.append(
            f"| {row['instances']} of {row['meshes']} meshes | {row['triangles']:,} "
            f"| {row['blend_bytes'] / 1e6:.1f} MB | {row['glb_bytes'] / 1e6:.1f} MB "
            f"| {export:.1f} s | {1000 * read:.0f} ms |"
        )
    return f"""## Blender files (`blender.py`)

The scene of `examples/blender_scene.py`, exported by Blender {result["blender"]} (its Python module) and read; medians
of {result["runs"]} runs.

{chr(10).join(rows)}
"""


def blend_cycles(result: dict[str, Any]) -> str:
    rows = ["| scene | mean | pixels |", "|---|---|---|"]
    for row in result["rows"]:
        mean = max(row["means"], key=lambda value: abs(value - 1.0))
        rows.append(f"| {row['scene'].replace('_', ' ')} | {mean:.3f} | {100 * row['off']:.1f} % |")
    return f"""## Blender files against Cycles (`blend_cycles.py`)

A camera's picture of 96 x 96 pixels of each scene of `tests/scene/readers/blend/make_cycles_pictures.py`, saved and
rendered by Blender {result["blender"]} (its Python module), 64 samples each. Shown are Lippmann's mean over that of
Cycles, in the channel that is farthest off, and the share of pixels whose sRGB codes differ by more than 0.1. Light of
the working space ACEScg is multiplied in Rec. 709 here: red light on a red surface is a quarter brighter. The object
that cameras do not see is left out, and so is its shadow.

{chr(10).join(rows)}
"""


def volumes(result: dict[str, Any]) -> str:
    rows = [
        "| transfer function | rays | reading | processor, reading and rendering | per ray | memory at most |",
        "|---|---|---|---|---|---|",
    ]
    for row in result["rows"]:
        rows.append(
            f"| `{row['transfer_function']}` | {row['rays'] / 1e6:.1f} M | {row['seconds_read']:.1f} s | "
            f"{row['processor_seconds']:.0f} s | {1e6 * row['processor_seconds'] / row['rays']:.1f} us | "
            f"{row['peak_bytes'] / 2**30:.1f} GiB |"
        )
    width, height = result["rows"][0]["panel"]
    size = " x ".join(map(str, result["size"]))
    return f"""## Volumes (`volumes.py`)

A synthetic CT of a head, {size} voxels of 16 bits, for `{result["display"]}`: {width}x{height} pixels, whose sub-pixels
have rays of their own. Seconds of the processor are those of all threads together, as the machine was shared.

{chr(10).join(rows)}
"""


def formats(result: dict[str, Any]) -> str:
    rows = [
        "| file | size | instances, triangles | reading | reading and rendering | processor | memory at most |",
        "|---|---|---|---|---|---|---|",
    ]
    for file, row in result["rows"].items():
        rows.append(
            f"| `{file}` | {row['bytes'] / 1e6:.1f} MB | {row['instances']:,}, {row['triangles']:,} | "
            f"{row['read_s']:.1f} s | {row['seconds']:.0f} s | {row['processor_s']:.0f} s | "
            f"{row['peak_bytes'] / 2**30:.1f} GiB |"
        )
    return f"""## Files of other kinds (`formats.py`)

A molecule of 99 999 atoms, whose balls and rods are traced as they are; a USD stage of 600 instances of six meshes,
loose and packed; a surface of a million triangles; a photograph of 12 megapixels with its depth. Each is read and
rendered as the shortest command does, for `{result["display"]}`, with kernels compiled before. Other work ran on the
machine.

{chr(10).join(rows)}
"""
