#!/usr/bin/env bash
# Builds and runs the tests: ./tools/test.sh [ROOM... | --ci | --all]
case "${1:-}" in
-h | --help)
  cat <<'HELP'
usage: tools/test.sh              Release, every room: what to run after a clone and before a commit (12 minutes: 9 of
                                  them to compile everything for the first time; after that 2 and what has changed)
       tools/test.sh ROOM...      the tests of these rooms alone: what to run while you change one (1 minute)
       tools/test.sh --ci         everything that guards main (70 minutes from nothing, half of them to compile it four
                                  ways; less where ccache knows the code of the last time)
       tools/test.sh --all        that, and what takes hours

Each installs the Debian 12 packages that it misses, builds into build/ what has changed, runs the tests through CTest
with Vulkan validation and synchronization validation on, and says where its time went; those times are for two cores.

ROOM is one of the table in engine/README.md, or a folder of tests/: engine/link or link; physics/contact or physics.
One test: build/release/bin/stylet_link_tests --gtest_filter='Link.*' (a folder's executables: its CMakeLists.txt).

--ci adds:
  long      the tests of some seven seconds and more (LONG in the rooms' CMakeLists.txt; what is a CAMPAIGN is left to
            --all)
  format    clang-format on every file
  alone     files of the libraries, of benchmarks, soaks and fuzzers (which run in --all) compiled by themselves, by
            gcc (all else is built by clang): the builds put several into one (unity), where one can use what another
            includes. Those of the last 40 commits, and what includes these
  asan      every test but the long ones (leaks: those without Vulkan) under AddressSanitizer and
            UndefinedBehaviorSanitizer
  tsan      the tests with threads, under ThreadSanitizer
  kernel    the stylus over a real kernel in a virtual machine: tools/kernel_test.sh, beside the others
--all compiles every file alone and runs the campaigns, at full size (STYLET_STARTS, STYLET_EVERY_ORGAN), and the long
tests under AddressSanitizer too; it adds the benchmarks, soaks of the default scenario (in lockstep for
STYLET_SOAK_MINUTES of session time, 30; in real time, recorded and drawn, for STYLET_THREADED_SOAK_MINUTES, 5), a
hundred random users at the window, again under AddressSanitizer, each scenario changed STYLET_SCENARIO_CASES times at
random and trained (700), coverage-guided fuzzing of every reader (STYLET_FUZZ_SECONDS each, 3600), and clang-tidy.
A PostgreSQL server is started for the tests of a lab's server, on a socket of its own; without one they are skipped and
counted. STYLET_TEST_POSTGRES=postgresql:///postgres?host=... names another, whose user may make databases.
STYLET_TEST_DATA=DIR lets tests find data from outside the project; without it those tests are skipped and counted.
HELP
  exit 0
  ;;
esac
source "$(dirname "$0")/setup.sh"
source tools/rooms.sh

tier=release
folders=()
case "${1:-}" in
"") ;;
--ci | --all) tier=${1#--}; [ $# -eq 1 ] || fail "$1 goes alone; see --help" ;;
-*) echo "test.sh: unknown option $1; see --help" >&2; exit 2 ;;
*)
  tier=rooms
  for room in "$@"; do
    folder=$(tests_of "$room")
    if [ -z "$folder" ]; then
      printf 'test.sh: there is no room %s; did you mean %s? The rooms:\n' "$room" "$(nearest "$room")" >&2
      all_rooms | paste -sd' ' | fold -s -w 110 >&2
      exit 2
    fi
    folders+=("$folder")
  done
  mapfile -t folders < <(printf '%s\n' "${folders[@]}" | sort -u)
  ;;
esac

sections=(run build test)
case $tier in
ci) sections+=(test-ci) ;;
all) sections+=(test-ci test-all) ;;
esac
install_packages "${sections[@]}"

XDG_RUNTIME_DIR=$(mktemp -d)
chmod 700 "$XDG_RUNTIME_DIR"
postgres=()  # as whom, which folder, which programs
trap 'stop_postgres; rm -rf "$XDG_RUNTIME_DIR"; kill $(jobs -p) 2>/dev/null || true' EXIT
export XDG_RUNTIME_DIR
# The software rasterizer, so that pictures are the same everywhere; hazards between submissions count too.
export VK_LOADER_DRIVERS_SELECT=${VK_LOADER_DRIVERS_SELECT:-lvp_icd*}
export STYLET_VALIDATION=1
export VK_LAYER_ENABLES=VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT
export MESA_SHADER_CACHE_DIR=$project/build/mesa-cache
mkdir -p "$MESA_SHADER_CACHE_DIR"
export ALSOFT_DRIVERS=null  # nobody is to hear them; tests of sound choose another
export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1 UBSAN_OPTIONS=print_stacktrace=1
export TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1

# A throwaway PostgreSQL: of an unprivileged user (initdb refuses root), on a socket, without waiting for the disk.
start_postgres() {
  unset STYLET_LAB_DATABASE
  [ -z "${STYLET_TEST_POSTGRES:-}" ] || return 0
  local programs folder as=()
  programs=$(find /usr/lib/postgresql -path '*/bin/initdb' 2>/dev/null | sort -V | tail -n 1 || true)
  programs=$(dirname "${programs:-$(command -v initdb || echo none)}")
  [ -x "$programs/pg_ctl" ] || return 0
  folder=$(mktemp -d /tmp/stylet-postgres-XXXXXX)  # a socket's path has 107 characters at most
  if [ "$(id -u)" -eq 0 ]; then
    local user
    user=$(id -un postgres 2>/dev/null || id -un nobody)
    as=(runuser -u "$user" --)
    chown "$user" "$folder"
  fi
  postgres=("$folder" "$programs" "${as[@]}")
  (cd "$folder" &&
    "${as[@]}" "$programs/initdb" -D data -U stylet -A trust -E UTF8 --locale=C --locale-provider=icu \
      --icu-locale=en-US --no-sync --no-instructions &&
    "${as[@]}" "$programs/pg_ctl" start -w -t 120 -s -D data -l server.log \
      -o "-k '$folder' -c listen_addresses= -c fsync=off") >"$XDG_RUNTIME_DIR/postgres.log" 2>&1 </dev/null ||
    { echo "PostgreSQL does not start:"; tail -n 5 "$XDG_RUNTIME_DIR/postgres.log"; return 0; }
  export STYLET_TEST_POSTGRES="postgresql:///postgres?user=stylet&host=$folder"
}
stop_postgres() {
  [ ${#postgres[@]} -gt 0 ] || return 0
  (cd "${postgres[0]}" && "${postgres[@]:2}" "${postgres[1]}/pg_ctl" stop -w -m immediate -D data) >/dev/null 2>&1 || true
  rm -rf "${postgres[0]}"
}
start_postgres

[ -n "${STYLET_TEST_DATA:-}" ] || unset STYLET_TEST_DATA  # set to nothing it is not set
# Campaigns among the tests at full size.
[ $tier != all ] || export STYLET_STARTS=${STYLET_STARTS:-20} STYLET_EVERY_ORGAN=${STYLET_EVERY_ORGAN:-1}
status=0
data=-DSTYLET_TEST_DATA=${STYLET_TEST_DATA:-}
release=(-DBUILD_TESTING=ON -DSTYLET_DRACO=ON "$data")
rm -f build/*/ctest-*.log

# run_tests FOLDER NAME [OPTION of ctest...]: of a build folder, or of one of its folders of tests. One more at a time
# than there are cores, for those that wait.
run_tests() {
  local folder=build/$1 log=build/${1%%/*}/ctest-$2.log
  shift 2
  XDG_CACHE_HOME=$XDG_RUNTIME_DIR/cache xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" \
    ctest --test-dir "$folder" --output-on-failure -j "$(($(nproc) + 1))" --no-tests=error "$@" | tee "$log" |
    grep -v -E ' Start +[0-9]+:| Passed '
}
skipped() { cat build/*/ctest-*.log 2>/dev/null | grep -c '\*\*\*Skipped' || true; }
# number_of FOLDER OPTION of ctest...: tests of a build folder.
number_of() { ctest --test-dir "build/$1" -N "${@:2}" | awk '/^Total Tests:/ { print $3 }'; }
# some_tests FOLDER NAME: who waits for them waits for no more than what finds most. A room that has long ones alone
# (tests/package) runs them. main_tests: what guards main.
left=0
campaigns=0
some_tests() {
  local long
  long=$(number_of "$1" -L long)
  [ "$long" -lt "$(number_of "$1")" ] || { run_tests "$1" "$2"; return; }
  left=$((left + long))
  run_tests "$1" "$2" -LE long
}
main_tests() {
  campaigns=$(number_of "$1" -L campaign)
  run_tests "$1" "$2" -LE campaign
}
# The executables of a folder of tests/, and the tests that they have.
test_room() {
  stage "Build tests/$1" build release "tests/$1/all" "${release[@]}"
  stage "Test tests/$1" some_tests "release/tests/$1" "$1" || status=1
}
# Changed in the last commits, and what includes these: of the libraries, and of the tests what nothing here builds.
recent_files() {
  local paths=('physics/*.cpp' 'haptic/*.cpp' 'engine/*.cpp' 'tests/bench/*.cpp' 'tests/fuzz/*.cpp' 'tests/kernel/*.cpp'
    'tests/*soak*.cpp') changed
  changed=$(git log -40 --format= --name-only --diff-filter=d -- '*.h' '*.cpp' | sort -u)
  { echo "$changed"; git grep -l -F -f <(sed -n 's/.*\.h$/"&"/p' <<<"$changed") -- "${paths[@]}" || true; } |
    grep -F -x -f <(git ls-files "${paths[@]}") | sort -u
}
kernel_test_result() {
  local result=0
  wait "$kernel_test" || result=$?
  cat build/kernel_test.txt
  return $result
}

if [ $tier = rooms ]; then
  for folder in "${folders[@]}"; do
    if [ "$folder" = kernel ]; then stage "Test kernel" tools/kernel_test.sh || status=1; else test_room "$folder"; fi
  done
else
  stage "Build release" build release all_tests "${release[@]}"
  declare -A tests=([release]=some_tests [ci]=main_tests [all]=run_tests)
  stage "Test release" "${tests[$tier]}" release all || status=1
fi

if [ $tier = ci ] || [ $tier = all ]; then
  # One emulated processor, indifferent to how busy the machine is.
  tools/kernel_test.sh >build/kernel_test.txt 2>&1 &
  kernel_test=$!
  stage "clang-format" tools/lint.sh format || status=1
  mapfile -t recent < <(recent_files)
  if [ $tier = all ]; then
    stage "Files alone" tools/lint.sh alone || status=1
  elif [ ${#recent[@]} -gt 0 ]; then
    stage "Files alone" tools/lint.sh alone "${recent[@]}" || status=1
  fi
  stage "Build asan" build asan all_tests -DSTYLET_DRACO=ON "$data"
  # What a long test does for minutes others do for seconds.
  short=(-LE long)
  [ $tier = all ] && short=()
  stage "Test asan" run_tests asan cpu -LE "gpu${short:+|long}" || status=1
  # The Vulkan loader, layers and driver keep memory until the process ends and are unloaded before the leak check.
  ASAN_OPTIONS=detect_leaks=0 STYLET_VALIDATION=0 stage "Test asan, Vulkan" run_tests asan gpu -L gpu "${short[@]}" ||
    status=1
  stage "Build tsan" build tsan thread_tests
  stage "Test tsan" run_tests tsan threads -L threads || status=1
  stage "Test kernel" kernel_test_result || status=1
fi
if [ $tier = all ]; then
  stage "Benchmarks" tools/bench.sh || status=1
  stage "Build soaks" build release all_soaks
  stage "Soak" build/release/bin/stylet_soak || status=1
  stage "Soak in real time" build/release/bin/stylet_threaded_soak || status=1
  # Every step drawn; STYLET_RANDOM_STEPS of each user.
  export STYLET_RANDOM_STEPS=${STYLET_RANDOM_STEPS:-50}
  random_users() { "build/$1/bin/stylet_desktop_tests" --gtest_filter='RandomUsers.*'; }
  stage "Random users" random_users release || status=1
  ASAN_OPTIONS=detect_leaks=0 STYLET_VALIDATION=0 stage "Random users, asan" random_users asan || status=1
  # STYLET_SCENARIO_CASES of each scenario changed at random, and every key at each of its oddest values.
  export STYLET_SCENARIO_CASES=${STYLET_SCENARIO_CASES:-700}
  stage "Sound scenarios" build/release/bin/stylet_sound_scenarios_tests || status=1
  stage "Fuzz" tools/fuzz.sh "${STYLET_FUZZ_SECONDS:-3600}" || status=1
  stage "clang-tidy" tools/lint.sh tidy || status=1
fi
stage_times
[ $left -eq 0 ] || echo "Left to --ci, of some seven seconds and more each: $left tests"
[ $campaigns -eq 0 ] || echo "Left to --all, of a minute and more each: $campaigns tests"
printf 'Tests skipped: %d%s\n' "$(skipped)" \
  "$([ -n "${STYLET_TEST_DATA:-}" ] || echo ' (STYLET_TEST_DATA is not set)')"
[ $status -eq 0 ] && bold "All tests passed" || bold "SOME TESTS FAILED"
exit $status
