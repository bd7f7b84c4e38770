"""The table of methods: time and quality of each on the bundled teapot, for the paper's display.

Time on two cores: an estimated 5 minutes, most of them for the reference.

Path light of the default depth, 512 x 512 pixels. Quality is PSNR of sRGB-coded pixels in [0, 1] against ``full`` at
512 samples per pixel with another seed. Times are medians of warm runs: tracing, reuse and denoising; with two samples
or more denoised pictures are denoised in halves, and judge themselves.
"""

from __future__ import annotations

import statistics

import numpy as np

from harness import save

REFERENCE_SPP = 512
CASES = [
    *(("full", "", {"spp": spp}) for spp in (1, 4, 16, 64)),
    *(("full", " `--denoise oidn`", {"spp": spp, "denoise": "oidn"}) for spp in (1, 4, 16)),
    *(("pooled", "", {"spp": spp}) for spp in (1, 4, 16)),
    ("lens-view", "", {"spp": 16}),
    ("interpolated", "", {"spp": 16}),
]


def main() -> None:
    import lippmann
    from lippmann.color.transfer import encode_srgb

    scene = lippmann.load_scene("teapot")

    def coded(image: lippmann.IntegralImage) -> np.ndarray:
        return image.with_pixels(encode_srgb(np.clip(image.pixels, 0, 1))).micro_images().astype(np.float64)

    reference = coded(lippmann.render(scene, spp=REFERENCE_SPP, seed=12345, tone_map="none"))
    rows = []
    for method, options, parameters in CASES:
        lippmann.render(scene, method=method, tone_map="none", **parameters)
        runs = [lippmann.render(scene, method=method, tone_map="none", **parameters) for _ in range(3)]
        error = ((coded(runs[0]) - reference) ** 2).mean(axis=(2, 3, 4))
        seconds = [run.stats["seconds"] for run in runs]
        rows.append(
            {
                "method": method,
                "options": options,
                "spp": parameters["spp"],
                "seconds": statistics.median(s["trace"] + s["reuse"] + s.get("denoise", 0.0) for s in seconds),
                "psnr": float(-10 * np.log10(error.mean())),
                "psnr_worst": float(-10 * np.log10(error.max())),
                "traced_fraction": runs[0].stats["traced_fraction"],
            }
        )
    save("methods", {"scene": "teapot", "reference_spp": REFERENCE_SPP, "rows": rows})


if __name__ == "__main__":
    main()
