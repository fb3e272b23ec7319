#include "tools/reference/reference_insertion.h"

#include "engine/files/json_reader.h"
#include "tools/reference/kuhn_box.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::reference {

namespace {

/// [[time, speed], ...], times ascending.
std::vector<std::array<double, 2>> read_speeds(files::JsonObject& base) {
  std::vector<std::array<double, 2>> speeds;
  const nlohmann::json* rows = base.array("axial_speed");
  if (rows == nullptr) return speeds;
  for (const nlohmann::json& row : *rows) {
    if (!row.is_array() || row.size() != 2 || !row[0].is_number() || !row[1].is_number() ||
        (!speeds.empty() && row[0].get<double>() <= speeds.back()[0])) {
      base.problem("axial_speed", fmt::format("item {} is {}, not [s, m/s] at a later time than the item before it",
                                              speeds.size(), row.dump()));
      return speeds;
    }
    speeds.push_back({row[0].get<double>(), row[1].get<double>()});
  }
  if (speeds.empty()) base.problem("axial_speed", "is empty; give at least one [s, m/s]");
  return speeds;
}

}  // namespace

ReferenceInsertion read_reference_insertion(const std::filesystem::path& path) {
  files::JsonFile file(path);
  files::JsonObject root = file.root("stylet-reference-insertion", 1);
  for (const char* key : {"name", "licence", "source"}) root.ignore(key);
  ReferenceInsertion r;
  if (auto cube = root.object("cube")) {
    r.cube_edge = cube->number("edge", {1e-3, 10});
    r.nodes_per_edge = cube->integer("nodes_per_edge", 2, 64);
    r.material = {cube->number("young_modulus", {1, 1e12}), cube->number("poisson_ratio", {0, 0.499})};
    cube->finish();
  }
  if (auto needle = root.object("needle")) {
    r.needle.length = needle->number("length", {1e-3, 10});
    r.needle.outer_diameter = needle->number("outer_diameter", {1e-5, 1});
    r.needle.inner_diameter = needle->number("inner_diameter", {0, 1});
    r.needle.young_modulus = needle->number("young_modulus", {1, 1e13});
    r.needle.poisson_ratio = needle->number("poisson_ratio", {0, 0.499});
    r.needle.beams = needle->integer("beams", 1, physics::kMaxBeams);
    needle->finish();
  }
  if (auto base = root.object("base")) {
    r.tip_start = base->vector3("tip_start", {-10, 10});
    r.axial_speed = read_speeds(*base);
    if (auto lateral = base->object("lateral")) {
      r.lateral_amplitude = lateral->number("amplitude", {-1, 1});
      r.lateral_start = lateral->number("start", {0, 1e4});
      r.lateral_end = lateral->number("end", {0, 1e4});
      if (r.lateral_end <= r.lateral_start) lateral->problem("end", "is not later than start");
      lateral->finish();
    }
    base->finish();
  }
  r.contact_spacing = root.number("contact_spacing", {1e-4, 1});
  r.haptic_hz = root.number("haptic_hz", {1, 1e5});
  r.simulation_hz = root.number("simulation_hz", {1, r.haptic_hz});
  r.duration = root.number("duration", {0, 1e4});
  root.finish();
  file.throw_problems();
  return r;
}

physics::StylusPose ReferenceInsertion::base(double time_s) const {
  double axial = 0;  // integral of the piecewise linear speed
  for (std::size_t i = 0; i + 1 < axial_speed.size(); ++i) {
    const auto [t0, v0] = axial_speed[i];
    const auto [t1, v1] = axial_speed[i + 1];
    const double dt = std::clamp(time_s, t0, t1) - t0;
    axial += dt * (v0 + 0.5 * (v1 - v0) * dt / (t1 - t0));
  }
  const double u = std::clamp((time_s - lateral_start) / (lateral_end - lateral_start), 0.0, 1.0);
  const double lateral = lateral_amplitude * u * u * u * (10 - 15 * u + 6 * u * u);
  physics::StylusPose pose;
  pose.position = tip_start + Eigen::Vector3d(axial - needle.length, lateral, 0);
  pose.orientation = physics::orientation_along(Eigen::Vector3d::UnitX());
  return pose;
}

physics::SimulationBody ReferenceInsertion::body() const {
  const int cells = nodes_per_edge - 1;
  physics::SimulationBody body;
  body.mesh =
      reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(cube_edge), {cells, cells, cells});
  body.tet_materials.assign(body.mesh.tets.size(), material);
  body.fixed_nodes =
      reference::nodes_where(body.mesh, [&](const Eigen::Vector3d& x) { return x.z() <= held_height; });
  return body;
}

int ReferenceInsertion::haptic_steps_per_simulation_step() const {
  return static_cast<int>(std::lround(haptic_hz / simulation_hz));
}

ReferenceExperiment::ReferenceExperiment(const ReferenceInsertion& insertion, const ReferenceRun& run)
    : insertion_(insertion), run_(run) {
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(insertion.body());
  simulation_ = std::make_unique<physics::SimulationLoop>(
      std::move(bodies), physics::SimulationLoopSettings{.dt = 1 / insertion.simulation_hz,
                                                         .contact_spacing = insertion.contact_spacing,
                                                         .lay_contacts = run.coupling != physics::Coupling::stylet});
  physics::HapticLoopSettings settings;
  settings.needle = insertion.needle;
  settings.coupling = run.coupling;
  settings.relative_compliance = run.relative_compliance;
  settings.track = run.track;
  settings.track.spacing = insertion.contact_spacing;
  settings.tissues = run.tissues;
  haptic_ = std::make_unique<physics::HapticLoop>(settings, base());
  for (int i = 0; i <= run.latency_steps; ++i) patches_.push_back(simulation_->make_patch());
}

physics::StylusPose ReferenceExperiment::base() const {
  physics::StylusPose pose = insertion_.base(time_s());
  pose.orientation *=
      Eigen::Quaterniond(Eigen::AngleAxisd(run_.roll_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()));
  return pose;
}

double ReferenceExperiment::time_s() const {
  return static_cast<double>(haptic_step_) / insertion_.haptic_hz;
}

void ReferenceExperiment::advance() {
  simulation_step();
  for (int i = 0; i < insertion_.haptic_steps_per_simulation_step(); ++i) haptic_step();
}

void ReferenceExperiment::simulation_step() {
  std::rotate(patches_.begin(), patches_.end() - 1, patches_.end());
  report_ = simulation_->step({.needle = &haptic_->state(), .time_s = time_s()}, patches_.front());
  ++simulation_step_;
  if (run_.worker_period > 0 && simulation_step_ % static_cast<std::uint64_t>(run_.worker_period) == 0) {
    simulation_->worker().step();
  }
}

void ReferenceExperiment::haptic_step() {
  ++haptic_step_;
  const physics::NeedleState& state = haptic_->step(base(), 1 / insertion_.haptic_hz, patch_in_use());
  forces_.push_back(state.wrench.force);
  most_contacts_ = std::max(most_contacts_, state.contact_count);
  needle_flags_ |= state.flags;
}

double jump(const std::vector<Eigen::Vector3d>& forces, int axis) {
  double largest = 0;
  for (std::size_t k = 1; k < forces.size(); ++k) {
    largest = std::max(largest, std::abs(forces[k][axis] - forces[k - 1][axis]));
  }
  return largest;
}

double discontinuity(const std::vector<Eigen::Vector3d>& forces, int axis) {
  double largest = 0;
  for (std::size_t k = 1; k + 2 < forces.size(); ++k) {
    const double before = forces[k][axis] + (forces[k][axis] - forces[k - 1][axis]) / 2;
    const double behind = forces[k + 1][axis] - (forces[k + 2][axis] - forces[k + 1][axis]) / 2;
    largest = std::max(largest, std::abs(behind - before));
  }
  return largest;
}

double roughness(const std::vector<Eigen::Vector3d>& forces, int axis) {
  double sum = 0;
  for (std::size_t k = 2; k < forces.size(); ++k) {
    const double second = forces[k][axis] - 2 * forces[k - 1][axis] + forces[k - 2][axis];
    sum += second * second;
  }
  return std::sqrt(sum / static_cast<double>(forces.size() - 2));
}

}  // namespace stylet::reference
