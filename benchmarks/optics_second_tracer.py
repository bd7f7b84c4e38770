"""Our trace of one lens against Optiland's, another tracer: where rays land, and how far apart the two put them.

Time on two cores: an estimated minute.

python benchmarks/optics_second_tracer.py

Needs Optiland (MIT), which is heavy and no dependency of ours: ``pip install optiland==0.6.3`` into an environment of
its own, with ``PYTHONPATH=src``. Writes benchmarks/results/optics_second_tracer.json: for each lens the largest
distance in millimetres between the two landing points, and some landing points, which a test holds our trace against.
"""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path

import numpy as np
from optiland.materials import IdealMaterial
from optiland.optic import Optic
from optiland.rays import RealRays

from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.optics.lens import Lens
from lippmann.optics.trace import crest, trace

RESULT = Path(__file__).parent / "results" / "optics_second_tracer.json"

#: Layout, pitch, crest radius, thickness, index, conic constant.
LENSES = {
    "18lpi": ("lenticular", 25.4 / 18, 1.2319, 3.03, 1.5865, 0.0),
    "50lpi": ("lenticular", 25.4 / 50, 0.2707, 0.5895, 1.6357, 0.0),
    "60lpi at best focus": ("lenticular", 25.4 / 60, 0.2656, 0.6604, 1.57, 0.0),
    "elliptical cylinder": ("lenticular", 25.4 / 60, 0.2398, 0.6604, 1.57, -1 / 1.57**2),
    "micro-lens": ("square", 0.5, 0.45, 1.0, 1.57, 0.0),
    "parabolic micro-lens": ("square", 0.5, 0.45, 1.0, 1.49, -1.0),
}
#: Slopes across and along.
SLOPES = [(0.0, 0.0), (0.2, 0.0), (-0.35, 0.1), (0.1, 0.8)]
WAVELENGTH = 0.55


def optiland_landing(lens: Lens, x: np.ndarray, y: np.ndarray, slopes: tuple[float, float]) -> np.ndarray:
    """Where Optiland lands rays through points of the crest; their z runs down, from the top of the crest."""
    profile = lens.profile
    glass = IdealMaterial(n=profile.index)
    optic = Optic()
    optic.surfaces.add(index=0, thickness=np.inf)
    shape = (
        {"surface_type": "biconic", "radius_x": profile.radius, "radius_y": np.inf, "conic_x": profile.conic}
        if lens.is_cylinder
        else {"surface_type": "standard", "radius": profile.radius, "conic": profile.conic}
    )
    optic.surfaces.add(index=1, thickness=profile.thickness, material=glass, is_stop=True, **shape)
    optic.surfaces.add(index=2)
    optic.set_aperture(aperture_type="EPD", value=lens.pitch)
    optic.fields.set_type(field_type="angle")
    optic.fields.add(y=0)
    optic.wavelengths.add(value=WAVELENGTH, is_primary=True)
    length = np.sqrt(1 + slopes[0] ** 2 + slopes[1] ** 2)
    depth, _ = crest(lens, x, y)
    back = 1.0 + depth  # rays begin a millimetre over the top
    rays = RealRays(
        x + back * slopes[0],
        y + back * slopes[1],
        np.full_like(x, -1.0),
        np.full_like(x, -slopes[0] / length),
        np.full_like(x, -slopes[1] / length),
        np.full_like(x, 1 / length),
        np.ones_like(x),
        np.full_like(x, WAVELENGTH),
    )
    optic.surfaces.trace(rays)
    return np.stack([np.asarray(rays.x), np.asarray(rays.y)])


def main() -> None:
    """Compare and write the result."""
    found = {}
    for name, (layout, pitch, radius, thickness, index, conic) in LENSES.items():
        lens = Lens(LensProfile(radius, thickness, index, conic), LensArray(layout, pitch))
        x, y = lens.samples(33 if lens.is_cylinder else 7)
        inside = x**2 + y**2 * (not lens.is_cylinder) < (0.97 * lens.reach) ** 2
        x, y = x[inside], y[inside]
        rows, worst = [], 0.0
        for slopes in SLOPES:
            ours = trace(lens, x, y, *slopes)
            lit = ours.area > 0
            theirs = optiland_landing(lens, x[lit], y[lit], slopes)
            away = np.hypot(theirs[0] - ours.x[lit], theirs[1] - ours.y[lit])
            worst = max(worst, float(away.max()))
            for k in np.linspace(0, np.count_nonzero(lit) - 1, 6).astype(int):
                point = [float(x[lit][k]), float(y[lit][k])]
                rows.append({"slopes": slopes, "through": point, "lands": [float(v) for v in theirs[:, k]]})
        profile = {"radius": radius, "thickness": thickness, "index": index, "conic": conic}
        lens_values = {"layout": layout, "pitch": pitch, "profile": profile}
        found[name] = {**lens_values, "largest_distance_mm": worst, "rays": rows}
        print(f"{name}: at most {worst:.2e} mm apart")
    result = {"tracer": f"Optiland {version('optiland')}", "lenses": found}
    RESULT.write_text(json.dumps(result) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
