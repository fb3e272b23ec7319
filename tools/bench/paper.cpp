#include "tools/bench/paper.h"

#include "tools/bench/paper_figures.h"
#include "tools/bench/paper_lowrate.h"
#include "tools/bench/paper_table2.h"
#include "tools/bench/tissue_timing.h"
#include "tools/reference/reference_insertion.h"

#include <cstdio>
#include <vector>

namespace stylet::bench {

Report bench_paper(const BenchOptions& options) {
  Report report;
  std::fputs("bench paper: Table I\n", stderr);
  report.append(paper_table1(options));
  if (options.sofa_style_peer) {
    std::fputs("bench paper: the peer's way\n", stderr);
    report.append(paper_peer(options));
  }

  const reference::ReferenceInsertion insertion = reference::read_reference_insertion(options.reference_insertion);
  const std::vector<TissueTiming> meshes = time_tissues(insertion, timed_meshes(options.quick, options.full));
  report.append(paper_table2(meshes));
  report.append(paper_isodofs_gain(meshes));
  report.append(paper_lowrate(meshes));
  std::fputs("bench paper: Fig. 2 and 3\n", stderr);
  report.append(paper_figures_2_and_3(insertion, options));
  std::fputs("bench paper: Fig. 4\n", stderr);
  report.append(paper_figure_4(insertion, options));
  return report;
}

}  // namespace stylet::bench
