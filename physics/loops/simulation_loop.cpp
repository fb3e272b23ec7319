#include "physics/loops/simulation_loop.h"

#include "physics/contact/corridor.h"
#include "physics/contact/surface_sweep.h"
#include "physics/loops/tissue_patch.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/inversion.h"
#include "physics/tissue/membrane.h"
#include "physics/tissue/quadratic.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

namespace stylet::physics {
namespace {

constexpr double kProbeStride = 0.001;  // m; the probe's motion in a step is divided so that no part is longer
constexpr int kMaxProbeParts = 4;       // but into no more than these
constexpr int kMaxCorrections = 2;      // a part, where the first is cut short

/// Takes the meshes.
std::vector<TissueModel> models_of(std::vector<SimulationBody>& bodies, const SimulationLoopSettings& settings) {
  if (bodies.empty() || bodies.size() > kMaxBodies) {
    throw std::invalid_argument("simulation: " + std::to_string(bodies.size()) + " bodies; 1 to " +
                                std::to_string(kMaxBodies) + " can be simulated");
  }
  if (!(settings.dt > 0) || !(settings.contact_spacing > 0)) {
    throw std::invalid_argument("simulation: dt and contact spacing must be positive");
  }
  std::vector<TissueModel> models;
  models.reserve(bodies.size());
  for (SimulationBody& body : bodies) {
    if (!body.held_motion.empty() && body.held_motion.size() != body.fixed_nodes.size()) {
      throw std::invalid_argument("simulation: motion of " + std::to_string(body.held_motion.size()) +
                                  " held nodes, " + std::to_string(body.fixed_nodes.size()) + " are held");
    }
    const auto nodes = static_cast<Eigen::Index>(body.mesh.nodes.size());
    if (body.load.size() > 0 && (body.load.cols() != nodes || !body.load.allFinite())) {
      throw std::invalid_argument("simulation: a load must be finite and of all " + std::to_string(nodes) + " nodes");
    }
    models.emplace_back(std::move(body.mesh), body.tet_materials, body.fixed_nodes, body.damping_time_s, body.element,
                        body.capsule);
  }
  return models;
}

bool finite(const NeedleState& needle) {
  if (!needle.positions.leftCols(needle.node_count).allFinite()) return false;
  for (int i = 0; i < needle.node_count; ++i) {
    if (!needle.orientations[i].coeffs().allFinite()) return false;
  }
  for (int i = 0; i < needle.force_count; ++i) {
    if (!needle.forces[i].force.allFinite()) return false;
  }
  return true;
}

bool finite(const RigidPose& pose) {
  return pose.position.allFinite() && pose.orientation.coeffs().allFinite();
}

}  // namespace

SimulationLoop::SimulationLoop(std::vector<SimulationBody> bodies, const SimulationLoopSettings& settings)
    : settings_(settings),
      models_(models_of(bodies, settings)),
      worker_(models_, settings.dt, settings.coarsest, settings.two_threads),
      companion_(settings.two_threads),
      path_(models_, {.spacing = settings.contact_spacing, .removal_hysteresis = settings.removal_hysteresis}) {
  for (int i = 0; i < Companion::kSides; ++i) {
    Side& side = sides_[static_cast<std::size_t>(i)];
    side.workspace.companion = side.elements.companion = &companion_.of(i);
    for (const TissueModel& model : models_) IsolatedDofs::make_scratch(model.dof_count(), side.workspace);
  }
  tissue_.body_count = body_count();
  bodies_.reserve(models_.size());
  for (std::size_t b = 0; b < models_.size(); ++b) {
    const TissueModel& model = models_[b];
    tissue_.positions[b] = rest_positions(model);
    bodies_.push_back(
        {.free_positions = Eigen::Matrix3Xd(3, kMaxPatchNodes),
         .trial = tissue_.positions[b],
         .rotations = {static_cast<std::size_t>(model.point_count()), Eigen::Quaterniond::Identity()},
         .nodal_force = Eigen::Matrix3Xd::Zero(3, model.node_count()),
         .internal_force = Eigen::VectorXd::Zero(model.dof_count()),
         .needle_force = Eigen::VectorXd::Zero(model.dof_count()),
         .load = Eigen::VectorXd::Zero(model.dof_count()),
         .contact_force = Eigen::VectorXd::Zero(model.dof_count()),
         .held_field = {},
         .loaded_nodes = {},
         .eliminated = Eigen::VectorXd::Zero(model.dof_count()),
         .eliminated_force = Eigen::VectorXd::Zero(model.dof_count()),
         .displacement = Eigen::VectorXd::Zero(model.dof_count()),
         .pass = Eigen::VectorXd::Zero(model.dof_count()),
         .nodes = {},
         .wanted = {},
         .held = {},
         .extent = (tissue_.positions[b].rowwise().maxCoeff() - tissue_.positions[b].rowwise().minCoeff()).norm()});
    if (!settings.lay_contacts) {
      bodies_.back().surface = std::make_shared<const SurfaceTopology>(surface_topology(model));
    }
    if (model.stiffens()) bodies_.back().stiffening.resize(model.point_count());
    if (model.relaxes()) {
      bodies_.back().memory.resize(model.memory_count());
      bodies_.back().relaxed.resize(model.memory_count());
    }
    take_free(model, bodies[b].load, bodies_.back().load);
    bodies_.back().contact_force = bodies_.back().load;
  }
  any_large_ = std::any_of(models_.begin(), models_.end(), [](const TissueModel& m) { return m.runs.size() > 1; });
  order_.resize(models_.size());
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::ranges::stable_sort(order_, std::greater(), [this](std::size_t b) { return models_[b].dof_count(); });
  std::size_t cavity_count = 0;
  for (std::size_t b = 0; b < models_.size(); ++b) {
    bodies_[b].first_cavity = cavity_count;
    for (std::vector<int>& tets : bodies[b].cavities) bodies_[b].cavities.emplace_back(models_[b], std::move(tets));
    cavity_count += bodies_[b].cavities.size();
  }
  if (cavity_count > kMaxCavities) {
    throw std::invalid_argument("simulation: " + std::to_string(cavity_count) + " cavities; at most " +
                                std::to_string(kMaxCavities) + " can be simulated");
  }
  for (std::size_t b = 0; b < models_.size(); ++b) {
    if (bodies[b].held_motion.empty()) continue;
    Eigen::Matrix3Xd held = Eigen::Matrix3Xd::Zero(3, models_[b].node_count());
    for (std::size_t i = 0; i < bodies[b].fixed_nodes.size(); ++i) {
      held.col(bodies[b].fixed_nodes[i]) = bodies[b].held_motion[i];
    }
    bodies_[b].held_field = field_of(b, held);
  }
  if (settings.contact.pairs.empty() && !settings.contact.probe) return;
  std::vector<const Factorisation*> at_rest;
  for (const FactorisedTissue::Body& body : worker_.latest().bodies) at_rest.push_back(&body.factor);
  contact_.emplace(models_, at_rest, settings.contact, &companion_);
  if (settings.contact.probe) grip_.emplace(*settings.contact.probe);
  follow_organs_ = settings.contact.at_haptic_rate && !settings.lay_contacts;
}

Eigen::Matrix3Xd SimulationLoop::field_of(std::size_t b, const Eigen::Matrix3Xd& held) {
  const TissueModel& model = models_[b];
  BodyState& body = bodies_[b];
  body.trial = tissue_.positions[b] + held;  // at the rotations of rest, forces are linear in it
  internal_forces(model, body.trial, body.rotations, body.nodal_force, {}, false);
  take_free(model, body.nodal_force, body.internal_force);
  worker_.latest().bodies[b].factor.solve(body.internal_force, body.displacement, sides_[0].workspace);
  Eigen::Matrix3Xd field = held;
  add_free(model, body.displacement, -(1 + model.damping_time_s / settings_.dt), field);
  body.internal_force.setZero();
  body.trial = tissue_.positions[b];
  return field;
}

template <typename Work>
void SimulationLoop::for_bodies(const Work& work) {
  const auto task = [&](int k, int side) {
    work(order_[static_cast<std::size_t>(k)], sides_[static_cast<std::size_t>(side)]);
  };
  if (any_large_) return companion_.run_tasks(body_count(), task);
  for (int k = 0; k < body_count(); ++k) task(k, 0);
}

SimulationReport SimulationLoop::step(const SimulationInput& input, TissuePatch& out) {
  SimulationReport report;
  report.step = ++tissue_.step;
  tissue_.time_s = input.time_s;
  for (BodyState& body : bodies_) body.report = {};

  const NeedleState* needle = accept(input.needle, report);
  respond_organs();
  move_held(input.held_amplitude, report);
  for_bodies([&](std::size_t b, Side& side) {
    correct_motion(b, true, side);
    fill_cavities(b, input.cavity_shares, side, report);
  });
  swap_factorisation(input, report);
  follow_probe(input.probe, report);
  touch(input.probe, report);
  out.flags = 0;
  if (needle != nullptr && settings_.lay_contacts) {
    out.flags = path_.update(*needle, {tissue_.positions.data(), models_.size()});
  }
  const bool asks = may_request(input, report);
  for_bodies([&](std::size_t b, Side& side) {
    free_motion(b, side);
    isolate(b, needle, side);
    stiffen(b, asks, side);
    if (asks) fill_request(b, needle, input.stale_turn, side);
    fill_patch(b, out);
  });
  if (asks) request_factorisation(report);
  sum_up(needle, report, out);
  couple_organs(needle, out);
  return report;
}

void SimulationLoop::settle(SimulationInput input, int steps) {
  input.needle = nullptr;
  input.take_factorisation = input.request_factorisation = false;
  TissuePatch unused = make_patch();
  for (int k = 0; k < steps; ++k) {
    step(input, unused);
    input.time_s += settings_.dt;
  }
  tissue_.step = 0;
}

const NeedleState* SimulationLoop::accept(const NeedleState* needle, SimulationReport& report) {
  const auto unload = [this] {
    for (BodyState& body : bodies_) {
      body.needle_force.setZero();
      body.loaded_nodes.clear();
    }
  };
  if (needle == nullptr || needle->node_count < 2) {
    unload();
    path_.clear();
    return nullptr;
  }
  if (!finite(*needle)) {
    report.flags |= kSimulationNonFinite;
    return nullptr;  // forces and contacts stay as they were
  }
  unload();
  for (int i = 0; i < needle->force_count; ++i) {
    const NodeForce& force = needle->forces[i];
    if (force.body < 0 || force.body >= body_count()) continue;
    const auto b = static_cast<std::size_t>(force.body);
    if (force.node < 0 || force.node >= models_[b].node_count()) continue;
    const int dof = 3 * models_[b].free_index[force.node];
    if (dof < 0) continue;  // a fixed node hands it to its support
    bodies_[b].needle_force.segment<3>(dof) += force.force;
    bodies_[b].loaded_nodes.push_back(force.node);
  }
  for (BodyState& body : bodies_) {
    std::vector<int>& nodes = body.loaded_nodes;
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  }
  tissue_.needle_step = needle->step;
  watch_speed(*needle);
  return needle;
}

void SimulationLoop::watch_speed(const NeedleState& needle) {
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  const double elapsed = needle.time_s - tip_time_s_;
  if (tip_step_ != 0 && needle.step == tip_step_) return;
  tip_speed_ = tip_step_ != 0 && elapsed > 0 ? std::min((tip - tip_).norm() / elapsed, settings_.fastest_tip) : 0;
  tip_ = tip;
  tip_time_s_ = needle.time_s;
  tip_step_ = needle.step;
}

double SimulationLoop::foresight(const NeedleState& needle) const {
  // From the needle consumed to the patch that it makes, as long as the last one took; and until the next.
  const std::uint64_t age = tissue_.step - std::min(needle.patch_epoch, tissue_.step);
  const double patches = 1 + static_cast<double>(std::clamp<std::uint64_t>(age, 1, 8));
  return patches * settings_.dt;
}

void SimulationLoop::solve_trailing(std::size_t b, Side& side) {
  const TissueModel& model = models_[b];
  BodyState& body = bodies_[b];
  const FactorisedTissue::Body& factorised = worker_.latest().bodies[b];
  // p_free = p - A_f^-1 (F_int - H^T lambda) - A_f^-1 H^T lambda   (eq. 7). The last term is W_bar H^T lambda, but
  // for forces on nodes that are isolated no more: those join the second.
  body.displacement.setZero();
  bool all_known = true;
  for (const int node : body.loaded_nodes) {
    if (factorised.isolated.known(node)) continue;
    const int dof = 3 * model.free_index[node];
    body.displacement.segment<3>(dof) = body.needle_force.segment<3>(dof);
    all_known = false;
  }
  body.pass = body.eliminated;
  if (!all_known) {
    Eigen::VectorXd forgotten(body.pass.size());
    factorised.factor.eliminate(body.displacement, forgotten, side.workspace);
    body.pass += forgotten;
  }
  body.on_trailing = factorised.factor.substitute_back_trailing(body.pass);
  body.unloading = motion_under_needle(b);
  body.unloaded_on_trailing = std::all_of(body.loaded_nodes.begin(), body.loaded_nodes.end(),
                                          [&](int node) { return factorised.isolated.trailing(node); });
  body.trailing_solved = true;
}

void SimulationLoop::free_positions(std::size_t b, std::span<const int> nodes, Eigen::Ref<Eigen::Matrix3Xd> free,
                                    Side& side) {
  BodyState& body = bodies_[b];
  if (nodes.empty()) return;
  const FactorisedTissue::Body& factorised = worker_.latest().bodies[b];
  const IsolatedDofs& isolated = factorised.isolated;
  if (!body.trailing_solved) solve_trailing(b, side);
  isolated.solution_at(nodes, body.pass, body.on_trailing, free);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    auto x = free.col(static_cast<Eigen::Index>(i));
    x = tissue_.positions[b].col(nodes[i]) - x;
    if (isolated.known(nodes[i])) x -= body.unloading.segment<3>(3 * isolated.place(nodes[i]));
  }
}

std::vector<OrganResponseBody> SimulationLoop::organ_bodies(const TissuePatch* patch) const {
  std::vector<OrganResponseBody> all;
  for (std::size_t b = 0; b < models_.size(); ++b) {
    std::span<const int> nodes;
    if (patch != nullptr) {
      nodes = {patch->bodies[b].node_ids.data(), static_cast<std::size_t>(patch->bodies[b].node_count)};
    }
    all.push_back({models_[b], worker_.latest().bodies[b].isolated, nodes});
  }
  return all;
}

// The contacts answer to the needle's forces as they did in the haptic loop (eq. 31b), so that the bodies go where it
// showed them.
void SimulationLoop::respond_organs() {
  if (organs_.count() == 0) return;
  std::vector<const Eigen::VectorXd*> forces;
  std::vector<const std::vector<int>*> loaded;
  for (const BodyState& body : bodies_) {
    forces.push_back(&body.needle_force);
    loaded.push_back(&body.loaded_nodes);
  }
  if (!organs_.respond(organ_bodies(nullptr), forces, loaded)) return;
  contact_->take(organs_.rows(), organs_.lambda());
  for (std::size_t b = 0; b < models_.size(); ++b) {
    bodies_[b].contact_force = bodies_[b].load;
    contact_->add_forces(static_cast<int>(b), bodies_[b].contact_force);
  }
}

void SimulationLoop::couple_organs(const NeedleState* needle, TissuePatch& out) {
  organs_.clear();
  out.organs.count = 0;
  if (!follow_organs_ || needle == nullptr) return;
  const std::vector<OrganResponseBody> bodies = organ_bodies(&out);
  organs_.choose(contact_->rows(), bodies, any_large_ ? &companion_ : nullptr);
  if (organs_.count() == 0) return;
  std::vector<Eigen::Matrix3Xd> moved(models_.size());
  for (std::size_t b = 0; b < models_.size(); ++b) {
    const std::span<const int> nodes = organs_.nodes(static_cast<int>(b));
    moved[b].resize(3, static_cast<Eigen::Index>(nodes.size()));
    free_positions(b, nodes, moved[b], sides_[0]);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      moved[b].col(static_cast<Eigen::Index>(i)) -= tissue_.positions[b].col(nodes[i]);
    }
  }
  organs_.open(contact_->rows(), moved);
  organs_.fill(contact_->rows(), out.organs);
}

void SimulationLoop::follow_probe(const RigidPose* probe, SimulationReport& report) {
  const std::optional<RigidPose> before = probe_;
  probe_.reset();
  if (!settings_.contact.probe || probe == nullptr || !finite(*probe)) return;
  probe_ = *probe;
  if (!before) return;
  const ProbeShape& shape = settings_.contact.probe->shape;
  const double moved = (probe->position - before->position).norm() +
                       probe->orientation.angularDistance(before->orientation) * shape.reach(0);
  const int parts = static_cast<int>(std::min(std::ceil(moved / kProbeStride), double{kMaxProbeParts}));
  for (int i = 1; i < parts; ++i) {
    const double share = static_cast<double>(i) / parts;
    const RigidPose between{before->position + share * (probe->position - before->position),
                            before->orientation.slerp(share, probe->orientation)};
    touch(&between, report);
    if (report.probe.points == 0) continue;
    for (int correction = 0; correction < kMaxCorrections; ++correction) {
      for_bodies([&](std::size_t b, Side& side) {
        free_motion(b, side);
        correct_motion(b, false, side);
      });
      if (std::none_of(bodies_.begin(), bodies_.end(), [](const BodyState& body) { return body.limited; })) break;
    }
  }
}

void SimulationLoop::touch(const RigidPose* probe, SimulationReport& report) {
  if (!contact_) return;
  if (probe != nullptr && !finite(*probe)) {
    report.flags |= kSimulationNonFinite;
    probe = nullptr;
  }
  std::optional<RigidPose> head;
  if (grip_ && probe != nullptr) head = grip_->head(*probe);
  contact_->update(head ? &*head : nullptr, sides_[0].workspace);
  for (std::size_t b = 0; b < models_.size(); ++b) {
    bodies_[b].contact_force = bodies_[b].load;
    contact_->add_forces(static_cast<int>(b), bodies_[b].contact_force);
  }
  report.organs = contact_->report();
  report.probe = contact_->probe();
  if (head) grip_->feel(*head, report.probe);
  if (grip_ && !head) grip_->release();
}

void SimulationLoop::swap_factorisation(const SimulationInput& input, SimulationReport& report) {
  if (!input.take_factorisation || !worker_.update()) return;
  report.factorisation_taken = true;
  factorisation_outstanding_ = false;
}

void SimulationLoop::free_motion(std::size_t b, Side& side) {
  BodyState& body = bodies_[b];
  body.displacement = body.internal_force - body.needle_force - body.contact_force;
  body.report.residual_n = body.displacement.stableNorm();
  body.report.force_n = body.needle_force.stableNorm();

  // A_f^-1 (F_int - contact - H^T lambda) goes to zero, so the precision of its solve does not move the fixed
  // point. Half of the solve is left to respond(), when the forces of this step are known: L is read once here,
  // once there.
  worker_.latest().bodies[b].factor.eliminate(body.displacement, body.eliminated, side.workspace);
  body.trailing_solved = false;
  body.eliminated_force = body.needle_force + body.contact_force;
  if (!body.eliminated.allFinite()) {
    body.report.flags |= kSimulationNonFinite;
    body.eliminated.setZero();
  }
}

void SimulationLoop::stiffen(std::size_t b, bool whole, Side& side) {
  BodyState& body = bodies_[b];
  if (body.stiffening.empty()) return;
  const Eigen::Matrix3Xd& positions = tissue_.positions[b];
  if (whole) {
    find_stiffening(models_[b], positions, body.rotations, body.rest_size, body.stiffening, side.elements.companion);
    return;
  }
  for (const std::vector<int>* nodes : {&body.nodes, &body.held}) {
    find_stiffening_around(*nodes, models_[b], positions, body.rotations, body.rest_size, body.stiffening);
  }
}

void SimulationLoop::isolate(std::size_t b, const NeedleState* needle, Side& side) {
  BodyState& body = bodies_[b];
  if (settings_.lay_contacts) {
    body.nodes = path_.isolated_nodes(static_cast<int>(b));
  } else if (needle != nullptr) {
    choose_nodes(b, *needle);
  }
  FactorisedTissue::Body& factorised = worker_.latest().bodies[b];
  body.report.new_isolated_nodes =
      factorised.isolated.isolate(body.nodes, models_[b], factorised.factor, side.workspace);
  free_positions(b, body.nodes, body.free_positions.leftCols(static_cast<Eigen::Index>(body.nodes.size())), side);
}

void SimulationLoop::choose_nodes(std::size_t b, const NeedleState& needle) {
  BodyState& body = bodies_[b];
  const double ahead = foresight(needle);
  const double wanted = settings_.patch_range + tip_speed_ * ahead + dent(models_[b], needle, static_cast<int>(b));
  const double range = std::min(wanted, settings_.look_ahead);
  const double reach = settings_.patch_range + settings_.fastest_tip * (ahead + settings_.longest_stall);
  body.wanted = corridor_nodes(models_[b], tissue_.positions[b], needle, static_cast<int>(b), range, kMaxPatchNodes);
  if (body.wanted.size() == kMaxPatchNodes) body.report.patch_flags |= kPatchNodeOverflow;
  std::sort(body.wanted.begin(), body.wanted.end());
  // Beyond, a patch has what costs nothing: the compliance of nodes that the factor has last, of others their place.
  body.nodes = body.wanted;
  body.held.clear();
  const IsolatedDofs& isolated = worker_.latest().bodies[b].isolated;
  for (const int node :
       corridor_nodes(models_[b], tissue_.positions[b], needle, static_cast<int>(b), reach, kMaxPatchNodes)) {
    if (body.nodes.size() + body.held.size() == kMaxPatchNodes) break;
    if (std::binary_search(body.wanted.begin(), body.wanted.end(), node)) continue;
    (isolated.known(node) ? body.nodes : body.held).push_back(node);
  }
  std::sort(body.nodes.begin(), body.nodes.end());
  std::sort(body.held.begin(), body.held.end());
}

void SimulationLoop::name_nodes(std::size_t b, const NeedleState* needle, FactorisationRequest::Body& request) const {
  request.isolated_nodes = settings_.lay_contacts ? bodies_[b].nodes : bodies_[b].wanted;
  request.foreseen_nodes.clear();
  request.beside_nodes.clear();
  request.contact_nodes.clear();
  request.pressed_nodes = 0;
  if (needle == nullptr) return;
  const auto body = static_cast<int>(b);
  if (follow_organs_) request.pressed_nodes = contact_->nodes(body, request.contact_nodes);
  request.foreseen_nodes =
      settings_.lay_contacts
          ? path_.nodes_ahead(body, *needle, tissue_.positions[b], settings_.look_ahead)
          : corridor_nodes(models_[b], tissue_.positions[b], *needle, body, settings_.look_ahead, kMaxPatchNodes);
  // Of a small body a node that the factor has not is cheap, and more trailing ones are not.
  if (!settings_.lay_contacts && models_[b].dof_count() >= settings_.contact.large_dofs)
    request.beside_nodes = nodes_around(models_[b], request.foreseen_nodes, kMaxPatchNodes);
}

bool SimulationLoop::may_request(const SimulationInput& input, SimulationReport& report) {
  if (!input.request_factorisation) return false;
  if (!factorisation_outstanding_) return true;
  // Idle without a result that could be taken: the worker met a matrix that is not positive definite.
  if (!worker_.idle() || worker_.failures() == failures_seen_) return false;
  failures_seen_ = worker_.failures();
  factorisation_outstanding_ = false;
  report.flags |= kSimulationFactorisationFailed;
  return true;
}

void SimulationLoop::fill_request(std::size_t b, const NeedleState* needle, double stale_turn, Side& side) {
  const TissueModel& model = models_[b];
  BodyState& body = bodies_[b];
  FactorisationRequest::Body& request = worker_.request().bodies[b];
  request.squeezed.clear();
  if (body.squeezed > 0) find_squeezed(model, tissue_.positions[b], body.rest_size, request.squeezed);
  if (model.is_quadratic()) find_cofactors(model, tissue_.positions[b], request.cofactors, side.elements.companion);
  request.stiffening = body.stiffening;
  for (std::size_t t = 0; t < request.membrane.size(); ++t) {
    request.membrane[t] = membrane_gradient(model.membrane[t], tissue_.positions[b]);
  }
  name_nodes(b, needle, request);
  const FactorisedTissue::Body& in_use = worker_.latest().bodies[b];
  body.report.factor_is_stale = !(stale_turn > 0) || !covers(in_use.trailing_nodes, request, model) ||
                                !nearly_of(in_use, body.rotations, request, stale_turn);
}

void SimulationLoop::request_factorisation(SimulationReport& report) {
  const auto stale = [](const BodyState& body) { return body.report.factor_is_stale; };
  if (std::ranges::none_of(bodies_, stale)) return;
  FactorisationRequest& request = worker_.request();
  request.epoch = tissue_.step;
  for (std::size_t b = 0; b < models_.size(); ++b) request.bodies[b].rotations = bodies_[b].rotations;
  worker_.submit();
  factorisation_outstanding_ = true;
  report.factorisation_requested = true;
}

TissuePatch SimulationLoop::make_patch() const {
  TissuePatch patch;
  patch.body_count = body_count();
  for (std::size_t b = 0; b < models_.size(); ++b) {
    patch.bodies[b].w_bar_values.assign(kMaxWBarValues, 0.0);
    patch.bodies[b].contact_values.assign(kMaxContactValues, 0.0);
    if (bodies_[b].surface == nullptr) continue;
    SurfacePatch& surface = patch.bodies[b].surface;
    surface.topology = bodies_[b].surface;
    surface.positions = bodies_[b].surface->rest_positions;
    surface.boxes.resize(bodies_[b].surface->tree.size());
    refit(surface);
  }
  if (contact_) patch.organs.reserve(body_count());
  return patch;
}

void SimulationLoop::fill_patch(std::size_t b, TissuePatch& out) {
  BodyState& body = bodies_[b];
  fill_body_patch({.model = models_[b],
                   .nodes = body.nodes,
                   .held = body.held,
                   .positions = tissue_.positions[b],
                   .free_positions = body.free_positions,
                   .contacts = path_.contacts(static_cast<int>(b)),
                   .stiffening = body.stiffening},
                  out.bodies[b], body.report.patch_flags);
  fill_w_bar(worker_.latest().bodies[b].isolated, out.bodies[b]);
  out.bodies[b].condense();
}

void SimulationLoop::sum_up(const NeedleState* needle, SimulationReport& report, TissuePatch& out) const {
  for (const BodyState& body : bodies_) {
    report.flags |= body.report.flags;
    report.inverted_tets += body.report.inverted_tets;
    report.isolated_nodes += static_cast<int>(body.nodes.size());
    report.new_isolated_nodes += body.report.new_isolated_nodes;
    report.residual_n = std::hypot(report.residual_n, body.report.residual_n);
    report.force_n = std::hypot(report.force_n, body.report.force_n);
    report.cavity_count += static_cast<int>(body.cavities.size());
    out.flags |= body.report.patch_flags;
  }
  report.contact_count = settings_.lay_contacts ? path_.contact_count()
                         : needle != nullptr    ? needle->contact_count
                                                : 0;
  report.factor_epoch = out.factor_epoch = worker_.latest().epoch;
  report.needle_step = out.needle_step = tissue_.needle_step;
  out.step = out.epoch = tissue_.step;  // one patch a step
  out.time_s = tissue_.time_s;
  out.body_count = body_count();
}

}  // namespace stylet::physics
