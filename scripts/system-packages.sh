# Functions to install packages of the system (Debian, Ubuntu and their kin), to be sourced by other scripts.
# Root is asked for only when something is to be installed, and only where someone can answer.

say() { printf '%s\n' "$*" >&2; }

have() { command -v "$1" >/dev/null 2>&1; }

# Whether as_root would work; on a terminal it may ask for a password.
can_be_root() {
  [ "$(id -u)" -eq 0 ] && return
  have sudo || return 1
  sudo -n true 2>/dev/null || [ -t 0 ]
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

updated=no

# Fetches the lists of packages, at most once.
update_lists() {
  [ "$updated" = no ] || return 0
  updated=yes
  can_be_root || return 1
  say "setup: fetching the lists of packages (apt-get update)"
  as_root apt-get update -qq >&2 || say "setup: some lists could not be fetched; going on with those that are there"
}

# candidate PACKAGE: succeeds if apt could install it.
candidate() {
  local policy # not piped into grep, whose early end would count as a failure of the pipe
  policy=$(apt-cache policy "$1" 2>/dev/null)
  [[ $policy =~ $'\n  Candidate: '[^\(] ]]
}

apt_install() {
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 install -y --no-install-recommends "$@"
}

# install_packages PACKAGE...: installs them; fails, having said what to do, where that cannot be done.
install_packages() {
  local log
  if ! have apt-get; then
    say "setup: packages of the system are missing, and there is no apt-get to install them; on Debian they are called"
    say "  $*"
    say "setup: install them with the system's own package manager, then start again"
    return 1
  fi
  if ! can_be_root; then
    say "setup: packages of the system are missing, and installing them takes root, which cannot be had here."
    say "setup: have this run by someone who can, then start again:"
    say "  apt-get update && apt-get install $*"
    return 1
  fi
  say "setup: installing packages of the system: $*"
  log=$(mktemp)
  # Lists that are too old name files that are gone: the second attempt has new ones.
  if apt_install "$@" >"$log" 2>&1 || { update_lists && apt_install "$@" >"$log" 2>&1; }; then
    rm -f "$log"
    return 0
  fi
  tail -n 5 "$log" >&2
  rm -f "$log"
  say "setup: $* could not be installed"
  return 1
}

# newest_package PATTERN OLDEST NEWEST: the newest package that apt can install whose name matches PATTERN (a regular
# expression) and whose number lies within the bounds.
newest_package() {
  local name number
  while read -r number name; do
    if [ "$number" -ge "$2" ] && [ "$number" -le "$3" ] && candidate "$name"; then
      printf '%s\n' "$name"
      return 0
    fi
  done < <(apt-cache search --names-only "$1" 2>/dev/null | sed -nE 's/^([a-z]+([0-9]+)[^ ]*) .*/\2 \1/p' | sort -rn)
  return 1
}
