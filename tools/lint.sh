#!/usr/bin/env bash
# Style of every file: ./tools/lint.sh format|tidy [FILE...]
source "$(dirname "$0")/setup.sh"
what=${1:-}
shift || true
# Not shaders/: what C++ and GLSL share is laid out by hand, as tables.
mapfile -t files < <(if [ $# -gt 0 ]; then printf '%s\n' "$@"; else git ls-files '*.h' '*.c' '*.cpp' ':!shaders'; fi)
case "$what" in
format) clang-format --dry-run --Werror "${files[@]}" ;;
tidy)
  install_packages run build test test-all
  build dev generated_headers -DBUILD_TESTING=ON -DSTYLET_DRACO=ON
  # The fuzzers are no part of the dev preset.
  printf '%s\n' "${files[@]}" | grep '\.cpp$' | grep -v '^tests/fuzz/' | xargs -P "$(nproc)" -n 4 clang-tidy --quiet -p build/dev
  ;;
*) fail "say format or tidy" ;;
esac
