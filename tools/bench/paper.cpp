#include "tools/bench/paper.h"

#include <cstdio>

namespace stylet::bench {

Report bench_paper(const PaperOptions& options) {
  Report report;
  std::fputs("bench paper: Table I\n", stderr);
  report.append(paper_table1(options));
  return report;
}

}  // namespace stylet::bench
