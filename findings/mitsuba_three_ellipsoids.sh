#!/usr/bin/env bash
# Mitsuba 3: a shape of exactly three ellipsoids (or Gaussian splats) prints lines of failures on standard error; of two or four, none.
#
# Versions: Mitsuba 3.9.1 (PyPI), NumPy 2, Python 3.
# Believed: tensors of `centers`, `scales` and `quaternions` with a row for each ellipsoid are taken in silence.
# What happens: of three rows the loader tries to make a colour and a vector first, and each try that fails says so on
#   standard error ("nanobind: implicit conversion from type 'TensorXf' ... failed!"). The shape is right all the same.
# Who is hurt: whoever draws molecules of three atoms (water, carbon dioxide) or tests with three splats: programs that
#   take any word on standard error for a failure stop, and users look for a fault that is not there.
# Seen: "2 ellipsoids: 0 lines", "3 ellipsoids: 9 lines", "4 ellipsoids: 0 lines".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy
cd "$folder"
cat > three.py <<'PYTHON'
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
count = int(sys.argv[1])
numbers = {
    "centers": np.arange(3.0 * count).reshape(count, 3),
    "scales": np.ones((count, 3)),
    "quaternions": np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
}
mi.load_dict({"type": "ellipsoids", **{name: mi.TensorXf(values) for name, values in numbers.items()}})
PYTHON
fault=0
for count in 2 3 4; do
    lines=$("$folder/venv/bin/python" three.py "$count" 2>&1 > /dev/null | grep -c "implicit conversion" || true)
    echo "$count ellipsoids: $lines lines"
    if [ "$count" = 3 ]; then [ "$lines" -gt 0 ] || fault=1; else [ "$lines" = 0 ] || fault=1; fi
done
exit $fault
