// The factorisation worker beside the simulation loop: never waited for, and replayable.
#include "physics/loops/simulation_loop.h"
#include "physics/needle/needle.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <thread>
#include <vector>

namespace stylet::physics {
namespace {

std::vector<SimulationBody> two_boxes() {
  std::vector<SimulationBody> bodies;
  for (const double low : {0.0, 0.06}) {
    SimulationBody body;
    body.mesh = reference::kuhn_box({low, 0, 0}, {low + 0.05, 0.1, 0.1}, {3, 5, 5});
    body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.45});
    body.fixed_nodes = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
    bodies.push_back(std::move(body));
  }
  return bodies;
}

/// A stiff needle on a prescribed path that pushes on whatever nodes the last patch isolated.
NeedleState needle_at(int step, const TissuePatch& patch) {
  NeedleState needle;
  needle.step = std::uint64_t(step);
  needle.node_count = 3;
  const double tip = 0.0008 * step;
  for (int i = 0; i < 3; ++i) {
    needle.positions.col(i) = Eigen::Vector3d(tip - 0.15 + 0.075 * i, 0.047, 0.053 + 1e-5 * step);
    needle.orientations[i] = orientation_along(Eigen::Vector3d::UnitX());
  }
  for (int b = 0; b < patch.body_count; ++b) {
    const BodyPatch& body = patch.bodies[b];
    for (int i = 0; i < body.node_count; ++i) {
      needle.forces[needle.force_count++] = {
          .body = b, .node = body.node_ids[i], .force = {0, 0.02 * std::sin(0.1 * step), 0.03}};
    }
  }
  return needle;
}

struct Trace {
  std::vector<SimulationReport> reports;
  std::vector<Eigen::Matrix3Xd> positions;
  std::vector<double> w_bar_norms;
};

/// 120 steps. `after_step(step, report)` is where a worker runs in lockstep; `flags(step)` forces a schedule.
template <typename Flags, typename AfterStep>
Trace run(SimulationLoop& loop, const Flags& flags, const AfterStep& after_step) {
  Trace trace;
  TissuePatch patch = loop.make_patch();
  for (int step = 0; step < 120; ++step) {
    const NeedleState needle = needle_at(step, patch);
    SimulationInput input = flags(step);
    input.needle = &needle;
    trace.reports.push_back(loop.step(input, patch));
    trace.positions.push_back(loop.tissue().positions[1]);
    trace.w_bar_norms.push_back(patch.bodies[1].w_bar().norm());
    after_step(step);
  }
  return trace;
}

SimulationInput live(int) {
  return {};
}

TEST(FactorisationWorker, ColumnsOfTheRequestedNodesComeWithTheFactor) {
  SimulationLoop loop(two_boxes(), {});
  const Trace trace = run(loop, live, [&](int) { loop.worker().step(); });
  int computed = 0;
  for (const SimulationReport& report : trace.reports) computed += report.new_isolated_nodes;
  EXPECT_EQ(trace.reports.back().factor_epoch, 119U);
  // Every step has a new factor, and yet only nodes that were not isolated a step before are computed in the loop.
  EXPECT_LE(computed, 2 * trace.reports.back().isolated_nodes);
}

TEST(FactorisationWorker, ThreadedRunReplaysToTheSameBitsInLockstep) {
  SimulationLoop threaded(two_boxes(), {});
  std::atomic<bool> stop{false};
  std::thread worker([&] {
    while (!stop.load(std::memory_order_relaxed)) {
      if (!threaded.worker().step()) std::this_thread::yield();
    }
  });
  const Trace recorded = run(threaded, live, [&](int step) {
    // Mostly the loop runs ahead of the worker; now and then the worker is let catch up, however slow the machine.
    while (step % 20 == 10 && !threaded.worker().idle()) std::this_thread::yield();
  });
  stop = true;
  worker.join();

  SimulationLoop lockstep(two_boxes(), {});
  const Trace replayed = run(
      lockstep,
      [&](int step) {
        const SimulationReport& report = recorded.reports[step];
        return SimulationInput{.take_factorisation = report.factorisation_taken,
                               .request_factorisation = report.factorisation_requested};
      },
      [&](int) { lockstep.worker().step(); });

  int taken = 0;
  for (std::size_t i = 0; i < recorded.reports.size(); ++i) {
    taken += recorded.reports[i].factorisation_taken;
    ASSERT_EQ(recorded.reports[i].factorisation_taken, replayed.reports[i].factorisation_taken);
    ASSERT_EQ(recorded.reports[i].factorisation_requested, replayed.reports[i].factorisation_requested);
    ASSERT_EQ(recorded.reports[i].factor_epoch, replayed.reports[i].factor_epoch);
    ASSERT_EQ(recorded.positions[i], replayed.positions[i]) << "step " << i;
    ASSERT_EQ(recorded.w_bar_norms[i], replayed.w_bar_norms[i]) << "step " << i;
  }
  std::printf("  %d factorisations swapped in over %zu steps\n", taken, recorded.reports.size());
  EXPECT_GE(taken, 6);
}

}  // namespace
}  // namespace stylet::physics
