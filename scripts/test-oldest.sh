#!/usr/bin/env bash
# Runs the tests of picture and light field files with the oldest versions that pyproject.toml allows of the libraries
# that read them: old decoders trust files more than new ones do. The environment lies in build/oldest and is used again.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
environment=build/oldest
libraries=(numpy pillow tifffile imagecodecs OpenEXR trimesh h5py scipy zarr)

# Prints a Python for which the oldest versions still have wheels: $PYTHON if it is set, else the first that there is.
find_python() {
  local name
  for name in ${PYTHON:-python3.10 python3.11}; do
    if "$name" -c 'import venv, ensurepip' 2>/dev/null; then
      printf '%s\n' "$name"
      return
    fi
  done
  printf '%s\n' "test-oldest: none of ${PYTHON:-python3.10 python3.11} is there; name one: PYTHON=... make test-oldest" >&2
  return 1
}

# Prints the oldest version of each library as pip wants it: "zarr>=2.18.3,<4" becomes zarr==2.18.3.*.
oldest_versions() {
  local name version
  for name in "${libraries[@]}"; do
    version=$(sed -nE "s/.*\"$name>=([0-9.]+).*/\\1/p" pyproject.toml | sort -uV | head -n 1)
    printf '%s==%s.*\n' "$name" "$version"
  done
  printf '%s\n' 'numcodecs<0.16' # newer ones do not load with zarr 2
}

stamp=$environment/.versions
if [ "$(cat "$stamp" 2>/dev/null)" != "$(oldest_versions)" ]; then
  python=$(find_python)
  "$python" -m venv --clear "$environment"
  mapfile -t versions < <(oldest_versions)
  "$environment/bin/python" -m pip install --disable-pip-version-check --quiet \
    "${versions[@]}" pytest hypothesis psutil rich tomli typer numba
  oldest_versions >"$stamp"
fi
PYTHONPATH=src exec "$environment/bin/python" -m pytest -p no:cacheprovider "$@" \
  tests/codecs/test_zarr_reader.py tests/image/test_read.py tests/image/test_write.py tests/image/test_write_rows.py \
  tests/image/test_streamed.py \
  tests/exchange/test_zarr_store.py tests/exchange/test_lftoolbox_mat.py tests/codecs/test_pillow_formats.py
