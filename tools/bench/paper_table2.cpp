#include "tools/bench/paper_table2.h"

#include <fmt/format.h>

#include <array>
#include <optional>

namespace stylet::bench {
namespace {

/// A column of the paper's Table II. us
struct PaperColumn {
  int nodes;
  int isolated_dofs;
  double w_v, x_iso, synchronisation;
};
constexpr std::array kPaper{PaperColumn{1000, 36, 20, 1, 90}, PaperColumn{1728, 42, 40, 3, 70},
                            PaperColumn{2744, 51, 40, 4, 90}, PaperColumn{4096, 54, 30, 5, 100},
                            PaperColumn{5832, 63, 40, 7, 130}};

const PaperColumn* paper_column(int nodes) {
  for (const PaperColumn& column : kPaper) {
    if (column.nodes == nodes) return &column;
  }
  return nullptr;
}

constexpr double kAgreement = 1e-12;  // of W built in different ways: rounding

}  // namespace

Report paper_table2(std::span<const TissueTiming> meshes) {
  Report report;
  for (const TissueTiming& mesh : meshes) {
    const PaperColumn* paper = paper_column(mesh.nodes);
    const auto reference = [&](auto member) -> std::optional<double> {
      if (paper == nullptr) return {};
      return static_cast<double>(paper->*member);
    };
    const auto name = [&](const char* what) { return fmt::format("table2.{}.{}", mesh.nodes, what); };
    report.add({name("isodofs"),
                static_cast<double>(mesh.isolated_dofs),
                "1",
                reference(&PaperColumn::isolated_dofs),
                {},
                {}});
    report.add(at_most(name("w_v"), mesh.w_v.median(), "us", 10, reference(&PaperColumn::w_v)));
    report.add(at_most(name("x_iso"), mesh.x_iso.median(), "us", 2, reference(&PaperColumn::x_iso)));
    report.add(at_most(name("synchronisation.simulation"), mesh.simulation_exchange.median(), "us", 100,
                       reference(&PaperColumn::synchronisation)));
    report.add({name("w_bar"), mesh.w_bar.median(), "us", {}, {}, {}});
    report.add(at_most(name("synchronisation.haptic"), mesh.haptic_exchange.median(), "us", 5,
                       reference(&PaperColumn::synchronisation)));
    report.add({name("haptic_step"), mesh.haptic_step.median(), "us", {}, {}, {}});
  }
  if (meshes.size() > 1) {
    report.add(at_most("table2.haptic_step.ratio",
                       meshes.back().haptic_step.median() / meshes.front().haptic_step.median(), "1", 1.3));
  }
  return report;
}

Report paper_isodofs_gain(std::span<const TissueTiming> meshes) {
  Report report;
  for (const TissueTiming& mesh : meshes) {
    const IsodofsGain& gain = mesh.gain;
    const auto name = [&](const char* what) { return fmt::format("isodofs.{}.{}", mesh.nodes, what); };
    const auto time = [&](const char* what, const Samples& samples) {
      report.add({name(what), samples.median(), "us", {}, {}, {}});
    };
    time("row_solves", gain.row_solves);
    time("from_scratch", gain.from_scratch);
    time("incremental", gain.incremental);
    time("unchanged", gain.unchanged);
    report.add({name("gain"), gain.row_solves.median() / gain.incremental.median(), "1", {}, {}, {}});
    report.add(at_most(name("residual"), gain.residual, "1", kAgreement));
  }
  return report;
}

}  // namespace stylet::bench
