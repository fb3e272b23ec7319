// Where the bodies of a simulation step go: what answers to the forces on them, and how much of that is taken.
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/inversion.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {
namespace {

constexpr int kMaxShortenings = 4;  // of a motion correction
constexpr double kOvershoot = 0.9;  // slope after a step over that before it; at 1 quasi-Newton steps stop converging
constexpr double kSqueezedOvershoot = 0.1;  // the same where the factor is older than a barrier (eq. 40)
constexpr double kNegligible = 1e-9;        // of the body: the slopes of smaller steps are rounding

}  // namespace

void SimulationLoop::move_held(double amplitude, SimulationReport& report) {
  if (!std::isfinite(amplitude)) {
    report.flags |= kSimulationNonFinite;
    return;
  }
  const double change = amplitude - held_amplitude_;
  if (change == 0) return;
  held_amplitude_ = amplitude;
  for (std::size_t b = 0; b < models_.size(); ++b) {
    BodyState& body = bodies_[b];
    if (body.held_field.size() == 0) continue;
    // The inner nodes go along as they would at rest: what is left to correct is of second order, and the elements at
    // the support are not squeezed for a step. The fixed point knows the held nodes alone.
    tissue_.positions[b] += change * body.held_field;
    for (int n = 0; n < models_[b].node_count(); ++n) {
      if (models_[b].free_index[n] >= 0) continue;
      const Eigen::Vector3d held = models_[b].mesh.nodes[n] + amplitude * body.held_field.col(n);
      tissue_.positions[b].col(n) = held;  // not a sum of steps: nothing drifts
    }
    for (std::size_t i = 0; i < body.nodes.size(); ++i) {
      const int node = body.nodes[i];
      auto free = body.free_positions.col(static_cast<Eigen::Index>(i));
      const bool fixed = models_[b].free_index[node] < 0;
      free = fixed ? Eigen::Vector3d(tissue_.positions[b].col(node))
                   : Eigen::Vector3d(free + change * body.held_field.col(node));
    }
  }
}

void SimulationLoop::correct_motion(std::size_t b, bool shown, Side& side) {
  const TissueModel& model = models_[b];
  BodyState& body = bodies_[b];
  Eigen::Matrix3Xd& positions = tissue_.positions[b];

  body.limited = false;
  respond(b, shown, side);  // with the factor that made p_free
  if (!body.trial.allFinite()) {
    body.report.flags |= kSimulationNonFinite;
    body.trial = positions;
  }

  // The fixed point does not depend on the length of the step, so a step may be shortened: one longer than the body
  // (a mad force), and one that would turn tetrahedra inside out.
  StepTried step = step_tried(model, body, positions);
  const auto shorten = [&](double fraction) {
    body.report.flags |= kSimulationStepLimited;
    body.trial = positions + fraction * (body.trial - positions);
    step.longest *= fraction;
    step.slope *= fraction;
  };
  if (step.longest > body.extent) {
    shorten(body.extent / step.longest);
    step = step_tried(model, body, positions);  // the slope of a mad step may be no number
  }
  int inverted = 0;
  Relaxing relaxing;
  if (shown) relaxing = {.dt = settings_.dt, .after = body.relaxed};
  for (int shortened = 0;; ++shortened) {
    const ElementCount count = update_rotations_and_forces(model, body.trial, body.rotations, body.nodal_force,
                                                           body.rest_size, body.memory, side.elements, relaxing);
    inverted = count.inverted;
    body.squeezed = count.squeezed;
    take_free(model, body.nodal_force, body.internal_force);
    if (shortened == kMaxShortenings) break;
    const bool flat = shortened == 0 && (inverted > 0 || body.squeezed > 0);
    double fraction = flat ? uninverted_fraction(model, positions, body.trial, side.elements.companion) : 1;
    if (fraction < 1) {
      // Where the first tetrahedron would lose nearly all of its volume; what is left is for the next steps.
      body.limited = true;
    } else if (step.longest > kNegligible * body.extent) {
      fraction = overshoot(step, step_tried(model, body, positions), body.squeezed > 0);
    }
    if (fraction == 1) break;
    shorten(fraction);
  }
  positions.swap(body.trial);
  if (contact_) contact_->follow(static_cast<int>(b), positions, side.elements.companion);
  if (shown) body.memory.swap(body.relaxed);
  body.report.inverted_tets = inverted;
  if (inverted > 0) body.report.flags |= kSimulationInverted;
}

void SimulationLoop::respond(std::size_t b, bool shown, Side& side) {
  const TissueModel& model = models_[b];
  BodyState& body = bodies_[b];
  const FactorisedTissue::Body& factorised = worker_.latest().bodies[b];
  const IsolatedDofs& isolated = factorised.isolated;
  // Where the haptic loop showed the isolated nodes: in double, with the very numbers of W_bar.
  const auto known = [&](int node) { return isolated.known(node); };
  const bool as_shown = shown && std::all_of(body.loaded_nodes.begin(), body.loaded_nodes.end(), known);
  Eigen::VectorXd moved;
  if (as_shown) {
    moved = motion_under_needle(b);
    organs_.add_motion(static_cast<int>(b), moved);
  }
  if (as_shown && acts_on_trailing(b)) {
    // Forces on S alone change x_S by W_SS of them, and what was eliminated before S by nothing.
    const Eigen::Index size = body.on_trailing.size();
    factorised.factor.substitute_back(body.pass, body.on_trailing + body.unloading.head(size) - moved.head(size),
                                      body.displacement, side.workspace);
  } else {
    // What the forces have changed since the first half. Most act on trailing nodes, so it costs next to nothing.
    body.displacement = body.needle_force + body.contact_force - body.eliminated_force;
    factorised.factor.eliminate(body.displacement, body.pass, side.workspace);
    body.pass = body.eliminated - body.pass;
    factorised.factor.substitute_back(body.pass, body.displacement, side.workspace);
  }
  body.trial = tissue_.positions[b];
  add_free(model, body.displacement, -1, body.trial);
  if (!as_shown) return;
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    const int node = body.nodes[i];
    if (known(node))
      body.trial.col(node) =
          body.free_positions.col(static_cast<Eigen::Index>(i)) + moved.segment<3>(3 * isolated.place(node));
  }
}

bool SimulationLoop::acts_on_trailing(std::size_t b) const {
  const BodyState& body = bodies_[b];
  const FactorisedTissue::Body& factorised = worker_.latest().bodies[b];
  const auto trailing = [&](int node) { return factorised.isolated.trailing(node); };
  const std::span<const int> of_organs = organs_.nodes(static_cast<int>(b));
  return body.trailing_solved && body.unloaded_on_trailing &&
         std::all_of(factorised.trailing_nodes.begin(), factorised.trailing_nodes.end(), trailing) &&
         std::all_of(body.loaded_nodes.begin(), body.loaded_nodes.end(), trailing) &&
         std::all_of(of_organs.begin(), of_organs.end(), trailing);
}

Eigen::VectorXd SimulationLoop::motion_under_needle(std::size_t b) const {
  const IsolatedDofs& isolated = worker_.latest().bodies[b].isolated;
  std::vector<IsolatedDofs::Push> pushes;
  for (const int node : bodies_[b].loaded_nodes) {
    if (!isolated.known(node)) continue;
    pushes.push_back({0, node, bodies_[b].needle_force.segment<3>(3 * models_[b].free_index[node])});
  }
  Eigen::VectorXd motion(3 * isolated.known_nodes());
  isolated.find_motions(pushes, motion);
  return motion;
}

void SimulationLoop::gather_internal_force(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                                           BodyState& body, Side& side) {
  body.squeezed =
      internal_forces(model, positions, body.rotations, body.nodal_force, body.rest_size, body.memory, side.elements);
  take_free(model, body.nodal_force, body.internal_force);
}

SimulationLoop::StepTried SimulationLoop::step_tried(const TissueModel& model, const BodyState& body,
                                                     const Eigen::Matrix3Xd& from) {
  StepTried tried;
  Eigen::Array3d longest = Eigen::Array3d::Zero();
  Eigen::Array3d slope = Eigen::Array3d::Zero();
  for (int n = 0; n < model.node_count(); ++n) {
    const int i = model.free_index[n];
    if (i < 0) continue;
    const Eigen::Array3d step = body.trial.col(n) - from.col(n);
    longest = longest.max(step.abs());
    slope += step * (body.internal_force.segment<3>(3 * i) - body.needle_force.segment<3>(3 * i) -
                     body.contact_force.segment<3>(3 * i))
                        .array();
  }
  tried.longest = longest.maxCoeff();
  tried.slope = slope.sum();
  return tried;
}

double SimulationLoop::overshoot(const StepTried& before, const StepTried& after, bool squeezed) {
  const double bound = squeezed ? kSqueezedOvershoot : kOvershoot;
  if (before.slope >= 0 || after.slope <= -bound * before.slope) return 1;
  return before.slope / (before.slope - after.slope);  // the minimum of a parabola with these slopes
}

void SimulationLoop::fill_cavities(std::size_t b, std::span<const double> shares, Side& side,
                                   SimulationReport& report) {
  BodyState& body = bodies_[b];
  bool changed = false;
  std::size_t index = body.first_cavity;
  for (Cavity& cavity : body.cavities) {
    CavityState& state = report.cavities[index];
    state = cavity.state(models_[b], tissue_.positions[b], body.rotations, body.memory);
    const double share = index < shares.size() ? shares[index] : 1;
    ++index;
    if (!std::isfinite(share)) {
      body.report.flags |= kSimulationNonFinite;
    } else if (cavity.fill(share, state.volume)) {
      changed = true;
      body.rest_size.resize(models_[b].tets.size(), 1.0);
      for (const int t : cavity.tets()) body.rest_size[t] = cavity.size();
    }
  }
  if (changed) gather_internal_force(models_[b], tissue_.positions[b], body, side);
}

}  // namespace stylet::physics
