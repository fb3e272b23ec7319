#include "tools/bench/tissue.h"

#include "tools/bench/tissue_parts.h"

#include <array>
#include <cstdio>

namespace stylet::bench {

Report bench_tissue(const BenchOptions& options) {
  struct Section {
    const char* name;
    Report (*run)(const BenchOptions&);
  };
  constexpr std::array kSections{
      Section{"cantilever", tissue_cantilever}, Section{"elements", tissue_elements},
      Section{"compliance", tissue_compliance}, Section{"sessions", tissue_sessions},
      Section{"okamura", tissue_okamura},       Section{"speed", tissue_speed},
  };
  Report report;
  for (const Section& section : kSections) {
    std::fprintf(stderr, "bench tissue: %s\n", section.name);
    report.append(section.run(options));
  }
  return report;
}

}  // namespace stylet::bench
