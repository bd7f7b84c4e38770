"""The figures of an experiment as plain values, for JSON."""

from __future__ import annotations

import math

from lippmann.json_values import JsonObject
from lippmann.reproduce import paper_values
from lippmann.reproduce.experiment import Results, Run


def summary(results: Results) -> JsonObject:
    """All figures as JSON-able values; an infinite PSNR is None. What the paper prints is under ``printed``."""
    experiment = results.experiment
    reference = results.full(experiment.scenes[0]).image.provenance
    return {
        "version": reference.version,
        "device": reference.device,
        "display": experiment.display.summary(),
        "integrator": reference.integrator,
        "depth": reference.depth,
        "runs": experiment.runs,
        "scenes": _of_scenes(results),
        "physical": {} if results.physical is None else _of_scenes(results.physical),
        "printed": {
            "full_seconds": list(paper_values.FULL_SECONDS),
            "saved_percent": list(paper_values.SAVED_PERCENT),
            "tree_saved_percent": paper_values.TREE_PRINTED_PERCENT,
            "tree_saved_percent_of_its_seconds": paper_values.TREE_COMPUTED_PERCENT,
            "teapot_psnr": paper_values.TEAPOT_PSNR,
            "teapot_lenses": paper_values.TEAPOT_LENSES,
        },
    }


def _of_scenes(results: Results) -> JsonObject:
    return {scene: {key: _run(run) for key, run in runs.items()} for scene, runs in results.runs.items()}


def _run(run: Run) -> JsonObject:
    provenance, variant = run.image.provenance, run.variant
    values: JsonObject = {
        "method": variant.method,
        "seconds": run.seconds,
        "rays": dict(provenance.rays),
        "traced_fraction": run.traced_share,
    }
    if run.comparison is None:
        return values
    comparison = run.comparison
    return values | {
        "order": variant.order,
        "respect_gloss": variant.respect_gloss,
        "saved_seconds": run.saved_seconds,
        "saved_percent": run.saved_percent,
        "ray_share": run.ray_share,
        "paper_mean_psnr": _finite(comparison.paper.mean_psnr),
        "psnr": _finite(comparison.psnr),
        "worst_psnr": _finite(comparison.worst.psnr),
        "percentile_1_psnr": _finite(comparison.percentile_1.psnr),
        "ssim": _finite(comparison.views.mean),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
