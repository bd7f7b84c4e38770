#!/usr/bin/env bash
# Sets up everything that Lippmann needs: packages of the system (the LLVM runtime that the renderer compiles with, and
# small ones), a virtual environment in .venv, and the package in it. With --dev also what the tests need. What is there
# already is used again.
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

# Prints the Python to build the environment with: $PYTHON if it is set, else the first one that is new enough.
find_python() {
  local name names=(python3 python3.14 python3.13 python3.12 python3.11 python3.10)
  [ -z "${PYTHON:-}" ] || names=("$PYTHON")
  for name in "${names[@]}"; do
    if have "$name" && "$name" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
      command -v "$name"
      return
    fi
  done
  say "setup: Python 3.10 or newer is needed${PYTHON:+ ('$PYTHON' is not)}; install it: sudo apt-get install python3"
  return 1
}

# What the package itself knows needs nothing but Python.
ask_package() {
  PYTHONPATH=src "$python" -c "$1" 2>/dev/null
}

can_load() {
  "$python" -c 'import ctypes, sys; ctypes.CDLL(sys.argv[1])' "$1" 2>/dev/null
}

# Prints the package with the LLVM runtime: the newest that was tried and that apt can install.
llvm_package() {
  # shellcheck disable=SC2046
  newest_package '^libllvm[0-9]+(t64)?$' $(ask_package 'from lippmann.runtime import llvm; print(llvm.OLDEST, llvm.NEWEST_TRIED)')
}

# Fills `missing` with the packages of the system that are not there.
find_missing() {
  missing=()
  # Debian keeps the modules that make environments in a package of their own.
  environment_works || "$python" -c 'import venv, ensurepip' 2>/dev/null ||
    missing+=("$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')")
  if [ "$(uname -s)" = Linux ]; then # Mitsuba's package brings all its libraries but these
    can_load libatomic.so.1 || missing+=(libatomic1)
    can_load libstdc++.so.6 || missing+=(libstdc++6)
  fi
  ask_package 'from lippmann.runtime import llvm; llvm.choose()' || find_llvm_package
}

# Adds the package with the LLVM runtime to `missing`, or says where to get it and ends.
find_llvm_package() {
  local package
  if [ -n "${DRJIT_LIBLLVM_PATH:-}" ]; then
    say "setup: DRJIT_LIBLLVM_PATH is '$DRJIT_LIBLLVM_PATH', which is no LLVM library that would do; unset or correct it"
    exit 1
  fi
  if ! have apt-get; then
    say "setup: no LLVM library that would do is installed; $(ask_package 'from lippmann.runtime import llvm; print(llvm.install_command())')"
    exit 1
  fi
  # A GPU needs no LLVM.
  if ! can_be_root && ask_package 'from lippmann.runtime import gpu; raise SystemExit(gpu.find() is None)'; then return; fi
  if package=$(llvm_package) || { update_lists && package=$(llvm_package); }; then
    missing+=("$package")
  elif [ -z "$(apt-cache search --names-only '^libllvm[0-9]+')" ]; then
    missing+=(libllvm19) # there are no lists to choose from; this one is the most widespread
  else
    say "setup: this release of the system offers no LLVM that would do; LLVM's makers do. Get theirs, then start again:"
    say "  wget https://apt.llvm.org/llvm.sh && sudo bash llvm.sh 19"
    exit 1
  fi
}

environment_works() {
  # One that was moved does not work any more, and neither does one whose Python is gone.
  .venv/bin/python -c '' 2>/dev/null && { [ ! -f $stamp ] || [ "$(tail -n 1 $stamp)" = "$root" ]; }
}

make_environment() {
  environment_works && return
  say "setup: making the virtual environment .venv with $("$python" --version)"
  "$python" -m venv --clear .venv
}

install_package() {
  local needs options=()
  needs=$(cksum <pyproject.toml)
  # What was set up for development will do for use.
  if [ -f $stamp ] && grep -qxF -e "$needs $extras" -e "$needs [dev]" $stamp; then
    return
  fi
  say "setup: installing the package and what it needs; the first time that fetches several hundred MB"
  [ -t 1 ] || options=(--quiet)
  .venv/bin/python -m pip install --disable-pip-version-check ${options[@]+"${options[@]}"} --editable ".$extras"
  printf '%s\n' "$needs $extras" "$root" >$stamp
}

# A renderer that some tests compare with; they are skipped without it.
install_tachyon() {
  have tachyon && return
  if have apt-get && can_be_root && { candidate tachyon || { update_lists && candidate tachyon; }; } &&
    install_packages tachyon; then
    return
  fi
  say "setup: 'tachyon' is not installed; the tests that compare with it will be skipped"
}

browser_works() {
  have chromium || have chromium-browser || have google-chrome-stable || have google-chrome ||
    .venv/bin/python -c '
from os.path import exists
from playwright.sync_api import sync_playwright
with sync_playwright() as playwright:
    raise SystemExit(not exists(playwright.chromium.executable_path))' 2>/dev/null
}

# The browser that tests of pages drive; they are skipped without one. Where the system has chromium only as a snap
# (Ubuntu) or not at all, Playwright fetches its own; that is tried once.
install_browser() {
  local options=() tried=.venv/.browser-tried
  { browser_works || [ -f $tried ]; } && return
  if have apt-get && can_be_root && { candidate chromium || { update_lists && candidate chromium; }; } &&
    install_packages chromium; then
    return
  fi
  ! have apt-get || ! can_be_root || options=(--with-deps)
  say "setup: fetching a browser for the tests of pages"
  touch $tried
  .venv/bin/python -m playwright install ${options[@]+"${options[@]}"} chromium >/dev/null 2>&1 ||
    say "setup: no browser could be had; the tests of pages will be skipped. Install chromium to run them"
}

stamp=.venv/.set-up
if [ -L .venv ] && ! environment_works; then # to make it anew would empty the other one
  say "setup: .venv is a link to an environment of another folder; remove the link: rm .venv"
  exit 1
fi
python=$(find_python)
find_missing
[ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}"
[ -z "$extras" ] || install_tachyon
make_environment
install_package
[ -z "$extras" ] || install_browser
