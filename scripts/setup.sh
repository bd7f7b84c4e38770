#!/usr/bin/env bash
# Sets up everything that Lippmann needs: a virtual environment in .venv with the package in it, and the LLVM runtime
# that the renderer compiles with. With --dev also what the tests need. What is there already is used again.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
# shellcheck source=scripts/system-packages.sh
. scripts/system-packages.sh

extras=
for argument in "$@"; do
  case $argument in
    --dev) extras='[dev]' ;;
    *) say "setup: unknown argument '$argument'; known is --dev" && exit 2 ;;
  esac
done
python=.venv/bin/python

# Prints the Python to build the environment with: $PYTHON if it is set, else the first one that is new enough.
find_python() {
  local name
  for name in ${PYTHON:+"$PYTHON"} $([ -n "${PYTHON:-}" ] || echo python3 python3.14 python3.13 python3.12 python3.11 python3.10); do
    if have "$name" && "$name" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
      command -v "$name"
      return
    fi
  done
  say "setup: Python 3.10 or newer is needed${PYTHON:+ ('$PYTHON' is not)}; install it: sudo apt-get install python3"
  return 1
}

make_environment() {
  local base version
  base=$(find_python)
  # Debian keeps the modules that make environments in a package of their own.
  if ! "$base" -c 'import venv, ensurepip' 2>/dev/null; then
    version=$("$base" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')
    have apt-cache && { candidate "$version-venv" || update_lists || true; }
    install_packages "Python's module for virtual environments" "$version-venv" || exit 1
  fi
  say "setup: making the virtual environment .venv with $("$base" --version)"
  "$base" -m venv --clear .venv
}

install_package() {
  local needs stamp=.venv/.set-up pip_options=()
  # An environment that was moved, or whose Python is gone, does not work any more.
  if ! "$python" -c '' 2>/dev/null || { [ -f "$stamp" ] && [ "$(tail -n 1 "$stamp")" != "$root" ]; }; then
    make_environment
  fi
  needs=$(cksum <pyproject.toml)
  # What was set up for development will do for use.
  if [ -f "$stamp" ] && grep -qxF -e "$needs $extras" -e "$needs [dev]" "$stamp"; then
    return
  fi
  say "setup: installing the package and what it needs; the first time that fetches several hundred MB"
  [ -t 1 ] || pip_options=(--quiet)
  "$python" -m pip install --disable-pip-version-check ${pip_options[@]+"${pip_options[@]}"} --editable ".$extras"
  printf '%s\n' "$needs $extras" "$root" >"$stamp"
}

# Succeeds if a render would find its engine: an LLVM library for the CPU, or a GPU.
engine_works() {
  "$python" -c 'from lippmann import llvm; llvm.choose()' 2>/dev/null ||
    "$python" -c 'from lippmann import engine; engine.start()' 2>/dev/null
}

engine_problem() {
  "$python" -c '
from lippmann import engine, errors
try:
    engine.start()
except errors.EngineError as error:
    print(error)' >&2
}

install_llvm() {
  local bounds package=
  engine_works && return
  if [ -n "${DRJIT_LIBLLVM_PATH:-}" ]; then # the user's own choice is not ours to mend
    engine_problem
    exit 1
  fi
  bounds=$("$python" -c 'from lippmann import llvm; print(llvm.OLDEST, llvm.NEWEST_TRIED)')
  if have apt-cache; then
    # shellcheck disable=SC2086
    package=$(newest_package '^libllvm[0-9]+(t64)?$' $bounds) ||
      { update_lists && package=$(newest_package '^libllvm[0-9]+(t64)?$' $bounds); } || true
    if [ -z "$package" ] && can_be_root; then
      say "setup: this system offers no LLVM ${bounds% *} or newer; a newer release of it does, and so does apt.llvm.org"
      exit 1
    fi
  fi
  install_packages "the LLVM runtime" "${package:-libllvm19}" || exit 1
  engine_works || {
    engine_problem
    exit 1
  }
}

# Mitsuba's package brings all its libraries but these, which small systems lack.
install_libraries() {
  local pair missing=()
  [ "$(uname -s)" = Linux ] || return 0
  for pair in libatomic.so.1:libatomic1 libstdc++.so.6:libstdc++6; do
    "$python" -c 'import ctypes, sys; ctypes.CDLL(sys.argv[1])' "${pair%:*}" 2>/dev/null || missing+=("${pair#*:}")
  done
  [ ${#missing[@]} -eq 0 ] || install_packages "what Mitsuba takes from the system" "${missing[@]}" || exit 1
}

# A renderer that some tests compare with; they are skipped without it.
install_tachyon() {
  have tachyon && return
  if have apt-get && can_be_root && { candidate tachyon || { update_lists && candidate tachyon; }; } &&
    install_packages "the renderer that tests compare with" tachyon; then
    return
  fi
  say "setup: 'tachyon' is not installed; the tests that compare with it will be skipped"
}

install_package
install_libraries
install_llvm
if [ -n "$extras" ]; then install_tachyon; fi
