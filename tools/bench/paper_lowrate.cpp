#include "tools/bench/paper_lowrate.h"

#include <fmt/format.h>

#include <array>
#include <optional>

namespace stylet::bench {
namespace {

struct PeerStep {
  int nodes;
  double step_ms;
};
constexpr std::array kPeer{PeerStep{343, 2.2},   PeerStep{1000, 8.3}, PeerStep{1728, 19.3}, PeerStep{2744, 37.6},
                           PeerStep{4096, 76.8}, PeerStep{5832, 128}, PeerStep{19683, 902}};

std::optional<double> peer_step(int nodes) {
  for (const PeerStep& peer : kPeer) {
    if (peer.nodes == nodes) return peer.step_ms;
  }
  return {};
}

struct RateAsked {
  int nodes;
  double rate;
};
constexpr std::array kAsked{RateAsked{5832, 60}, RateAsked{19683, 10}};

std::optional<double> rate_asked(int nodes) {
  for (const RateAsked& asked : kAsked) {
    if (asked.nodes == nodes) return asked.rate;
  }
  return {};
}

}  // namespace

Report paper_lowrate(std::span<const TissueTiming> meshes) {
  Report report;
  for (const TissueTiming& mesh : meshes) {
    const auto name = [&](const char* what) { return fmt::format("lowrate.{}.{}", mesh.nodes, what); };
    const auto time = [&](const char* what, double us, std::optional<double> reference = {}) {
      report.add({name(what), 1e-3 * us, "ms", reference, {}, {}});
    };
    const std::optional<double> peer = peer_step(mesh.nodes);
    const auto rate = [&](const char* what, double us) {
      const std::optional<double> reference = peer ? std::optional(1e3 / *peer) : std::nullopt;
      const std::optional<double> asked = rate_asked(mesh.nodes);
      report.add(asked ? at_least(name(what), 1e6 / us, "1/s", *asked, reference)
                       : Measurement{name(what), 1e6 / us, "1/s", reference, {}, {}});
    };
    time("step", mesh.step_with_worker.median(), peer);
    rate("rate", mesh.step_with_worker.median());
    time("step.p99", mesh.step_with_worker.p99());
    time("step.alone", mesh.step_alone.median(), peer);
    rate("rate.alone", mesh.step_alone.median());
    time("factorisation", mesh.factorisation.median());
  }
  return report;
}

}  // namespace stylet::bench
