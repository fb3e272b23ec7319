#include "physics/c_api/stylet_physics.h"

#include "physics/contact/needle_track.h"
#include "physics/contact/tissue_map.h"
#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"
#include "physics/messages/latest_value.h"
#include "physics/messages/messages.h"
#include "physics/needle/needle.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

using namespace stylet::physics;  // the names of C begin with stylet_ or STYLET_

static_assert(STYLET_NEEDLE_BASE_LIMITED == kNeedleBaseLimited && STYLET_NEEDLE_ROW_OVERFLOW == kNeedleRowOverflow &&
              STYLET_NEEDLE_SOLVE_FAILED == kNeedleSolveFailed && STYLET_NEEDLE_NON_FINITE == kNeedleNonFinite &&
              STYLET_NEEDLE_STEP_SHORTENED == kNeedleStepShortened &&
              STYLET_NEEDLE_ROWS_DEPENDENT == kNeedleRowsDependent && STYLET_NEEDLE_PATCH_LEFT == kNeedlePatchLeft &&
              STYLET_NEEDLE_SOLVE_INEXACT == kNeedleSolveInexact &&
              STYLET_NEEDLE_BOUNDS_LAGGED == kNeedleBoundsLagged);
static_assert(STYLET_TISSUE_INVERTED == kSimulationInverted && STYLET_TISSUE_STEP_LIMITED == kSimulationStepLimited &&
              STYLET_TISSUE_NON_FINITE == kSimulationNonFinite &&
              STYLET_TISSUE_FACTORISATION_FAILED == kSimulationFactorisationFailed);
static_assert(static_cast<int>(TipState::outside) == STYLET_TIP_OUTSIDE &&
              static_cast<int>(TipState::indenting) == STYLET_TIP_INDENTING &&
              static_cast<int>(TipState::inside) == STYLET_TIP_INSIDE);
static_assert(kMaxBeams == 64 && kMaxContacts == 96);  // said in the header

struct stylet_physics {
  stylet_physics(std::vector<SimulationBody> bodies, const SimulationLoopSettings& simulation_settings,
                 const HapticLoopSettings& haptic_settings, const StylusPose& hub, double haptic_step_s)
      : haptic(haptic_settings, hub),
        simulation(std::move(bodies), simulation_settings),
        patches(simulation.make_patch()),
        haptic_dt(haptic_step_s),
        simulation_dt(simulation_settings.dt) {
    publish_needle();
  }
  void publish_needle() {
    copy_state(haptic.state(), needles.back());
    needles.publish();
  }

  HapticLoop haptic;
  SimulationLoop simulation;
  LatestValue<TissuePatch> patches;  // simulation -> haptic
  LatestValue<NeedleState> needles;  // haptic -> simulation
  SimulationReport report;           // simulation's
  double haptic_dt;                  // s
  double simulation_dt;              // s
};

namespace {

thread_local std::array<char, 512> last_error{};

stylet_status fail(stylet_status status, const char* text) {
  std::snprintf(last_error.data(), last_error.size(), "%s", text);
  return status;
}

struct Refusal {
  stylet_status status;
  std::string text;
};

void require(bool condition, const char* text, stylet_status status = STYLET_ERROR_ARGUMENT) {
  if (!condition) throw Refusal{status, text};
}

/// What `work` throws becomes a status and a text.
template <typename Work>
stylet_status guarded(const Work& work) noexcept {
  try {
    work();
    return STYLET_OK;
  } catch (const Refusal& refusal) {
    return fail(refusal.status, refusal.text.c_str());
  } catch (const std::invalid_argument& error) {
    return fail(STYLET_ERROR_MODEL, error.what());
  } catch (const std::bad_alloc&) {
    return fail(STYLET_ERROR_MEMORY, "out of memory");
  } catch (const std::runtime_error& error) {  // CHOLMOD's complaints
    return fail(STYLET_ERROR_MEMORY, error.what());
  } catch (const std::exception& error) {
    return fail(STYLET_ERROR_INTERNAL, error.what());
  } catch (...) {
    return fail(STYLET_ERROR_INTERNAL, "unknown exception");
  }
}

// Sizes of the structs in version 1: a smaller one was never there.
constexpr std::size_t first_size(const stylet_body*) {
  return 120;
}
constexpr std::size_t first_size(const stylet_needle*) {
  return 88;
}
constexpr std::size_t first_size(const stylet_settings*) {
  return 40;
}
constexpr std::size_t first_size(const stylet_needle_state*) {
  return 112;
}
constexpr std::size_t first_size(const stylet_tissue_state*) {
  return 48;
}

template <typename Struct>
bool known_size(std::size_t size) {
  static_assert(sizeof(Struct) >= first_size(static_cast<const Struct*>(nullptr)));
  return size >= first_size(static_cast<const Struct*>(nullptr)) && size <= sizeof(Struct);
}

template <typename Struct>
stylet_status fill(const Struct& from, std::size_t struct_size, Struct* to) {
  if (to == nullptr) return fail(STYLET_ERROR_ARGUMENT, "a null pointer where a struct is to be filled");
  if (!known_size<Struct>(struct_size))
    return fail(STYLET_ERROR_VERSION, "a struct_size that this library does not know");
  std::memcpy(to, &from, struct_size);
  to->struct_size = struct_size;
  return STYLET_OK;
}

/// `given` with the defaults of the fields that its program does not know.
template <typename Struct>
Struct read(const Struct* given, Struct defaults, const char* name) {
  require(given != nullptr, (std::string(name) + " is null").c_str());
  if (!known_size<Struct>(given->struct_size)) {
    throw Refusal{STYLET_ERROR_VERSION, std::string(name) + ": a struct_size of " +
                                            std::to_string(given->struct_size) +
                                            " is not known to this library; call stylet_" + name + "_init first"};
  }
  std::memcpy(&defaults, given, given->struct_size);
  return defaults;
}

stylet_needle default_needle() {
  const NeedleProperties needle;
  const NeedleTrackSettings track;
  return {.struct_size = sizeof(stylet_needle),
          .length = needle.length,
          .outer_diameter = needle.outer_diameter,
          .inner_diameter = needle.inner_diameter,
          .young_modulus = needle.young_modulus,
          .poisson_ratio = needle.poisson_ratio,
          .bevel_ratio = track.bevel_ratio,
          .tip_radius = track.tip_radius,
          .base_stiffness = 0,
          .base_rotational_stiffness = 0,
          .beams = needle.beams,
          .reserved = 0};
}

stylet_settings default_settings() {
  const SimulationLoopSettings simulation;
  return {.struct_size = sizeof(stylet_settings),
          .haptic_hz = 1000,
          .simulation_hz = 1 / simulation.dt,
          .contact_spacing = simulation.contact_spacing,
          .coupling = STYLET_COUPLING_STYLET,
          .reserved = 0};
}

template <typename T>
std::span<const T> array(const T* values, std::int32_t count, std::size_t each, const char* what) {
  require(values != nullptr && count > 0, what);
  return {values, each * static_cast<std::size_t>(count)};
}

SimulationBody simulation_body(const stylet_body& body) {
  const auto nodes = array(body.nodes, body.node_count, 3, "body: nodes are missing");
  const auto tets = array(body.tets, body.tet_count, 4, "body: tets are missing");
  const auto materials = array(body.materials, body.material_count, 1, "body: materials are missing");
  const auto fixed = array(body.fixed_nodes, body.fixed_count, 1, "body: fixed_nodes are missing");
  SimulationBody out;
  out.damping_time_s = body.damping_time;
  out.fixed_nodes.assign(fixed.begin(), fixed.end());
  for (std::size_t i = 0; i < nodes.size(); i += 3) out.mesh.nodes.emplace_back(nodes[i], nodes[i + 1], nodes[i + 2]);
  for (std::size_t i = 0; i < tets.size(); i += 4) {
    out.mesh.tets.push_back({tets[i], tets[i + 1], tets[i + 2], tets[i + 3]});
  }
  for (std::size_t t = 0; t < out.mesh.tets.size(); ++t) {
    const std::int32_t m = body.tet_materials != nullptr ? body.tet_materials[t] : 0;
    if (m < 0 || m >= body.material_count) {
      throw Refusal{STYLET_ERROR_MODEL,
                    "body: tetrahedron " + std::to_string(t) + " names material " + std::to_string(m)};
    }
    const stylet_material& material = materials[m];
    out.tet_materials.push_back({.young_modulus = material.young_modulus, .poisson_ratio = material.poisson_ratio});
  }
  return out;
}

/// Everything inside the body is one tissue.
std::shared_ptr<const TissueMap> tissue_map(const stylet_body& body) {
  for (const double value : {body.puncture_force, body.cutting_force, body.cutting_viscosity,
                             body.friction_per_length, body.friction_coefficient, body.viscous_friction}) {
    require(value >= 0 && std::isfinite(value), "body: what resists the needle must be 0 or more");
  }
  auto map = std::make_shared<TissueMap>();
  map->tissues[1] = {.puncture_force = body.puncture_force,
                     .cutting_force = body.cutting_force,
                     .cutting_viscosity = body.cutting_viscosity,
                     .friction_per_length = body.friction_per_length,
                     .friction_coefficient = body.friction_coefficient,
                     .viscous_friction = body.viscous_friction};
  return map;
}

Coupling coupling(std::int32_t named) {
  switch (named) {
    case STYLET_COUPLING_STYLET:
      return Coupling::stylet;
    case STYLET_COUPLING_PAPER_UPDATED:
      return Coupling::paper_updated;
    case STYLET_COUPLING_PAPER_TRAJECTORY:
      return Coupling::paper_trajectory;
    case STYLET_COUPLING_PAPER_FROZEN:
      return Coupling::paper_frozen;
    default:
      throw Refusal{STYLET_ERROR_ARGUMENT, "settings: coupling " + std::to_string(named) + " does not exist"};
  }
}

HapticLoopSettings haptic_settings(const stylet_body& body, const stylet_needle& needle,
                                   const stylet_settings& settings) {
  require(std::isfinite(needle.bevel_ratio), "needle: bevel_ratio must be finite");
  require(needle.tip_radius > 0 && std::isfinite(needle.tip_radius), "needle: tip_radius must be positive");
  require(needle.base_stiffness >= 0, "needle: base_stiffness must be 0 or more");
  HapticLoopSettings out;
  out.needle = {.length = needle.length,
                .outer_diameter = needle.outer_diameter,
                .inner_diameter = needle.inner_diameter,
                .young_modulus = needle.young_modulus,
                .poisson_ratio = needle.poisson_ratio,
                .beams = needle.beams};
  if (needle.base_stiffness > 0) {
    out.base = {.kind = BaseKind::spring_damper,
                .stiffness = needle.base_stiffness,
                .rotational_stiffness = needle.base_rotational_stiffness};
  }
  out.coupling = coupling(settings.coupling);
  out.track.spacing = settings.contact_spacing;
  out.track.bevel_ratio = needle.bevel_ratio;
  out.track.tip_radius = needle.tip_radius;
  out.tissues = tissue_map(body);
  return out;
}

StylusPose stylus_pose(const stylet_pose& pose) {
  const auto& [x, y, z, w] = pose.orientation;
  return {.position = {pose.position[0], pose.position[1], pose.position[2]},
          .orientation = Eigen::Quaterniond(w, x, y, z)};
}

void copy(const Eigen::Vector3d& from, double (&to)[3]) {
  std::copy_n(from.data(), 3, to);
}

stylet_wrench wrench_of(const NeedleState& needle) {
  stylet_wrench out;
  copy(needle.wrench.force, out.force);
  copy(needle.wrench.moment, out.moment);
  return out;
}

stylet_status no_handle() {
  return fail(STYLET_ERROR_ARGUMENT, "physics is null");
}

}  // namespace

std::int32_t stylet_physics_version() {
  return STYLET_PHYSICS_VERSION;
}

const char* stylet_last_error() {
  return last_error.data();
}

stylet_status stylet_body_init(stylet_body* body, std::size_t struct_size) {
  return fill({}, struct_size, body);
}

stylet_status stylet_needle_init(stylet_needle* needle, std::size_t struct_size) {
  return fill(default_needle(), struct_size, needle);
}

stylet_status stylet_settings_init(stylet_settings* settings, std::size_t struct_size) {
  return fill(default_settings(), struct_size, settings);
}

stylet_status stylet_physics_create(const stylet_body* given_body, const stylet_needle* given_needle,
                                    const stylet_settings* given_settings, const stylet_pose* hub,
                                    stylet_physics** physics) {
  if (physics == nullptr) return no_handle();
  *physics = nullptr;
  return guarded([&] {
    const stylet_body body = read(given_body, stylet_body{}, "body");
    const stylet_needle needle = read(given_needle, default_needle(), "needle");
    const stylet_settings settings = read(given_settings, default_settings(), "settings");
    require(hub != nullptr, "hub is null");
    const StylusPose start = stylus_pose(*hub);
    require(start.position.allFinite() && start.orientation.norm() > 1e-6 && std::isfinite(start.orientation.norm()),
            "hub: the pose is not finite, or its orientation is 0");
    const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
    require(positive(settings.haptic_hz) && positive(settings.simulation_hz) && positive(settings.contact_spacing),
            "settings: rates and contact_spacing must be positive");
    const HapticLoopSettings haptic = haptic_settings(body, needle, settings);
    const SimulationLoopSettings simulation{.dt = 1 / settings.simulation_hz,
                                            .contact_spacing = settings.contact_spacing,
                                            .lay_contacts = haptic.coupling != Coupling::stylet};
    std::vector<SimulationBody> bodies;
    bodies.push_back(simulation_body(body));
    *physics = new stylet_physics(std::move(bodies), simulation, haptic, start, 1 / settings.haptic_hz);
  });
}

void stylet_physics_destroy(stylet_physics* physics) {
  delete physics;
}

stylet_status stylet_physics_haptic_step(stylet_physics* physics, const stylet_pose* hub, stylet_wrench* hand) {
  if (physics == nullptr) return no_handle();
  if (hub == nullptr) return fail(STYLET_ERROR_ARGUMENT, "hub is null");
  physics->patches.update();
  const NeedleState& needle = physics->haptic.step(stylus_pose(*hub), physics->haptic_dt, physics->patches.front());
  physics->publish_needle();
  if (hand != nullptr) *hand = wrench_of(needle);
  return STYLET_OK;
}

stylet_status stylet_physics_simulation_step(stylet_physics* physics) {
  if (physics == nullptr) return no_handle();
  return guarded([&] {
    physics->needles.update();
    const double time_s = static_cast<double>(physics->simulation.tissue().step) * physics->simulation_dt;
    physics->report =
        physics->simulation.step({.needle = &physics->needles.front(), .time_s = time_s}, physics->patches.back());
    physics->patches.publish();
  });
}

stylet_status stylet_physics_factorise(stylet_physics* physics, std::int32_t* done) {
  if (physics == nullptr) return no_handle();
  return guarded([&] {
    const bool worked = physics->simulation.worker().step();
    if (done != nullptr) *done = worked ? 1 : 0;
  });
}

stylet_status stylet_physics_needle_state(const stylet_physics* physics, stylet_needle_state* state) {
  if (physics == nullptr) return no_handle();
  if (state == nullptr) return fail(STYLET_ERROR_ARGUMENT, "state is null");
  const NeedleState& needle = physics->haptic.state();
  return fill({.struct_size = 0,
               .step = needle.step,
               .tissue_step = needle.patch_epoch,
               .wrench = wrench_of(needle),
               .tip_depth = needle.tip_depth,
               .hand_work = needle.hand_work,
               .tip = static_cast<std::int32_t>(needle.tip),
               .node_count = needle.node_count,
               .contact_count = needle.contact_count,
               .puncture_count = needle.puncture_count,
               .flags = needle.flags,
               .reserved = 0},
              state->struct_size, state);
}

stylet_status stylet_physics_needle_nodes(const stylet_physics* physics, double* positions, double* orientations,
                                          std::size_t capacity) {
  if (physics == nullptr) return no_handle();
  const NeedleState& needle = physics->haptic.state();
  const auto count = static_cast<std::size_t>(needle.node_count);
  if (capacity < count) return fail(STYLET_ERROR_ARGUMENT, "capacity is less than the needle's node_count");
  if (positions != nullptr) std::copy_n(needle.positions.data(), 3 * count, positions);
  for (std::size_t i = 0; orientations != nullptr && i < count; ++i) {
    std::copy_n(needle.orientations[i].coeffs().data(), 4, orientations + 4 * i);
  }
  return STYLET_OK;
}

stylet_status stylet_physics_contacts(const stylet_physics* physics, stylet_contact* contacts, std::size_t capacity,
                                      std::size_t* count) {
  if (physics == nullptr) return no_handle();
  if (contacts == nullptr || count == nullptr) return fail(STYLET_ERROR_ARGUMENT, "contacts or count is null");
  const NeedleState& needle = physics->haptic.state();
  *count = static_cast<std::size_t>(needle.contact_count);
  if (capacity < *count) return fail(STYLET_ERROR_ARGUMENT, "capacity is less than the contact_count");
  for (std::size_t i = 0; i < *count; ++i) {
    copy(needle.contacts[i].position, contacts[i].position);
    copy(needle.contacts[i].force, contacts[i].force);
  }
  return STYLET_OK;
}

stylet_status stylet_physics_tissue_state(const stylet_physics* physics, stylet_tissue_state* state) {
  if (physics == nullptr) return no_handle();
  if (state == nullptr) return fail(STYLET_ERROR_ARGUMENT, "state is null");
  const SimulationReport& report = physics->report;
  return fill({.struct_size = 0,
               .step = report.step,
               .needle_step = report.needle_step,
               .residual = report.residual_n,
               .needle_force = report.force_n,
               .flags = report.flags,
               .node_count = physics->simulation.model(0).node_count()},
              state->struct_size, state);
}

stylet_status stylet_physics_tissue_nodes(const stylet_physics* physics, double* positions, std::size_t capacity) {
  if (physics == nullptr) return no_handle();
  if (positions == nullptr) return fail(STYLET_ERROR_ARGUMENT, "positions is null");
  const Eigen::Matrix3Xd& nodes = physics->simulation.tissue().positions[0];
  if (capacity < static_cast<std::size_t>(nodes.cols())) {
    return fail(STYLET_ERROR_ARGUMENT, "capacity is less than the body's node_count");
  }
  std::copy_n(nodes.data(), nodes.size(), positions);
  return STYLET_OK;
}
