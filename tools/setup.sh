# Sourced by demo.sh and test.sh: where the project is, what it needs, how steps are shown.
# shellcheck shell=bash
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
project=$PWD

bold() { if [ -t 1 ]; then printf '\033[1m%s\033[0m\n' "$*"; else printf '%s\n' "$*"; fi; }
fail() { printf '%s: %s\n' "$(basename "$0")" "$*" >&2; exit 1; }

# packages SECTION...: the Debian packages of these sections of tools/packages.txt.
packages() {
  local section
  for section in "$@"; do
    grep -qxF "[$section]" tools/packages.txt || fail "tools/packages.txt has no section [$section]"
    awk -v want="[$section]" '/^\[/ { on = ($0 == want); next } /^[^#]/ && NF && on { print $1 }' tools/packages.txt
  done | sort -u
}

# apt_progress: what apt-get says, in some twenty lines for all the packages.
apt_progress() {
  awk '/ newly installed, / { all = $1 + $3; printf "  %d packages, with what they need\n", all }
       function count(name) { if (all && ++seen[name] % (int(all / 10) + 1) == 0) print "  " name, seen[name], "of", all }
       /^Get:/ { count("fetched") }
       /^Setting up / { count("installed") }
       { fflush() }'
}

# install_packages SECTION...: installs what is missing on Debian 12; elsewhere says what would be needed and goes on.
install_packages() {
  packages "$@" >/dev/null
  local missing=() package
  if ! command -v dpkg-query >/dev/null || ! grep -qs '^ID=debian' /etc/os-release ||
     ! grep -qs '^VERSION_ID="12"' /etc/os-release; then
    bold "This is not Debian 12: nothing is installed. Stylet needs what these Debian packages hold:"
    packages "$@" | paste -sd' ' | fold -s -w 110
    return 0
  fi
  for package in $(packages "$@"); do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  bold "Installing ${#missing[@]} Debian packages"
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "needs root or sudo to install: ${missing[*]}"
    as_root=(sudo)
  fi
  local log
  log=$(mktemp)
  { "${as_root[@]}" apt-get -o DPkg::Lock::Timeout=300 update &&
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 install -y \
      --no-install-recommends "${missing[@]}"; } 2>&1 | tee "$log" | apt_progress ||
    { tail -n 20 "$log" >&2; fail "apt-get failed; the log is $log"; }
  rm -f "$log"
}

# stage NAME COMMAND...: runs a command, prints its time, remembers it for stage_times.
stages=()
stage() {
  local name=$1 start=$SECONDS status=0
  shift
  bold "== $name"
  "$@" || status=$?
  stages+=("$(printf '%5d s  %s%s' $((SECONDS - start)) "$name" "$([ $status -eq 0 ] || echo "  FAILED")")")
  return $status
}
stage_times() { printf '%s\n' "Time per stage:" "${stages[@]}" "$(printf '%5d s  all' "$SECONDS")"; }

# configure PRESET [OPTION...]: quiet unless it fails.
configure() {
  local log=build/$1/configure.log
  mkdir -p "build/$1"
  cmake --preset "$@" >"$log" 2>&1 || { tail -n 30 "$log" >&2; fail "cmake failed; the log is $log"; }
  # A folder made with another compiler: CMake drops the preset's own values with the old ones, sanitizers too.
  if grep -q 'require your cache to be deleted' "$log"; then
    rm -rf "build/$1/CMakeCache.txt" "build/$1/CMakeFiles"
    cmake --preset "$@" >"$log" 2>&1 || { tail -n 30 "$log" >&2; fail "cmake failed; the log is $log"; }
  fi
}

# build PRESET TARGET [OPTION of cmake...]
build() {
  local preset=$1 target=$2
  shift 2
  configure "$preset" "$@"
  cmake --build --preset "$preset" --target "$target"
}
