#include "tools/bench/tissue_timing.h"

#include "physics/contact/delassus.h"
#include "physics/contact/tissue_points.h"
#include "physics/loops/tissue_patch.h"
#include "physics/messages/latest_value.h"
#include "physics/tissue/blas.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

namespace stylet::bench {
namespace {

using physics::BodyPatch;
using physics::NeedleState;
using physics::TissuePatch;

constexpr int kFewestContacts = 6;  // 12 rows
constexpr int kMostContacts = 8;    // 16 rows
constexpr int kRenewFactor = 25;    // simulation steps: half a second, what a factorisation takes at 5832 nodes
constexpr int kMostSteps = 400;     // before giving up: far more than the motion needs

/// R1 straight on: 71 mm at its own speed, then slowly, so that the eighth contact stays the last for 40 steps.
reference::ReferenceInsertion without_withdrawals(reference::ReferenceInsertion insertion, int nodes_per_edge) {
  const double speed = insertion.axial_speed.at(1)[1];
  insertion.nodes_per_edge = nodes_per_edge;
  insertion.axial_speed = {{0.0, 0.0}, {0.05, speed}, {1.60, speed}, {1.62, 0.01}, {2.50, 0.01}, {2.52, 0.0}};
  return insertion;
}

/// The tissue's kernels of a haptic step by themselves, on the patch that the haptic loop has.
class TissueKernels {
public:
  TissueKernels(const physics::NeedleProperties& needle, const physics::StylusPose& base, double dt)
      : edge_(one_edge(needle), {}),
        delassus_(edge_.node_count(), physics::kMaxRows),
        contacts_(physics::kMaxContacts) {
    if (!edge_.linearise(physics::straight_needle(one_edge(needle), base), base, dt)) {
      throw std::runtime_error("bench: a needle of one edge cannot be factorised");
    }
  }

  void load(const TissuePatch& patch) { points_.load(patch); }
  void place_rows() {
    for (int i = 0; i < points_.count(); ++i) {
      contacts_[i] = physics::lateral_contact(i, 2 * i, shaft_, points_.contact(i).directions);
    }
  }
  /// H_v W_bar H_v^T. With it goes the W_n of a single edge, a fraction of the time: an upper bound.
  void delassus() { delassus_.assemble(edge_, points_, contacts_, points_.count()); }
  void move(const Eigen::VectorXd& lambda) { points_.apply(contacts_, points_.count(), lambda); }

private:
  static physics::NeedleProperties one_edge(physics::NeedleProperties needle) {
    needle.beams = 1;
    return needle;
  }
  physics::Needle edge_;
  physics::Delassus delassus_;
  physics::TissuePoints points_;
  physics::ShaftPoint shaft_{.weights = {0.5, 0.5}};
  std::vector<physics::ActiveContact> contacts_;
};

/// The same hand-over as between the threads of a session, in one thread.
class TimedInsertion {
public:
  TimedInsertion(const reference::ReferenceInsertion& insertion, TissueTiming& timing)
      : insertion_(insertion),
        timing_(timing),
        simulation_(bodies(insertion),
                    {.dt = 1 / insertion.simulation_hz, .contact_spacing = insertion.contact_spacing}),
        haptic_({.needle = insertion.needle, .base = {}, .relative_compliance = 0}, insertion.base(0)),
        kernels_(insertion.needle, insertion.base(0), 1 / insertion.haptic_hz),
        patches_(simulation_.make_patch()),
        exchanged_(simulation_.make_patch().bodies[0]) {
    timing.nodes = simulation_.model(0).node_count();
  }

  physics::SimulationLoop& simulation() { return simulation_; }
  const TissuePatch& patch() const { return patches_.front(); }
  int contacts() const { return patch().bodies[0].contact_count; }

  /// One simulation step; its time goes to `samples` with 16 rows.
  void simulation_step(Samples& samples) {
    const auto start = Clock::now();
    simulation_.step({.needle = &needles_.front(), .time_s = time_s()}, patches_.back());
    const auto elapsed = Clock::now() - start;
    if (patches_.back().bodies[0].contact_count == kMostContacts) samples.add(elapsed);
  }

  /// The exchange of the buffers, timed with 12 to 16 rows. The haptic side first: the patch is then as warm in the
  /// caches as the simulation step left it.
  void exchange() {
    const bool timed = in_range(patches_.back().bodies[0].contact_count);
    Samples unused;
    patches_.publish();
    (timed ? timing_.haptic_exchange : unused).time([&] {
      patches_.update();
      kernels_.load(patches_.front());
    });
    kernels_.place_rows();
    if (!timed) return;
    timing_.simulation_exchange.time([&] { hand_over(); });
    timing_.w_bar.time([&] { fill_compliance(); });
    exchanged_.publish();
  }

  void haptic_steps() {
    const bool timed = in_range(contacts());
    Samples unused;
    for (int i = 0; i < insertion_.haptic_steps_per_simulation_step(); ++i) {
      ++haptic_step_;
      const physics::StylusPose base = insertion_.base(time_s());
      (timed ? timing_.haptic_step : unused).time([&] {
        haptic_.step(base, 1 / insertion_.haptic_hz, patches_.front());
      });
      if (!timed) continue;
      timing_.w_v.time([&] { kernels_.delassus(); });
      timing_.x_iso.time([&] { kernels_.move(lambda_); });
    }
    copy_state(haptic_.state(), needles_.back());
    needles_.publish();
    needles_.update();
  }

private:
  static std::vector<physics::SimulationBody> bodies(const reference::ReferenceInsertion& insertion) {
    std::vector<physics::SimulationBody> result;
    result.push_back(insertion.body());
    return result;
  }
  static bool in_range(int contacts) { return contacts >= kFewestContacts && contacts <= kMostContacts; }
  double time_s() const { return static_cast<double>(haptic_step_) / insertion_.haptic_hz; }

  /// What a simulation step does to hand its state over, W_bar aside: a patch is filled in place inside step(), so
  /// the same is done here into a patch of its own: positions of the isolated nodes, contacts,
  /// tetrahedra, surfaces ahead of the tip. The swap of the buffer behind both parts is one atomic exchange.
  void hand_over() {
    const Eigen::Matrix3Xd& positions = simulation_.tissue().positions[0];
    const BodyPatch& from = patches_.front().bodies[0];
    BodyPatch& to = exchanged_.back();
    to.node_count = from.node_count;
    for (int i = 0; i < from.node_count; ++i) {
      to.node_ids[i] = from.node_ids[i];
      to.free_positions.col(i) = positions.col(from.node_ids[i]);
    }
    std::copy_n(from.contacts.begin(), from.contact_count, to.contacts.begin());
    std::copy_n(from.tet_ids.begin(), from.tet_count, to.tet_ids.begin());
    std::copy_n(from.tet_nodes.begin(), from.tet_count, to.tet_nodes.begin());
    std::copy_n(from.surroundings.begin(), from.node_count, to.surroundings.begin());
  }

  /// The rest: W_bar of the nodes handed over, in place, and of their contacts.
  void fill_compliance() {
    fill_w_bar(simulation_.worker().latest().bodies[0].isolated, exchanged_.back());
    exchanged_.back().condense();
  }

  reference::ReferenceInsertion insertion_;
  TissueTiming& timing_;
  physics::SimulationLoop simulation_;
  physics::HapticLoop haptic_;
  TissueKernels kernels_;
  physics::LatestValue<TissuePatch> patches_;
  physics::LatestValue<NeedleState> needles_;
  physics::LatestValue<BodyPatch> exchanged_;
  Eigen::VectorXd lambda_ = Eigen::VectorXd::Constant(physics::kMaxRows, 0.01);
  std::uint64_t haptic_step_ = 0;
};

/// The worker in its own thread, as in a session, for as long as this lives.
class WorkerThread {
public:
  explicit WorkerThread(physics::FactorisationWorker& worker)
      : thread_([&worker](const std::stop_token& stop) {
          physics::disable_openmp_teams();
          while (!stop.stop_requested()) {
            if (!worker.step()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
          }
        }) {}

private:
  std::jthread thread_;
};

}  // namespace

TissueTiming time_tissue(const reference::ReferenceInsertion& insertion, const TissueTimingOptions& options) {
  TissueTiming timing;
  for (Samples* samples : {&timing.w_v, &timing.x_iso, &timing.haptic_step}) *samples = Samples(20 * kMostSteps);
  physics::disable_openmp_teams();
  TimedInsertion run(without_withdrawals(insertion, options.nodes_per_edge), timing);

  int step = 0;
  const auto advance = [&](Samples& samples) {
    run.simulation_step(samples);
    run.exchange();
    run.haptic_steps();
    if (++step > kMostSteps) {
      throw std::runtime_error("bench: the insertion does not reach 16 rows with " + std::to_string(timing.nodes) +
                               " nodes");
    }
  };
  while (static_cast<int>(timing.step_alone.count()) < options.alone_steps) {
    advance(timing.step_alone);
    if (step % kRenewFactor == 0) timing.factorisation.time([&] { run.simulation().worker().step(); });
  }
  timing.isolated_dofs = 3 * run.patch().bodies[0].node_count;
  {
    const WorkerThread worker(run.simulation().worker());
    while (static_cast<int>(timing.step_with_worker.count()) < options.with_worker_steps) {
      advance(timing.step_with_worker);
    }
  }
  timing.gain = measure_isodofs_gain(run.simulation().model(0), run.simulation().worker().latest().bodies[0].factor,
                                     run.patch().bodies[0], options.gain_repetitions);
  return timing;
}

std::vector<int> timed_meshes(bool quick, bool full) {
  if (quick) return {10, 12};
  std::vector<int> meshes{10, 12, 14, 16, 18, 27};  // 1000 to 19,683 nodes
  if (full) meshes.push_back(37);                   // 50,653: minutes
  return meshes;
}

std::vector<TissueTiming> time_tissues(const reference::ReferenceInsertion& insertion,
                                       std::span<const int> nodes_per_edge) {
  std::vector<TissueTiming> timings;
  for (const int n : nodes_per_edge) {
    std::fprintf(stderr, "bench paper: both loops with %d nodes\n", n * n * n);
    const bool large = n > 20;
    timings.push_back(time_tissue(insertion, {.nodes_per_edge = n, .gain_repetitions = large ? 2 : 5}));
  }
  return timings;
}

}  // namespace stylet::bench
