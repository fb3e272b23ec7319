#!/usr/bin/env bash
# Style of every file: ./tools/lint.sh format|tidy [FILE...]; and that each compiles by itself: ./tools/lint.sh alone
source "$(dirname "$0")/setup.sh"
what=${1:-}
shift || true
# Not shaders/: what C++ and GLSL share is laid out by hand, as tables.
mapfile -t files < <(if [ $# -gt 0 ]; then printf '%s\n' "$@"; else git ls-files '*.h' '*.c' '*.cpp' ':!shaders'; fi)
case "$what" in
format) clang-format --dry-run --Werror "${files[@]}" ;;
alone)
  # The unity builds hide an include or a name that a file has from another one.
  install_packages run build test test-ci
  configure alone -DBUILD_TESTING=ON -DSTYLET_DRACO=ON -DSTYLET_FUZZ=ON
  cmake --build --preset alone --target generated_headers stylet_headers stylet_test_headers
  # The build's own commands of these files, ccache and all, JSON's escapes undone, without what makes code of them.
  printf '%s\n' "${files[@]}" | grep '\.cpp$' | sed "s#.*# -c $project/&#" >build/alone/files.txt
  ninja -C build/alone -t compdb | sed -n 's/^ *"command": "\(.*\)",$/\1/p' | grep -v 'cmake_pch\.hxx\.cxx$' |
    sed 's/\\\(["\\]\)/\1/g; s/ -MD .* -c / -c /' | grep -F -f build/alone/files.txt | sed 's/ -c / -fsyntax-only /' |
    xargs -d '\n' -n 1 -P "$(nproc)" sh -c 'cd build/alone && eval "$0"'
  ;;
tidy)
  install_packages run build test test-all
  build dev generated_headers -DBUILD_TESTING=ON -DSTYLET_DRACO=ON
  # The fuzzers are no part of the dev preset.
  printf '%s\n' "${files[@]}" | grep '\.cpp$' | grep -v '^tests/fuzz/' | xargs -P "$(nproc)" -n 4 clang-tidy --quiet -p build/dev
  ;;
*) fail "say format, alone or tidy" ;;
esac
