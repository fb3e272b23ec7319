// Table I of the paper: time of the haptic step with and without constraints.
#include "tools/bench/paper.h"
#include "tools/bench/reference_insertion.h"
#include "tools/bench/samples.h"

namespace stylet::bench {

Report paper_table1(const PaperOptions& options) {
  const ReferenceInsertion insertion = read_reference_insertion(options.reference_insertion);
  ReferenceExperiment experiment(insertion, {});
  Samples free(8192), constrained(8192);
  while (experiment.time_s() < (options.quick ? 0.5 : 1.0) * insertion.duration) {
    experiment.simulation_step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      const auto start = Clock::now();
      experiment.haptic_step();
      const auto time = Clock::now() - start;
      const int rows = 2 * experiment.needle().contact_count;
      if (rows == 0) free.add(time);
      if (rows >= 12 && rows <= 16) constrained.add(time);
    }
  }
  Report report;
  add_quantiles(report, "table1.total.free", free, 160, 330);
  add_quantiles(report, "table1.total.constraints", constrained, 390, 970);
  return report;
}

}  // namespace stylet::bench
