#include "tools/bench/parts.h"

#include "engine/files/json_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <set>
#include <stdexcept>

namespace stylet::bench {

Report run_parts(const std::string& bench, const std::vector<Part>& parts, const BenchOptions& options) {
  std::set<std::string> names;
  for (const Part& part : parts) names.insert(part.name);
  if (!options.part.empty() && !names.contains(options.part)) {
    const std::string close = files::nearest(options.part, names);
    throw std::runtime_error(fmt::format(
        "bench {} has no part {}; {}", bench, options.part,
        close.empty() ? fmt::format("it has: {}", fmt::join(names, ", ")) : fmt::format("did you mean {}?", close)));
  }
  Report report;
  for (const Part& part : parts) {
    if (!options.part.empty() && part.name != options.part) continue;
    std::fprintf(stderr, "bench %s: %s\n", bench.c_str(), part.name.c_str());
    report.append(part.run(options));
  }
  return report;
}

}  // namespace stylet::bench
