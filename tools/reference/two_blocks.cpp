#include "tools/reference/two_blocks.h"

#include "tools/reference/kuhn_box.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace stylet::reference {

using Eigen::Vector3d;
using physics::SimulationBody;

namespace {

constexpr double kWidth = 0.060;      // m
constexpr double kThickness = 0.040;  // m, of each block
constexpr double kCell = 0.010;       // m
constexpr double kYoung = 10e3;       // Pa
constexpr double kPoisson = 0.40;
constexpr double kUnbreakable = 1e3;     // N
constexpr double kGap = 0.0005;          // m, from the tip to the face at the start
constexpr double kWayIn = 0.5;           // s
constexpr double kNeedleLength = 0.150;  // m: buckles at 2.3 N where its tip may slide, so push less

SimulationBody box(double from, double to) {
  SimulationBody body;
  const auto cells = [](double length) { return static_cast<int>(std::lround(length / kCell)); };
  body.mesh = kuhn_box({from, -kWidth / 2, -kWidth / 2}, {to, kWidth / 2, kWidth / 2},
                       {cells(to - from), cells(kWidth), cells(kWidth)});
  body.tet_materials.assign(body.mesh.tets.size(), {kYoung, kPoisson});
  return body;
}

bool at_front_corner(const Vector3d& x) {
  return x.x() < 1e-9 && std::min(std::abs(x.y()), std::abs(x.z())) > kWidth / 2 - 1e-9;
}

std::vector<SimulationBody> bodies(bool one, double gap) {
  std::vector<SimulationBody> all;
  const double back = 2 * kThickness;
  const auto held = [&](const Vector3d& x) { return x.x() > back - 1e-9; };
  if (one) {
    all.push_back(box(0, back));
    all[0].fixed_nodes = nodes_where(all[0].mesh, [&](const Vector3d& x) { return at_front_corner(x) || held(x); });
    return all;
  }
  all.push_back(box(0, kThickness));
  all[0].fixed_nodes = nodes_where(all[0].mesh, at_front_corner);
  all.push_back(box(kThickness, back));
  for (Vector3d& x : all[1].mesh.nodes) x.x() += gap;
  all[1].fixed_nodes = nodes_where(all[1].mesh, [&](const Vector3d& x) { return x.x() > back + gap - 1e-9; });
  return all;
}

physics::SimulationLoopSettings simulation_settings(const TwoBlocksRun& run) {
  physics::SimulationLoopSettings settings{.dt = 1 / run.simulation_hz, .lay_contacts = false};
  if (!run.one_body) settings.contact.pairs = {{.nodes_of = 0, .surface_of = 1}};
  settings.contact.at_haptic_rate = run.at_haptic_rate;
  return settings;
}

physics::HapticLoopSettings haptic_settings() {
  auto tissues = std::make_shared<physics::TissueMap>();
  tissues->tissues[1].puncture_force = kUnbreakable;
  physics::HapticLoopSettings settings;
  settings.needle.length = kNeedleLength;
  settings.coupling = physics::Coupling::stylet;
  settings.track.tip_friction = 0;
  settings.tissues = std::move(tissues);
  return settings;
}

}  // namespace

TwoBlocks::TwoBlocks(const TwoBlocksRun& run)
    : run_(run),
      steps_a_simulation_step_(static_cast<int>(std::lround(run.haptic_hz / run.simulation_hz))),
      latency_steps_(static_cast<int>(std::lround(run.latency_s * run.haptic_hz))),
      simulation_(std::make_unique<physics::SimulationLoop>(bodies(run.one_body, run.gap), simulation_settings(run))),
      haptic_(haptic_settings(), hub(0)) {
  if (!(run.frequency_hz > 0) || !(run.stroke > 0) || !(run.depth >= run.stroke / 2) || latency_steps_ < 0 ||
      steps_a_simulation_step_ < 1) {
    throw std::invalid_argument("two blocks: frequency and stroke must be positive, depth at least half the stroke");
  }
  states_.assign(static_cast<std::size_t>(latency_steps_) + 1, haptic_.state());
  const int patches = latency_steps_ / steps_a_simulation_step_ + 2;
  for (int i = 0; i < patches; ++i) patches_.push_back({.due = 0, .patch = simulation_->make_patch()});
}

physics::StylusPose TwoBlocks::hub(double time_s) const {
  double depth = 0;
  time_s = std::min(time_s, run_.stops_s);
  if (time_s < kWayIn) {
    depth = -kGap + (run_.depth + kGap) * 0.5 * (1 - std::cos(std::numbers::pi * time_s / kWayIn));
  } else {
    depth = run_.depth + 0.5 * run_.stroke * std::sin(2 * std::numbers::pi * run_.frequency_hz * (time_s - kWayIn));
  }
  return {.position = {depth - kNeedleLength, run_.sideways, 0},
          .orientation = physics::orientation_along(Vector3d::UnitX())};
}

// What the simulation sees is as old as a message takes, and so is what it says when it is used.
void TwoBlocks::simulation_step(bool factorises) {
  const std::uint64_t seen = step_ - std::min<std::uint64_t>(step_, static_cast<std::uint64_t>(latency_steps_));
  LatePatch& out = patches_[simulation_steps_ % patches_.size()];
  report_ = simulation_->step({.needle = &states_[seen % states_.size()], .time_s = time_s()}, out.patch);
  out.due = step_ + static_cast<std::uint64_t>(latency_steps_);
  simulation_flags_ |= report_.flags;
  ++simulation_steps_;
  if (factorises) simulation_->worker().step();
}

bool TwoBlocks::step(bool factorises) {
  const bool simulated = step_ % static_cast<std::uint64_t>(steps_a_simulation_step_) == 0;
  if (simulated) simulation_step(factorises);
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const LatePatch& late = patches_[i];
    if (late.due <= step_ && late.patch.epoch > patches_[in_use_].patch.epoch) in_use_ = i;
  }
  ++step_;
  const physics::NeedleState& state = haptic_.step(hub(time_s()), 1 / run_.haptic_hz, patches_[in_use_].patch);
  physics::copy_state(state, states_[step_ % states_.size()]);
  needle_flags_ |= state.flags;
  return simulated;
}

CycleWork TwoBlocks::cycle() {
  const auto way_in = static_cast<std::uint64_t>(std::lround(kWayIn * run_.haptic_hz));
  while (step_ < way_in) step();
  CycleWork cycle{.work = -needle().hand_work, .stroke = run_.stroke};
  const auto steps = std::lround(run_.haptic_hz / run_.frequency_hz);
  for (long i = 0; i < steps; ++i) {
    step();
    cycle.peak_force = std::max(cycle.peak_force, needle().wrench.force.norm());
  }
  cycle.work += needle().hand_work;
  return cycle;
}

}  // namespace stylet::reference
