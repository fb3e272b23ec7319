#include "tools/bench/mechanics.h"

#include "tools/bench/mechanics_parts.h"

#include <array>
#include <cstdio>

namespace stylet::bench {

Report bench_mechanics(const BenchOptions& options) {
  struct Part {
    const char* name;
    Report (*run)(const BenchOptions&);
  };
  constexpr std::array kParts{
      Part{"bevel", mechanics_bevel},         Part{"swept", mechanics_swept},   Part{"organs", mechanics_organs},
      Part{"passivity", mechanics_passivity}, Part{"probe", mechanics_probe},   Part{"latency", mechanics_latency},
      Part{"breath", mechanics_breath},       Part{"limits", mechanics_limits},
  };
  Report report;
  for (const Part& part : kParts) {
    std::fprintf(stderr, "bench mechanics: %s\n", part.name);
    report.append(part.run(options));
  }
  return report;
}

}  // namespace stylet::bench
