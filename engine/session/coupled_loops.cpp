#include "engine/session/coupled_loops.h"

#include "engine/content/breathing.h"
#include "engine/content/tissue_locator.h"
#include "engine/files/error.h"
#include "engine/readers/motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace stylet::session {

namespace {

constexpr int kSettlingSteps = 25;  // half a second at 50 Hz; after a fifth the volume of elements is within 0.2 %

physics::HapticLoopSettings haptic_settings(const content::Scene& scene, physics::Coupling coupling,
                                            const physics::NeedleBase& base) {
  physics::HapticLoopSettings settings;
  settings.needle = {.length = scene.needle.length,
                     .outer_diameter = scene.needle.outer_diameter,
                     .inner_diameter = scene.needle.inner_diameter,
                     .young_modulus = scene.needle.young_modulus,
                     .poisson_ratio = scene.needle.poisson_ratio,
                     .beams = scene.needle.beams,
                     .yield_strength = scene.needle.yield_strength};
  settings.base = base;
  settings.coupling = coupling;
  settings.track.spacing = scene.contact_spacing;
  settings.track.bevel_ratio = scene.needle.bevel_force_ratio;
  settings.track.friction = scene.shaft_friction;
  if (coupling == physics::Coupling::stylet) settings.tissues = tissue_map(scene);
  return settings;
}

/// Of each node a quarter of the tetrahedra around it, N.
Eigen::Matrix3Xd weight(const content::Scene& scene, const content::DeformableBody& body) {
  const auto& nodes = body.mesh.nodes;
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t t = 0; t < body.mesh.tets.size(); ++t) {
    const auto& tet = body.mesh.tets[t];
    const auto x = [&](std::size_t c) { return nodes[tet[c]]; };
    const double volume = (x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) / 6;
    const double mass = scene.tissues[body.tet_tissue[t]].density * volume;
    for (const int node : tet) load.col(node) += mass / 4 * scene.gravity;
  }
  return load;
}

std::vector<physics::SimulationBody> simulation_bodies(const content::Scene& scene) {
  std::vector<physics::SimulationBody> bodies;
  for (const content::DeformableBody& body : scene.bodies) {
    physics::SimulationBody& simulated = bodies.emplace_back();
    simulated.mesh = body.mesh;
    simulated.element = body.element;
    simulated.fixed_nodes = body.fixed_nodes;
    simulated.held_motion = body.held_motion;
    simulated.damping_time_s = scene.damping_time_s;
    simulated.capsule = body.capsule;
    if (!scene.gravity.isZero(0)) simulated.load = weight(scene, body);
    for (const content::Cavity& cavity : scene.cavities) {
      if (&scene.bodies[cavity.body] == &body) simulated.cavities.push_back(cavity.tets);
    }
    simulated.tet_materials = body.tet_mechanics;
    if (!simulated.tet_materials.empty()) continue;
    for (const std::uint8_t tissue : body.tet_tissue) {
      simulated.tet_materials.push_back(scene.tissues[tissue].mechanics);
    }
  }
  return bodies;
}

constexpr double kHousing = 0.004;  // m; how much wider the head is than the face that scans
// Friction of a smooth head on skin: dry skin against hard polymers 0.3 to 0.7 (Derler and Gerhardt 2012); under gel
// the film carries, which leaves a tenth of it or less.
constexpr double kDryFriction = 0.5;
constexpr double kGelFriction = 0.05;

physics::ProbeShape probe_shape(const content::Probe& probe) {
  physics::ProbeShape shape;
  shape.face_radius = probe.convex ? probe.radius : 0;
  shape.half_width = (probe.convex ? probe.radius * probe.field_of_view : probe.width) / 2 + kHousing;
  return shape;
}

/// Rad, 0.5 degrees: an engineering value; what it does to compliance and force is in physics/README.md.
constexpr double kStaleTurn = 0.0087;

physics::SimulationLoopSettings simulation_settings(const content::Scene& scene, physics::Coupling coupling) {
  physics::SimulationLoopSettings settings;
  settings.dt = 1.0 / scene.rates.simulation_hz;
  settings.contact_spacing = scene.contact_spacing;
  settings.lay_contacts = coupling != physics::Coupling::stylet;
  for (const content::BodyContact& contact : scene.contacts) {
    settings.contact.pairs.push_back({contact.nodes_of, contact.surface_of});
  }
  if (scene.probe.presses >= 0) {
    settings.contact.probe.emplace();
    settings.contact.probe->shape = probe_shape(scene.probe);
    settings.contact.probe->body = scene.probe.presses;
    settings.contact.probe->held_at = scene.probe.pose.position;
    settings.contact.probe->friction = scene.probe.gel ? kGelFriction : kDryFriction;
  }
  return settings;
}

// The loops' constructors know nothing of files: their complaints are given the place here.
template <typename Make>
auto with_place(const content::Scene& scene, const Make& make) {
  try {
    return make();
  } catch (const std::invalid_argument& error) {
    throw files::ContentError(fmt::format("{}: {}", scene.scenario.string(), error.what()));
  }
}

}  // namespace

const char* coupling_name(physics::Coupling coupling) {
  switch (coupling) {
    case physics::Coupling::stylet:
      return "stylet";
    case physics::Coupling::paper_updated:
      return "paper-updated";
    case physics::Coupling::paper_trajectory:
      return "paper-trajectory";
    case physics::Coupling::paper_frozen:
      return "paper-frozen";
  }
  return "?";
}

physics::Coupling coupling_from_name(const std::string& name) {
  for (const auto coupling : {physics::Coupling::stylet, physics::Coupling::paper_updated,
                              physics::Coupling::paper_trajectory, physics::Coupling::paper_frozen}) {
    if (name == coupling_name(coupling)) return coupling;
  }
  throw files::ContentError(
      fmt::format("coupling \"{}\": there is stylet, paper-updated, paper-trajectory and paper-frozen", name));
}

// The needle touches deformable bodies and the bone in them only: voxels of anything else are where a mesh's surface
// is not quite the organ's, and count as outside (TissueMap::at then looks around).
std::shared_ptr<const physics::TissueMap> tissue_map(const content::Scene& scene) {
  auto map = std::make_shared<physics::TissueMap>();
  const content::LabelVolume& volume = scene.labels;
  if (volume.labels.empty()) {
    if (scene.tissues.size() > 1) map->tissues[1] = scene.tissues[1].needle;
    return map;
  }
  map->origin = volume.origin.cast<double>();
  map->spacing = volume.spacing;
  map->size = volume.size;
  map->labels = volume.labels;
  map->tissues.clear();
  for (const content::Tissue& tissue : scene.tissues) {
    map->tissues.push_back(tissue.needle);
    map->tissues.back().rigid = content::is_bone(tissue);
    map->young_modulus.push_back(tissue.mechanics.young_modulus);
  }
  for (std::size_t v = 0; v < map->labels.size(); ++v) {
    if (volume.bodies[v] < 0 && !map->resistance(map->labels[v]).rigid) map->labels[v] = 0;
  }
  map->surfaces = scene.tissue_surfaces;
  return map;
}

CoupledLoops::CoupledLoops(const content::Scene& scene, physics::Coupling coupling, const physics::StylusPose& start,
                           std::vector<StepListener*> listeners, const physics::NeedleBase& base)
    : scene_(scene),
      listeners_(std::move(listeners)),
      haptic_(with_place(scene, [&] { return physics::HapticLoop(haptic_settings(scene, coupling, base), start); })),
      simulation_(with_place(scene, [&] { return simulation_bodies(scene); }), simulation_settings(scene, coupling)),
      stale_turn_(coupling == physics::Coupling::stylet ? kStaleTurn : 0),
      haptic_dt_(1.0 / scene.rates.haptic_hz),
      hub_(start) {
  // Nobody sees a patient give way for the first time: the probe lies on them when the session begins.
  const physics::RigidPose probe = probe_pose(scene, 0);
  const double inspiration = content::inspiration(scene.breathing, 0);
  simulation_.settle({.probe = &probe, .held_amplitude = inspiration}, kSettlingSteps);
}

const physics::NeedleState& CoupledLoops::haptic_step(const haptic::StylusSample& sample,
                                                      const physics::TissuePatch& patch) {
  if (sample.valid) hub_ = {sample.position, sample.orientation};
  return haptic_step(recording::HapticStepRecord{.step = haptic_steps_ + 1,
                                                 .time_s = sample.time_s,
                                                 .dt_s = haptic_dt_,
                                                 .pose = hub_,
                                                 .buttons = sample.buttons,
                                                 .valid = sample.valid,
                                                 .patch_epoch = patch.epoch},
                     patch);
}

const physics::NeedleState& CoupledLoops::haptic_step(const recording::HapticStepRecord& input,
                                                      const physics::TissuePatch& patch) {
  const physics::NeedleState& needle = haptic_.step(input.pose, input.dt_s, patch);
  ++haptic_steps_;
  for (StepListener* listener : listeners_) listener->haptic_stepped(input, needle);
  return needle;
}

void CoupledLoops::force_sent(double time_s, const haptic::GuardedWrench& out) {
  for (StepListener* listener : listeners_) listener->force_sent(time_s, haptic_steps_, out);
}

physics::SimulationReport CoupledLoops::simulation_step(double time_s, const physics::NeedleState& needle, bool take,
                                                        bool request, physics::TissuePatch& out) {
  return simulation_step(time_s, needle, probe_pose(scene_, time_s), take, request, out);
}

physics::SimulationReport CoupledLoops::simulation_step(double time_s, const physics::NeedleState& needle,
                                                        const physics::RigidPose& probe, bool take, bool request,
                                                        physics::TissuePatch& out,
                                                        const recording::SimulationStepRecord* recorded) {
  recording::CavityShares shares = recorded != nullptr ? recorded->cavity_shares : recording::full_cavities();
  const std::span used = std::span(shares).first(scene_.cavities.size());
  std::optional<double> breath;
  if (recorded != nullptr) {
    if (recorded->inspiration >= 0) breath = recorded->inspiration;
  } else {
    for (StepListener* listener : listeners_) {
      if (!used.empty()) listener->fill_cavities(used);
      if (const auto asked = listener->inspiration(time_s)) breath = asked;
    }
  }
  const double inspiration = breath ? *breath : content::inspiration(scene_.breathing, time_s);
  const physics::SimulationReport report = simulation_.step({.needle = &needle,
                                                             .time_s = time_s,
                                                             .take_factorisation = take,
                                                             .request_factorisation = request,
                                                             .stale_turn = recorded == nullptr ? stale_turn_ : 0,
                                                             .probe = &probe,
                                                             .held_amplitude = inspiration,
                                                             .cavity_shares = used},
                                                            out);
  const recording::SimulationStepRecord record{.step = ++simulation_steps_,
                                               .time_s = time_s,
                                               .needle_step = report.needle_step,
                                               .factor_taken = report.factorisation_taken,
                                               .factor_requested = report.factorisation_requested,
                                               .factor_epoch = report.factor_epoch,
                                               .probe = probe,
                                               .cavity_shares = shares,
                                               .inspiration = inspiration};
  for (StepListener* listener : listeners_) {
    listener->simulation_stepped(record, report, simulation_.tissue(), needle);
  }
  return report;
}

double insertion_depth(const content::Needle& properties, const physics::NeedleState& needle) {
  double entry = properties.length;
  for (int i = 0; i < needle.contact_count; ++i) {
    const physics::NeedleContact& contact = needle.contacts[i];
    entry = std::min(entry, (contact.beam + contact.beam_fraction) * properties.length / properties.beams);
  }
  return properties.length - entry;
}

physics::RigidPose probe_pose(const content::Scene& scene, double time_s) {
  if (scene.motion.probe.empty()) return scene.probe.pose;
  const content::MotionSample sample = readers::sample_motion(scene.motion.probe, time_s);
  return {sample.pose.position, sample.pose.orientation};
}

}  // namespace stylet::session
