"""Rate of ``full`` against Mitsuba's own integrator on the very same rays: what the lens arrays and the ledger cost.

Time on two cores: an estimated minute.

Direct light, the bundled teapot, the paper's display (512 x 512 pixels), one sample per pixel, warm kernels. The rival
gets its rays from the same code and its random numbers from Mitsuba's sampler, is evaluated, and is brought to the host
like ours. The target is a rate of at least 85 % of the rival's.
"""

from __future__ import annotations

import numpy as np

from harness import interleaved, median_ratio, save, summary


def main() -> None:
    from lippmann.runtime import engine

    engine.start("cpu")
    import drjit as dr
    import mitsuba as mi

    from lippmann.api import load_scene
    from lippmann.device.pbr import build
    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.display import load_display
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.path import PathIntegrator
    from lippmann.rendering.transport.ray_source import DisplayRays
    from lippmann.scene.placement import place

    scene = load_scene("teapot")
    built = build(scene)
    display = load_display("seed-lenticular")
    placement = place(scene.bounds, display, cameras=scene.cameras, home_camera=scene.home_camera)
    source = DisplayRays(display, placement.world_from_display)
    width, height = source.width, source.height
    plan = cut_wavefronts(width, height, 1, memory=2**31)
    ours = PathIntegrator(
        built.mitsuba,
        make_scene_features(
            built.mitsuba, background=built.background, has_null=built.has_null, absorption=built.absorption
        ),
        1,
        name="direct",
    )
    rival = mi.load_dict({"type": "direct"})

    def full(run: int) -> object:
        return trace_frame(ours, source, plan, seed=run).pixels

    def mitsuba_direct(run: int) -> object:
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(run, width * height)
        lane = dr.arange(mi.UInt32, width * height)
        row = lane // width
        ray = source.rays(lane - row * width, row, mi.UInt32(0), sampler.next_2d())
        radiance = rival.sample(built.mitsuba, sampler, ray)[0]
        dr.eval(radiance)
        return np.array(radiance)

    seconds = interleaved({"full": full, "mitsuba": mitsuba_direct}, runs=31, warm_up=4)
    rate = median_ratio(seconds["mitsuba"], seconds["full"])
    save(
        "full_rate",
        {
            "scene": "teapot",
            "display": display.name,
            "seconds": {name: summary(values) for name, values in seconds.items()},
            "megarays_per_second": width * height / summary(seconds["full"])["median"] / 1e6,
            "rate_relative_to_mitsuba": rate,
            "target": 0.85,
        },
    )


if __name__ == "__main__":
    main()
