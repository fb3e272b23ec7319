#!/usr/bin/env bash
# Coverage-guided fuzzing of everything that reads a file or the network: ./tools/fuzz.sh [SECONDS of each fuzzer, 600]
# As many at a time as there are cores.
# What it learnt stays in build/fuzz/corpus and is gone on with; an input that broke something in build/fuzz/findings.
source "$(dirname "$0")/setup.sh"
seconds=${1:-600}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || fail "say how many seconds each fuzzer runs, not '$seconds'"
install_packages run build test-ci
build fuzz all_fuzzers

folder=build/fuzz
findings=$folder/findings
mkdir -p "$findings"
"$folder/bin/fuzz_seeds" "$folder/seeds"
export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1:allocator_may_return_null=0 UBSAN_OPTIONS=print_stacktrace=1

# fuzz NAME: one fuzzer for its time; what it did becomes a line of $folder/NAME.summary.
fuzz() {
  local name=$1 corpus=$folder/corpus/$1 log=$folder/$1.log result=ok executions coverage
  mkdir -p "$corpus"
  bold "== $name, $seconds s"
  "$folder/bin/${name}_fuzzer" "$corpus" "$folder/seeds/$name" -max_total_time="$seconds" -max_len=32768 -timeout=10 \
    -rss_limit_mb=2048 -dict="$folder/seeds/json.dict" -print_final_stats=1 -artifact_prefix="$findings/$name-" \
    >"$log" 2>&1 || { result=FAILED; tail -n 40 "$log" >&2; }
  executions=$(awk '/number_of_executed_units/ { print $2 }' "$log")
  coverage=$(grep -oE 'cov: [0-9]+' "$log" | tail -n 1)
  printf '%-16s %10s executions  %-10s  %6d inputs  %s\n' "$name" "${executions:-?}" "${coverage:-cov: ?}" \
    "$(find "$corpus" -type f | wc -l)" "$result" >"$folder/$name.summary"
}

names=(gltf scenario_files organ_files link_messages recording report_descriptor)
rm -f "$folder"/*.summary
for name in "${names[@]}"; do
  while [ "$(jobs -rp | wc -l)" -ge "$(nproc)" ]; do wait -n || true; done
  fuzz "$name" &
done
wait
summary=$(cd "$folder" && cat "${names[@]/%/.summary}")
printf '%s\n' "$summary"
if [ "$(grep -c ' ok$' <<<"$summary")" -ne ${#names[@]} ]; then
  echo "What broke is in $findings; run its fuzzer of $folder/bin with the file to see it again."
  exit 1
fi
