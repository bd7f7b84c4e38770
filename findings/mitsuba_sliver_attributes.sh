#!/usr/bin/env bash
# Mitsuba 3: attributes of a mesh's vertices (such as `vertex_color`) are NaN on sliver triangles, though rays hit them.
#
# Versions: Mitsuba 3.9.1 (PyPI), NumPy 2, Python 3.
# Believed: where a ray meets a triangle, an attribute of its corners is interpolated as positions and uvs are, and lies
#   between the corners' values.
# What happens: the shape finds barycentric coordinates anew from the hit point, by the determinant a c - b^2 of its
#   edges' products in single precision. Of a triangle 2 long and 0.0001 high that is 0, and its inverse infinite: the
#   attribute is NaN. The ray's own coordinates (and uvs, which are made of them) are finite.
# Who is hurt: renderers of coloured CAD models and scans, where slivers are common: black specks where NaN is dropped,
#   and denoisers that refuse an albedo which is not finite.
# Seen: "hit True, uv finite True, attribute [nan nan nan]", "wide: attribute [0.25 0.25 0.25]".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy
cd "$folder"
cat > sliver.py <<'PYTHON'
import mitsuba as mi
import numpy as np

print("mitsuba", mi.__version__)
mi.set_variant("scalar_rgb")


def color_at(corners, x, y):
    mesh = mi.Mesh("m", vertex_count=3, face_count=1, has_vertex_texcoords=True)
    mesh.add_attribute("vertex_color", 3, [0.25] * 9)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ravel(corners)
    parameters["vertex_texcoords"] = [0, 0, 1, 0, 0, 1]
    parameters["faces"] = [0, 1, 2]
    parameters.update()
    scene = mi.load_dict({"type": "scene", "mesh": mesh})
    si = scene.ray_intersect(mi.Ray3f([x, y, 5], [0, 0, -1]))
    finite = bool(np.isfinite(np.array(si.uv)).all())
    return bool(si.is_valid()), finite, np.array(si.shape.eval_attribute_3("vertex_color", si))


hit, finite, color = color_at([(-1, 0, 0), (1, 0, 0), (1, 1e-4, 0)], 0.5, 2e-5)
print(f"hit {hit}, uv finite {finite}, attribute {color}")
_, _, wide = color_at([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], 0.0, 0.0)
print(f"wide: attribute {wide}")
raise SystemExit(not (hit and finite and np.isnan(color).all() and np.allclose(wide, 0.25)))
PYTHON
"$folder/venv/bin/python" sliver.py
