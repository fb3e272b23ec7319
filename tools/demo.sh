#!/usr/bin/env bash
# Installs what is missing, builds Stylet and runs the default scenario: ./tools/demo.sh [options of `stylet train`]
case "${1:-}" in
-h | --help)
  cat <<'HELP'
usage: tools/demo.sh [options of `stylet train`]

Installs the Debian packages Stylet needs (Debian 12; root or sudo), builds it (Release) and shows the default
scenario, a liver biopsy, led by its recorded motion (--device recorded) unless a --device is named. With a display a
window opens; without one the session runs headless. Either way out/demo holds the result: pictures, a video, the forces, a recording that replays bit for
bit. A second run starts at once.

  tools/demo.sh                          the default scenario, as a demonstration
  tools/demo.sh --view headless          no window even with a display
  tools/demo.sh --device mouse           drive the needle yourself (needs a display)
  tools/demo.sh --coupling paper-frozen  the coupling that the paper improves on
HELP
  exit 0
  ;;
esac
source "$(dirname "$0")/setup.sh"
install_packages run build
stage "Build" build release stylet -DBUILD_TESTING=OFF
leader=(--device recorded)
case " $* " in *" --device"[\ =]* | *" --view headset "* | *" --view=headset "*) leader=() ;; esac
exec build/release/bin/stylet train liver_biopsy --out out/demo "${leader[@]}" "$@"
