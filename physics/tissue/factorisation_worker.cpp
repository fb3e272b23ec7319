#include "physics/tissue/factorisation_worker.h"

#include "physics/loops/messages.h"

#include <stdexcept>
#include <string>
#include <utility>

namespace stylet::physics {
namespace {

constexpr double kHardlyHeld = 1e-13;  // below: rigid motion of the body is not prevented

double damping_scale(const TissueModel& model, double dt) {
  return 1 + model.damping_time_s / dt;
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
    body.rotations.assign(static_cast<std::size_t>(model.tet_count()), Eigen::Quaterniond::Identity());
    request.bodies.push_back(std::move(body));
  }
  return request;
}

FactorisedTissue factorised_at_rest(std::span<const TissueModel> models, std::span<const StiffnessPattern> patterns,
                                    double dt, SolveWorkspace& workspace) {
  FactorisedTissue result;
  result.bodies.reserve(models.size());
  for (std::size_t b = 0; b < models.size(); ++b) {
    const std::vector<Eigen::Quaterniond> rest(models[b].tets.size(), Eigen::Quaterniond::Identity());
    Factorisation factor(patterns[b], workspace);
    std::vector<double> values(patterns[b].nonzeros());
    patterns[b].assemble(models[b], rest, damping_scale(models[b], dt), values);
    if (!factor.factorise(patterns[b], values, workspace) || factor.reciprocal_condition(workspace) < kHardlyHeld) {
      throw std::invalid_argument("tissue: body " + std::to_string(b) +
                                  " can move freely; fix more of its nodes, at least three that are not on one line");
    }
    result.bodies.push_back({std::move(factor), IsolatedDofs(models[b].node_count(), kMaxPatchNodes), rest});
  }
  return result;
}

}  // namespace

FactorisationWorker::FactorisationWorker(std::span<const TissueModel> models, double dt)
    : models_(models),
      dt_(dt),
      patterns_(patterns_of(models)),
      requests_(sized_request(models)),
      results_(factorised_at_rest(models, patterns_, dt, workspace_)) {
  for (const StiffnessPattern& pattern : patterns_) values_.emplace_back(pattern.nonzeros());
}

void FactorisationWorker::submit() {
  requested_.fetch_add(1, std::memory_order_release);
  requests_.publish();
}

bool FactorisationWorker::step() {
  if (!requests_.update()) return false;
  const FactorisationRequest& request = requests_.front();
  FactorisedTissue& result = results_.back();
  bool positive_definite = true;
  for (std::size_t b = 0; b < models_.size(); ++b) {
    const FactorisationRequest::Body& wanted = request.bodies[b];
    FactorisedTissue::Body& body = result.bodies[b];
    patterns_[b].assemble(models_[b], wanted.rotations, damping_scale(models_[b], dt_), values_[b]);
    positive_definite = positive_definite && body.factor.factorise(patterns_[b], values_[b], workspace_);
    if (!positive_definite) break;
    body.rotations = wanted.rotations;
    body.isolated.clear();
    body.isolated.isolate(wanted.isolated_nodes, models_[b], body.factor, workspace_);
  }
  if (positive_definite) {
    result.epoch = request.epoch;
    results_.publish();
  } else {
    failures_.fetch_add(1, std::memory_order_release);
  }
  finished_.fetch_add(1, std::memory_order_release);  // last: who sees it idle also sees the result
  return true;
}

}  // namespace stylet::physics
