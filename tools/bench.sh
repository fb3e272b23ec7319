#!/usr/bin/env bash
# Every benchmark of tests/bench, one after the other: ./tools/bench.sh [options of Google Benchmark]
source "$(dirname "$0")/setup.sh"
build release all_benches -DBUILD_TESTING=ON
for bench in build/release/bin/stylet_*_bench; do
  bold "$(basename "$bench")"
  "$bench" "$@"
done
