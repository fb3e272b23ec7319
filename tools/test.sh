#!/usr/bin/env bash
# Builds and runs the tests: ./tools/test.sh [--all]
case "${1:-}" in
-h | --help)
  cat <<'HELP'
usage: tools/test.sh [--all]

Installs what is missing (Debian 12), then builds and runs through CTest:
  release   every test, Vulkan validation and synchronisation validation on
  asan      every test that needs no GPU, under AddressSanitizer and UndefinedBehaviourSanitizer
  tsan      the tests with threads, under ThreadSanitizer
--all adds the benchmarks, clang-format and clang-tidy on every file.
STYLET_TEST_DATA=DIR lets tests find data from outside the project; without it those tests are skipped and counted.
HELP
  exit 0
  ;;
"" | --all) ;;
*) echo "test.sh: unknown option $1; see --help" >&2; exit 2 ;;
esac
source "$(dirname "$0")/setup.sh"
all=${1:-}

sections=(run build test)
[ -n "$all" ] && sections+=(test-all)
install_packages "${sections[@]}"

XDG_RUNTIME_DIR=$(mktemp -d)
chmod 700 "$XDG_RUNTIME_DIR"
trap 'rm -rf "$XDG_RUNTIME_DIR"' EXIT
export XDG_RUNTIME_DIR
# The software rasteriser, so that pictures are the same everywhere; hazards between submissions count too.
export VK_LOADER_DRIVERS_SELECT=${VK_LOADER_DRIVERS_SELECT:-lvp_icd*}
export STYLET_VALIDATION=1
export VK_LAYER_ENABLES=VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT
export MESA_SHADER_CACHE_DIR=$project/build/mesa-cache
mkdir -p "$MESA_SHADER_CACHE_DIR"
export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1 UBSAN_OPTIONS=print_stacktrace=1
export TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1

status=0
run_tests() {
  local preset=$1
  shift
  ctest --preset "$preset" -j "$(nproc)" --no-tests=error "$@" | tee "build/$preset/ctest.log"
}
skipped() { grep -h '\*\*\*Skipped' build/*/ctest.log 2>/dev/null | wc -l; }

stage "Build release" build release -DBUILD_TESTING=ON -DSTYLET_TEST_DATA="${STYLET_TEST_DATA:-}"
stage "Test release" run_tests release || status=1
stage "Build asan" build asan -DSTYLET_TEST_DATA="${STYLET_TEST_DATA:-}"
stage "Test asan" run_tests asan || status=1
stage "Build tsan" build tsan
stage "Test tsan" run_tests tsan || status=1
if [ -n "$all" ]; then
  stage "Benchmarks" tools/bench.sh || status=1
  stage "clang-format" tools/lint.sh format || status=1
  stage "clang-tidy" tools/lint.sh tidy || status=1
fi
stage_times
printf 'Tests skipped: %d%s\n' "$(skipped)" \
  "$([ -n "${STYLET_TEST_DATA:-}" ] || echo ' (STYLET_TEST_DATA is not set)')"
[ $status -eq 0 ] && bold "All tests passed" || bold "SOME TESTS FAILED"
exit $status
