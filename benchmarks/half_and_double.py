"""What every tuned constant of ``rendering`` is worth: the PSNR of small pictures with half of it and with double.

Time on two cores: an estimated half an hour for all packages.

One field of a package's dataclass of tuned constants is set at a time, a few small scenes are rendered with few
samples, and the PSNR of the pixels against long references is compared with that of the program as it is. A constant
that moves nothing here is either for other scenes (its text says which), for statements of the error and for stopping
(``estimate_coverage.py``, ``goals.py``), or not needed. Rows of packages that are not named are kept.

    python half_and_double.py --packages denoise sharing
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import pkgutil
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness import save, saved

Picture = NDArray[np.float32]

SCENES = ("teapot", "room", "primitives")
SIZE = (96, 64)
SAMPLES = 4
REFERENCE_SAMPLES = 128
#: dB that rows of the table must move to be told apart from the chance of other samples.
NOISE = 0.1


def tunings() -> dict[str, Any]:
    """The tuned constants of every package below ``rendering`` by its name: what its ``tuning`` offers as TUNING."""
    import lippmann.rendering as package

    names = [each.name for each in pkgutil.walk_packages(package.__path__, "lippmann.rendering.")]
    found = {name: importlib.import_module(name) for name in names if name.endswith(".tuning")}
    values = {name.split(".")[2]: module.TUNING for name, module in found.items() if hasattr(module, "TUNING")}
    return {name: tuning for name, tuning in values.items() if dataclasses.is_dataclass(tuning)}


def scaled(value: Any, factor: float) -> Any:
    """A number, or each of several, times a factor; whole numbers stay whole and at least 1."""
    if isinstance(value, tuple):
        return tuple(scaled(each, factor) for each in value)
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


class Judge:
    """Small pictures of a few scenes beside their long references."""

    def __init__(self) -> None:
        import lippmann

        self._display = lippmann.load_display("seed-lenticular").resized(*SIZE)
        self._scenes = {name: lippmann.load_scene(name) for name in SCENES}
        self._references = {
            name: self._render(name, method="full", denoise="none", spp=REFERENCE_SAMPLES, seed=991) for name in SCENES
        }

    def _render(self, name: str, **options: Any) -> Picture:
        import lippmann

        # Bundled scenes have classic light by default, which few constants of ``rendering`` touch.
        common: dict[str, Any] = {"integrator": "path", "tone_map": "none"}
        pixels: Picture = lippmann.render(self._scenes[name], self._display, **common, **options).pixels
        return pixels

    def psnr(self) -> dict[str, float]:
        """Of each scene with the constants as they are now."""
        from lippmann.color.transfer import encode_srgb

        found = {}
        for name, reference in self._references.items():
            picture = self._render(name, spp=SAMPLES, seed=1)
            error = np.square(encode_srgb(picture.astype(float)) - encode_srgb(reference.astype(float))).mean()
            found[name] = round(float(-10 * np.log10(error)), 3)
        return found


def rows(package: str, tuning: Any, judge: Judge, usual: dict[str, float]) -> Iterator[dict[str, Any]]:
    """For each constant the PSNR with half and with double of it, less the usual one; the mean and the least."""
    for field in dataclasses.fields(tuning):
        value, moved = getattr(tuning, field.name), {}
        for name, factor in (("half", 0.5), ("double", 2.0)):
            object.__setattr__(tuning, field.name, scaled(value, factor))
            try:
                gains = [psnr - usual[scene] for scene, psnr in judge.psnr().items()]
                moved[name] = {"mean": round(float(np.mean(gains)), 2), "least": round(min(gains), 2)}
            except Exception as error:  # noqa: BLE001 a constant may allow no other value
                moved[name] = {"fails": type(error).__name__}
            finally:
                object.__setattr__(tuning, field.name, value)
        yield {"package": package, "constant": field.name, "value": value, **moved}


def table(found: list[dict[str, Any]]) -> str:
    """Markdown of all rows."""

    def cell(moved: dict[str, Any]) -> str:
        if "fails" in moved:
            return "fails"
        return (
            "0" if abs(moved["least"]) < NOISE > abs(moved["mean"]) else f"{moved['mean']:+.2f} ({moved['least']:+.2f})"
        )

    head = "| package | constant | value | half: mean (least) | double: mean (least) |\n|---|---|---|---|---|"
    lines = [
        f"| {row['package']} | `{row['constant']}` | {row['value']} | {cell(row['half'])} | {cell(row['double'])} |"
        for row in sorted(found, key=lambda row: (row["package"], row["constant"]))
    ]
    return "\n".join([head, *lines]) + "\n"


def describe(result: dict[str, Any]) -> str:
    """The section of ``docs/background/measurements.md``."""
    return f"""## Tuned constants at half and double

`half_and_double.py`: PSNR in dB that small pictures of {", ".join(result["scenes"])} in light along paths gain with
half of one constant and with double of it, {result["samples"]} samples per pixel; in the mean, and in brackets
on the scene that gains least. 0 is less than {NOISE} dB. Constants of estimates and of stopping move no
picture of a given number of samples.

{table(result["rows"])}"""


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--packages", nargs="+", help="of rendering; default: all")
    options.add_argument("--threads", type=int, default=2)
    chosen = options.parse_args()

    from lippmann.runtime import engine

    engine.start("cpu", chosen.threads)
    of_all = tunings()
    names = chosen.packages or list(of_all)
    found = [row for row in saved("half_and_double").get("rows", []) if row["package"] not in names]
    judge = Judge()
    usual = judge.psnr()
    for name in names:
        for row in rows(name, of_all[name], judge, usual):
            found.append(row)
            # After every row: each takes seconds, all of them long.
            save("half_and_double", {"scenes": SCENES, "samples": SAMPLES, "usual": usual, "rows": found})
    print(table(found))


if __name__ == "__main__":
    main()
