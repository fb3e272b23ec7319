#include "tools/bench/coupling.h"

#include "tools/bench/coupling_parts.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace stylet::bench {

Report bench_coupling(const BenchOptions& options) {
  const reference::ReferenceInsertion insertion = reference::read_reference_insertion(options.reference_insertion);
  struct Part {
    const char* name;
    Report (*run)(const reference::ReferenceInsertion&, const BenchOptions&);
  };
  constexpr std::array kParts{
      Part{"shaft", coupling_shaft},
      Part{"synchronisation", coupling_synchronisation},
      Part{"sub-grid compliance", coupling_subgrid},
      Part{"W_bar", coupling_w_bar},
      Part{"resistance", coupling_resistance},
      Part{"speed", coupling_speed},
  };
  Report report;
  for (const Part& p : kParts) {
    std::fprintf(stderr, "bench coupling: %s\n", p.name);
    report.append(p.run(insertion, options));
  }
  return report;
}

std::shared_ptr<const physics::TissueMap> one_tissue(const physics::InsertionResistance& resistance) {
  auto map = std::make_shared<physics::TissueMap>();
  map->tissues[1] = resistance;
  return map;
}

physics::InsertionResistance liver_resistance() {
  return {.puncture_force = 1.8, .cutting_force = 0.94, .cutting_viscosity = 2, .friction_per_length = 18};
}

double relative_spread(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  return (*high - *low) / mean;
}

figures::PlotSeries plot_line(std::string label, std::vector<double> x, std::vector<double> y, int index) {
  return {.label = std::move(label),
          .x = std::move(x),
          .y = std::move(y),
          .colour = figures::plot_colour(index, figures::PlotTheme::light)};
}

}  // namespace stylet::bench
