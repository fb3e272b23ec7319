#include "tools/bench/coupling.h"

#include "tools/bench/coupling_parts.h"
#include "tools/bench/parts.h"

#include <algorithm>
#include <array>
#include <utility>

namespace stylet::bench {

Report bench_coupling(const BenchOptions& options) {
  const reference::ReferenceInsertion insertion = reference::read_reference_insertion(options.reference_insertion);
  const auto of_it = [&](Report (*run)(const reference::ReferenceInsertion&, const BenchOptions&)) {
    return [&insertion, run](const BenchOptions& each) { return run(insertion, each); };
  };
  return run_parts("coupling",
                   {{"shaft", of_it(coupling_shaft)},
                    {"synchronisation", of_it(coupling_synchronisation)},
                    {"sub-grid", of_it(coupling_subgrid)},
                    {"W_bar", of_it(coupling_w_bar)},
                    {"resistance", of_it(coupling_resistance)},
                    {"speed", of_it(coupling_speed)}},
                   options);
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
