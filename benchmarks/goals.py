"""What a quality takes that is asked for: by full, by full with Open Image Denoise, by pooled, and by stock views.

Time on two cores: about 2 hours, without references.

The scenes, displays and rows of equal_error.py. Each way is asked for a PSNR of the whole picture (``--quality``)
and works until its own estimate says that it is there, judging included, with at most 64 samples a pixel. Where full
does not come to the PSNR with these, its time is drawn out by the law of its noise. Time is that of the processors over
their number, photons included; each way has run before, for a low quality. Short runs are repeated, and the median
counts. Caustics come as by default.

*Stock views* are what there is without Lippmann: Mitsuba's own ``path`` along the very rays of the display, so that
nothing is lost by weaving, each view denoised by Open Image Denoise with albedo and normals, all views interlaced. They
know nothing of their error, so they are told: of 1, 2, 4 ... 256 samples the fewest count with which they are there by
two references with photons, denoised with the cheaper effort that gets there, and only that picture's time. Where they
are not there with 256, their time is drawn out as that of full, which flatters them: a denoised picture gains less than
noise falls (``gained``, in dB by the last doubling of the samples).

python benchmarks/goals.py [DISPLAY ...] [--scenes NAME,...] [--references FOLDER]
"""

from __future__ import annotations

import argparse
import statistics
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from equal_error import Judge, Picture, Stage, asked, light_up, prepare, timed
from harness import kept, save, saved

QUALITIES = (35.0, 40.0)
MOST_SAMPLES = 64
#: Stock views get more, as they do not meet caustics.
MOST_OF_STOCK = 256
#: Samples of either reference by which stock views are told their error. The mean of the products of the differences
#: from both is free of the references' own noise, so few samples do.
REFERENCE = 64
STOCK = "stock views"
#: Ways whose time is drawn out where they do not get there.
DRAWN_OUT = ("full", STOCK)
#: A quality that every way has after its first round.
LOW = 10.0
WAYS: dict[str, dict[str, Any]] = {
    "full": {"method": "full", "denoise": "none"},
    "full + oidn": {"method": "full", "denoise": "oidn"},
    "pooled": {"method": "pooled", "denoise": "auto"},
}


def main() -> None:
    results = saved("goals").get("results", {})
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--references", type=Path)
    given, scenes = asked(words)
    for name, displays in scenes:
        for display in displays:
            file = given.references and given.references / f"{display}-{name}-{REFERENCE}.npz"
            results.setdefault(display, {})[name] = _measured(prepare(name, display, caustics="auto"), file)
            summary = {kind: _summary(measured) for kind, measured in results.items()}
            save("goals", {"most_samples": MOST_SAMPLES, "results": results, "summary": summary})


def _measured(stage: Stage, references: Path | None) -> dict[str, Any]:
    found: dict[str, Any] = {f"{quality:g}": {} for quality in QUALITIES}
    for way, options in WAYS.items():
        _reached(stage, LOW, options)
        for quality in QUALITIES:
            found[f"{quality:g}"][way] = _reached(stage, quality, options)
    pictures = kept(references, lambda: {"pictures": np.stack([_reference(stage, seed) for seed in (1001, 2002)])})
    judge = Judge(stage, pictures["pictures"])
    for quality, reached in _stock(stage, judge).items():
        found[quality][STOCK] = reached
    return found


def _reference(stage: Stage, seed: int) -> Picture:
    return np.asarray(_picture(stage, {"method": "full", "denoise": "none", "spp": REFERENCE, "seed": seed}))


def _picture(stage: Stage, options: dict[str, Any]) -> Picture:
    from lippmann.rendering.methods import trace

    light_up(stage, _job(stage, options).request)
    picture: Picture = trace(_job(stage, options)).frame.pixels
    return picture


def _job(stage: Stage, options: dict[str, Any]) -> Any:
    from lippmann.rendering.methods import Job
    from lippmann.rendering.request.plan import resolve

    session = replace(stage.session, request=resolve(replace(stage.session.request, **options), stage.session.scene))
    return Job(session, stage.integrator, stage.source, stage.display_from_world)


def _stock(stage: Stage, judge: Judge) -> dict[str, dict[str, Any]]:
    """For each quality the fewest samples with which stock views have it, and their time."""
    guiding, guides = timed(lambda: _guides(stage))
    _stock_views(stage, 1)  # compiles
    found: dict[str, dict[str, Any]] = {}
    samples, seconds, curve = 1, 0.0, [-1.0]
    while samples <= MOST_OF_STOCK and len(found) < len(QUALITIES):
        traced, noisy = timed(lambda n=samples: _stock_views(stage, n))
        curve.append(curve[-1])
        for effort in ("fast", "high"):
            denoising, picture = timed(lambda e=effort, v=noisy: _without_noise(stage, v, guides, e))
            psnr, seconds = judge(picture)["psnr"], traced + guiding + denoising
            curve[-1] = max(curve[-1], psnr)
            for quality in QUALITIES:
                if psnr >= quality:
                    reached = {"seconds": seconds, "spp": samples, "psnr": psnr, "short": 0.0, "denoised": True}
                    found.setdefault(f"{quality:g}", reached)
        samples *= 2
    for quality in QUALITIES:
        short, gained = quality - curve[-1], curve[-1] - curve[-2]
        missed = {"seconds": _drawn_out(seconds, short), "spp": MOST_OF_STOCK, "psnr": curve[-1], "short": short}
        found.setdefault(f"{quality:g}", {**missed, "gained": gained, "denoised": True})
    return found


def _guides(stage: Stage) -> Any:
    from lippmann.rendering.denoise.tuning import TUNING
    from lippmann.rendering.film.feature_buffers import plan_guides, trace_guides

    plan = plan_guides(stage.source, TUNING.guide_samples, 4 << 30)
    return trace_guides(stage.built, stage.source, plan, stage.display_from_world)


def _without_noise(stage: Stage, picture: Picture, guides: Any, effort: Any) -> Picture:
    """Each view denoised by itself."""
    from lippmann.image.micro_images import Permutation, micro_images_as_views
    from lippmann.rendering.denoise.oidn import denoise

    order = Permutation(stage.display)
    layers = picture, guides.albedo, guides.normal
    views = [micro_images_as_views(order.split(layer), stage.display) for layer in layers]
    clean = np.empty(views[0].shape, dtype=np.float32)
    for place in np.ndindex(clean.shape[:2]):
        clean[place] = denoise(*(layer[place] for layer in views), clean_guides=True, effort=effort)
    joined: Picture = order.join(micro_images_as_views(clean, stage.display))
    return joined


def _stock_views(stage: Stage, samples: int) -> Picture:
    """Mitsuba's own integrator and sampler along the rays of all pixels, in bands, before the scene's background."""
    import drjit as dr
    import mitsuba as mi

    source, scene = stage.source, stage.built.mitsuba
    stock = mi.load_dict({"type": "path", "max_depth": stage.session.request.surfaces + 1, "rr_depth": 5})
    background = stage.integrator.features.background
    gain = 1.0 if stage.integrator.light.gain is None else float(np.array(stage.integrator.light.gain).ravel()[0])
    rows = max(1, (1 << 20) // (source.width * samples))
    picture = np.empty((source.height, source.width, 3), np.float32)
    for first in range(0, source.height, rows):
        count = min(rows, source.height - first)
        lanes = count * source.width * samples
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(first, lanes)
        pixel = dr.arange(mi.UInt32, lanes) // dr.opaque(mi.UInt32, samples)
        row = pixel // source.width
        ray = source.rays(
            pixel - row * source.width, row + dr.opaque(mi.UInt32, first), mi.UInt32(0), sampler.next_2d()
        )
        radiance = stock.sample(scene, sampler, mi.RayDifferential3f(ray))[0] * gain
        if background is not None:
            met = scene.ray_intersect_preliminary(ray, coherent=True).is_valid()
            radiance = dr.select(met, radiance, mi.Color3f(background))
        dr.eval(radiance)
        means = [dr.block_sum(part, samples) / samples if samples > 1 else part for part in radiance]
        band = np.array(dr.ravel(mi.Color3f(*means))).reshape(count, source.width, 3)
        picture[first : first + count] = np.nan_to_num(band)
    return picture


def _reached(stage: Stage, quality: float, options: dict[str, Any]) -> dict[str, Any]:
    """Seconds and samples, and where it ended."""
    from lippmann.rendering.methods import trace

    options = {"quality": quality, "spp": MOST_SAMPLES, **options}

    def lit() -> Any:
        light_up(stage, _job(stage, options).request)
        return trace(_job(stage, options))

    seconds, traced = timed(lit)
    assert traced.estimate is not None
    short = max(0.0, quality - traced.estimate.psnr)
    if options["denoise"] == "none":
        seconds = _drawn_out(seconds, short)
    return {
        "seconds": seconds,
        "spp": traced.samples,
        "psnr": traced.estimate.psnr,
        "short": short,
        "denoised": "denoise" in traced.options,
    }


def _drawn_out(seconds: float, short: float) -> float:
    """The time that noise takes to fall by ``short`` dB more: its error times its time is constant."""
    return seconds * float(10 ** (short / 10))


def _summary(scenes: dict[str, Any]) -> dict[str, Any]:
    """By quality and rival: how many times as fast pooled is, over the scenes in which it gets there."""
    summary: dict[str, Any] = {}
    for quality in next(iter(scenes.values())):
        for rival in ("full", "full + oidn", STOCK):
            times = {
                name: goals[quality][rival]["seconds"] / goals[quality]["pooled"]["seconds"]
                for name, goals in scenes.items()
                if rival in goals[quality]
                and not goals[quality]["pooled"]["short"]
                and (rival in DRAWN_OUT or not goals[quality][rival]["short"])
            }
            if times:
                mean = statistics.geometric_mean(times.values())
                summary[f"{rival} to {quality}"] = {"times_faster": mean, "least": min(times.values()), "scenes": times}
    return summary


if __name__ == "__main__":
    main()
