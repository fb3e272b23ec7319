#include "tools/reference/liver_block.h"

#include "physics/tissue/refinement.h"
#include "tools/reference/kuhn_box.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stylet::reference {
namespace {

constexpr double kGrading = 2.5;   // 1: even cells
constexpr double kAside = 0.0004;  // m; the needle stands on no node

physics::SimulationBody block(const LiverBlockSettings& s) {
  physics::SimulationBody body;
  physics::TetMesh coarse = kuhn_box({0, -1, -1}, {1, 1, 1}, {s.cells_deep, s.cells_across, s.cells_across});
  // Narrow cells under the needle: the face is x = 0.
  for (Eigen::Vector3d& x : coarse.nodes) {
    const auto graded = [&](double share) {
      return 0.5 * s.side * std::copysign(std::pow(std::abs(share), kGrading), share);
    };
    x = {s.depth * std::pow(x.x(), 0.5 + 0.5 * kGrading), graded(x.y()), graded(x.z())};
  }
  body.mesh = physics::refined(coarse);
  body.tet_materials.assign(body.mesh.tets.size(), s.material);
  body.fixed_nodes = nodes_where(body.mesh, [&](const Eigen::Vector3d& x) { return x.x() > s.depth - 1e-9; });
  body.element = physics::Element::quadratic;
  body.capsule = s.capsule;
  return body;
}

}  // namespace

LiverBlock::LiverBlock(const LiverBlockSettings& settings) : settings_(settings) {
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(block(settings));
  simulation_ = std::make_unique<physics::SimulationLoop>(
      std::move(bodies), physics::SimulationLoopSettings{.dt = 1 / settings.simulation_hz, .lay_contacts = false});
  auto tissues = std::make_shared<physics::TissueMap>();
  tissues->tissues = {{}, settings.resistance};
  physics::HapticLoopSettings haptic;
  haptic.coupling = physics::Coupling::stylet;
  haptic.track.tip_radius = settings.tip_radius;
  haptic.tissues = std::move(tissues);
  haptic_ = std::make_unique<physics::HapticLoop>(haptic, base());
  patch_ = simulation_->make_patch();
}

physics::StylusPose LiverBlock::base() const {
  physics::StylusPose pose;
  pose.position = {travel_ - settings_.gap - physics::NeedleProperties{}.length, kAside, 0.7 * kAside};
  pose.orientation = physics::orientation_along(Eigen::Vector3d::UnitX());
  return pose;
}

void LiverBlock::go(double speed, double seconds) {
  const auto steps = std::lround(seconds * settings_.simulation_hz);
  const auto haptic_steps = std::lround(settings_.haptic_hz / settings_.simulation_hz);
  const double dt = 1 / settings_.haptic_hz;
  for (long step = 0; step < steps; ++step) {
    simulation_->step({.needle = &haptic_->state(), .time_s = time_s_, .stale_turn = 0.0087}, patch_);
    simulation_->worker().step();
    for (long i = 0; i < haptic_steps; ++i) {
      time_s_ += dt;
      travel_ += speed * dt;
      haptic_->step(base(), dt, patch_);
    }
    const physics::NeedleState& state = haptic_->state();
    samples_.push_back(
        {.time_s = time_s_, .travel = travel_, .force = -state.wrench.force.x(), .inside = state.puncture_count > 0});
  }
}

double force_exponent(const std::vector<double>& depth, const std::vector<double>& force) {
  const double deepest = *std::max_element(depth.begin(), depth.end());
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (!(depth[i] > 0.2 * deepest) || !(force[i] > 0)) continue;
    const double x = std::log(depth[i]);
    const double y = std::log(force[i]);
    n += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace stylet::reference
