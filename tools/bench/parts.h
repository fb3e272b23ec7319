// The parts of a long bench: all of them in their order, or the one that is asked for.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

#include <functional>
#include <string>
#include <vector>

namespace stylet::bench {

struct Part {
  std::string name;
  std::function<Report(const BenchOptions&)> run;
};

/// Says on stderr which one runs.
/// @throws std::runtime_error  there is none called as `options.part`
Report run_parts(const std::string& bench, const std::vector<Part>& parts, const BenchOptions& options);

}  // namespace stylet::bench
