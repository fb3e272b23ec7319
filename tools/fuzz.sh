#!/usr/bin/env bash
# Coverage-guided fuzzing of everything that reads a file: ./tools/fuzz.sh [SECONDS of each fuzzer, 600]
# What it learnt stays in build/fuzz/corpus and is gone on with; an input that broke something in build/fuzz/findings.
source "$(dirname "$0")/setup.sh"
seconds=${1:-600}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || fail "say how many seconds each fuzzer runs, not '$seconds'"
install_packages run build test-all
build fuzz all_fuzzers

folder=build/fuzz
findings=$folder/findings
mkdir -p "$findings"
"$folder/bin/fuzz_seeds" "$folder/seeds"
export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1:allocator_may_return_null=0 UBSAN_OPTIONS=print_stacktrace=1

summary=()
status=0
for name in gltf scenario_files organ_files recording; do
  corpus=$folder/corpus/$name
  log=$folder/$name.log
  mkdir -p "$corpus"
  result=ok
  bold "== $name, $seconds s"
  "$folder/bin/${name}_fuzzer" "$corpus" "$folder/seeds/$name" -max_total_time="$seconds" -max_len=32768 -timeout=10 \
    -rss_limit_mb=2048 -dict="$folder/seeds/json.dict" -print_final_stats=1 -artifact_prefix="$findings/$name-" \
    >"$log" 2>&1 || { result=FAILED; status=1; tail -n 40 "$log" >&2; }
  executions=$(awk '/number_of_executed_units/ { print $2 }' "$log")
  coverage=$(grep -oE 'cov: [0-9]+' "$log" | tail -n 1)
  summary+=("$(printf '%-16s %10s executions  %-10s  %6d inputs  %s' "$name" "${executions:-?}" "${coverage:-cov: ?}" \
    "$(find "$corpus" -type f | wc -l)" "$result")")
done
printf '%s\n' "${summary[@]}"
[ $status -eq 0 ] || echo "What broke is in $findings; run its fuzzer of $folder/bin with the file to see it again."
exit $status
