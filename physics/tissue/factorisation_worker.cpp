#include "physics/tissue/factorisation_worker.h"

#include "physics/messages/messages.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace stylet::physics {
namespace {

constexpr double kHardlyHeld = 1e-13;  // below: rigid motion of the body is not prevented
constexpr int kWorthAHelper = 15000;   // DOFs of a body: below, L is too small for two threads
constexpr double kStiffer = 0.05;      // share by which a factor may be off what strain has made of the stiffness

double damping_scale(const TissueModel& model, double dt) {
  return 1 + model.damping_time_s / dt;
}

bool is_large(const TissueModel& model) {
  return model.dof_count() >= kWorthAHelper;
}

std::vector<StiffnessPattern> patterns_of(std::span<const TissueModel> models) {
  std::vector<StiffnessPattern> patterns;
  patterns.reserve(models.size());
  for (const TissueModel& model : models) patterns.emplace_back(model);
  return patterns;
}

FactorisationRequest sized_request(std::span<const TissueModel> models) {
  FactorisationRequest request;
  for (const TissueModel& model : models) {
    FactorisationRequest::Body body;
    body.rotations.assign(model.point_count(), Eigen::Quaterniond::Identity());
    if (model.is_quadratic()) body.cofactors.assign(model.point_count(), Eigen::Matrix3d::Identity());
    if (model.stiffens()) body.stiffening.resize(model.point_count());
    for (const MembraneTriangle& triangle : model.membrane) body.membrane.push_back(triangle.frame);
    request.bodies.push_back(std::move(body));
  }
  return request;
}

SolveWorkspace& with(Companion& helper, SolveWorkspace& workspace) {
  workspace.companion = &helper;
  return workspace;
}

FactorisedTissue factorised_at_rest(std::span<const TissueModel> models, std::span<const StiffnessPattern> patterns,
                                    double dt, PassPrecision coarsest, SolveWorkspace& workspace) {
  FactorisedTissue result;
  result.bodies.reserve(models.size());
  for (std::size_t b = 0; b < models.size(); ++b) {
    const std::vector<Eigen::Quaterniond> rest(models[b].point_count(), Eigen::Quaterniond::Identity());
    Factorisation factor(patterns[b], workspace);
    factor.limit_precision(coarsest);
    std::vector<double> values(patterns[b].nonzeros());
    patterns[b].assemble(models[b], rest, damping_scale(models[b], dt), values);
    if (!factor.factorise(patterns[b], values, workspace) || factor.reciprocal_condition(workspace) < kHardlyHeld) {
      throw std::invalid_argument("tissue: body " + std::to_string(b) +
                                  " can move freely; fix more of its nodes, at least three that are not on one line");
    }
    FactorisationRequest at_rest = sized_request(models.subspan(b, 1));
    result.bodies.push_back({.factor = std::move(factor),
                             .trailing_nodes = {},
                             .isolated = IsolatedDofs(models[b].node_count(), kMaxPatchNodes + kMaxContactNodes),
                             .rotations = rest,
                             .squeezed = {},
                             .cofactors = std::move(at_rest.bodies[0].cofactors),
                             .stiffening = std::move(at_rest.bodies[0].stiffening),
                             .membrane = std::move(at_rest.bodies[0].membrane)});
  }
  return result;
}

/// The free ones of some nodes, without doubles.
class Corridor {
public:
  explicit Corridor(const TissueModel& model) : model_(model), taken_(model.mesh.nodes.size(), 0) {}

  /// Those of `more` that fit.
  void take(std::span<const int> more, std::size_t most) {
    for (const int node : more) {
      if (model_.free_index[node] < 0 || taken_[node] != 0 || nodes_.size() >= most) continue;
      taken_[node] = 1;
      nodes_.push_back(node);
    }
  }
  /// Isolated, the first `foreseen` of the foreseen nodes, the first `touched` of those in contact.
  /// @param beside  the nodes around them, too
  std::vector<int> of(const FactorisationRequest::Body& request, std::size_t foreseen, std::size_t touched,
                      bool beside) && {
    take(request.isolated_nodes, kMaxPatchNodes);
    take(std::span(request.foreseen_nodes).first(foreseen), kMaxPatchNodes);
    if (beside) take(request.beside_nodes, kMaxPatchNodes);
    take(std::span(request.contact_nodes).first(touched), nodes_.size() + kMaxContactNodes);
    return std::move(nodes_);
  }

private:
  const TissueModel& model_;
  std::vector<char> taken_;
  std::vector<int> nodes_;
};

std::vector<int> dofs_of(std::span<const int> nodes, const TissueModel& model) {
  std::vector<int> dofs;
  dofs.reserve(3 * nodes.size());
  for (const int node : nodes) {
    const int free = model.free_index[node];
    for (int c = 0; c < 3; ++c) dofs.push_back(3 * free + c);
  }
  return dofs;
}

}  // namespace

bool covers(std::span<const int> trailing_nodes, const FactorisationRequest::Body& request,
            const TissueModel& model) {
  std::vector<char> covered(model.mesh.nodes.size(), 0);
  for (const int node : trailing_nodes) covered[node] = 1;
  const std::vector<int> wanted =
      Corridor(model).of(request, request.foreseen_nodes.size() / 2,
                         std::min<std::size_t>(request.pressed_nodes, request.contact_nodes.size()), false);
  return std::all_of(wanted.begin(), wanted.end(), [&](int node) { return covered[node] != 0; });
}

bool nearly_of(const FactorisedTissue::Body& factor, std::span<const Eigen::Quaterniond> rotations,
               const FactorisationRequest::Body& now, double turn) {
  const double least = std::cos(0.5 * turn);
  for (std::size_t t = 0; t < rotations.size(); ++t) {
    if (std::abs(rotations[t].dot(factor.rotations[t])) < least) return false;
  }
  const auto off = [](const auto& here, const auto& then) { return (here - then).norm() / then.norm(); };
  for (std::size_t p = 0; p < now.cofactors.size(); ++p) {
    if (off(now.cofactors[p], factor.cofactors[p]) > turn) return false;
  }
  for (std::size_t p = 0; p < now.stiffening.size(); ++p) {
    const PointStiffness& here = now.stiffening[p];
    const PointStiffness& then = factor.stiffening[p];
    // What goes along the strain is a root: its square counts.
    if (std::abs(here.ratio - then.ratio) > kStiffer * then.ratio ||
        (here.along - then.along).norm() * (here.along.norm() + then.along.norm()) > kStiffer * then.ratio) {
      return false;
    }
  }
  for (std::size_t t = 0; t < now.membrane.size(); ++t) {
    if (off(now.membrane[t], factor.membrane[t]) > 0.5 * kStiffer) return false;
  }
  // Of V psi'' (dJ/dp)(dJ/dp)^T its root: it changes by the angle where it turns, as the rest of the matrix does.
  const auto root = [](const SqueezedTet& tet) -> Eigen::Matrix3d { return std::sqrt(tet.curvature) * tet.cofactor; };
  return std::equal(now.squeezed.begin(), now.squeezed.end(), factor.squeezed.begin(), factor.squeezed.end(),
                    [&](const SqueezedTet& here, const SqueezedTet& then) {
                      return here.tet == then.tet && (root(here) - root(then)).norm() <= turn * root(then).norm();
                    });
}

FactorisationWorker::FactorisationWorker(std::span<const TissueModel> models, double dt, PassPrecision coarsest,
                                         bool two_threads)
    : models_(models),
      dt_(dt),
      helper_(two_threads && std::any_of(models.begin(), models.end(), is_large), true),
      patterns_(patterns_of(models)),
      requests_(sized_request(models)),
      results_(factorised_at_rest(models, patterns_, dt, coarsest, with(helper_, workspace_))) {
  for (const StiffnessPattern& pattern : patterns_) values_.emplace_back(pattern.nonzeros());
  corridors_.resize(models.size());
}

void FactorisationWorker::submit() {
  requested_.fetch_add(1, std::memory_order_release);
  requests_.publish();
}

bool FactorisationWorker::step() {
  if (!requests_.update()) return false;
  const FactorisationRequest& request = requests_.front();
  FactorisedTissue& result = results_.back();
  bool factorised = true;
  for (std::size_t b = 0; factorised && b < models_.size(); ++b) {
    const FactorisationRequest::Body& wanted = request.bodies[b];
    FactorisedTissue::Body& body = result.bodies[b];
    if (!covers(corridors_[b], wanted, models_[b])) {
      corridors_[b] =
          Corridor(models_[b]).of(wanted, wanted.foreseen_nodes.size(), wanted.contact_nodes.size(), true);
    }
    if (body.trailing_nodes != corridors_[b]) {  // each slot has a factor of its own
      factorised = body.factor.order_last(dofs_of(corridors_[b], models_[b]), patterns_[b], workspace_);
      if (!factorised) break;
      body.trailing_nodes = corridors_[b];
    }
    patterns_[b].assemble(models_[b], wanted.rotations, damping_scale(models_[b], dt_), values_[b], wanted.squeezed,
                          wanted.cofactors, wanted.stiffening, wanted.membrane);
    factorised = body.factor.factorise(patterns_[b], values_[b], workspace_);
    if (!factorised) break;
    body.isolated.reset(body.trailing_nodes, models_[b], body.factor);
    body.rotations = wanted.rotations;
    body.squeezed = wanted.squeezed;
    body.cofactors = wanted.cofactors;
    body.stiffening = wanted.stiffening;
    body.membrane = wanted.membrane;
  }
  if (factorised) {
    result.epoch = request.epoch;
    results_.publish();
  } else {
    failures_.fetch_add(1, std::memory_order_release);
  }
  finished_.fetch_add(1, std::memory_order_release);  // last: who sees it idle also sees the result
  return true;
}

}  // namespace stylet::physics
