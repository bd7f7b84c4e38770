"""Benzene with one fluorine, as balls and sticks on a hexagonal micro-lens array; molecule.png."""

import math
import sys
import tempfile
from pathlib import Path

import lippmann
from lippmann.image.write import write_plain_picture

DISPLAY = lippmann.Display(
    name="array",
    panel=lippmann.Panel(width=960, height=960, pixel_pitch=0.08),
    lens_array=lippmann.LensArray(layout="hexagonal", pitch=0.4),
    gap=1.2,
    viewing_distance=450.0,
)


def atoms() -> list[str]:
    """Lines of a PDB file: six carbons 1.39 angstroms from the middle, six atoms around them."""
    lines = []
    for number in range(6):
        angle = math.radians(60 * number + 90)
        for radius, element in ((1.39, "C"), (2.74, "F") if number == 0 else (2.48, "H")):
            x, y = radius * math.cos(angle), radius * math.sin(angle)
            atom, place = f"{len(lines) + 1:5}  {element:<3}", f"{x:8.3f}{y:8.3f}{0.0:8.3f}"
            lines.append(f"HETATM{atom} FBZ A   1    {place}  1.00  0.00          {element:>2}")
    return [*lines, "END"]


def main(path: Path, spp: int = 4) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "molecule.pdb")
        file.write_text("\n".join(atoms()))
        scene = lippmann.load_scene(file, background=(0.9, 0.9, 0.9))
    image = lippmann.render(scene, DISPLAY, placement={"turn": (25, 15)}, spp=spp)
    seen = image.replay(size=(496, 496), filter="linear")
    write_plain_picture(seen[8:-8, 8:-8], path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
