// The asynchronous factorisation (paper II-B): a step function for a thread of the session's own.
#pragma once

#include "physics/messages/latest_value.h"
#include "physics/tissue/companion.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/isolated_dofs.h"
#include "physics/tissue/stiffness.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Geometry>

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

namespace stylet::physics {

/// What the simulation asks for: the system matrices at a state.
struct FactorisationRequest {
  struct Body {
    std::vector<Eigen::Quaterniond> rotations;  ///< [points] rest -> then
    std::vector<SqueezedTet> squeezed;          ///< then
    std::vector<Eigen::Matrix3d> cofactors;     ///< [points] then, of quadratic elements
    std::vector<PointStiffness> stiffening;     ///< [points] then, where some stiffen
    std::vector<MembraneGradient> membrane;     ///< [triangles of the capsule] then
    std::vector<int> isolated_nodes;            ///< now: will be among the factor's trailing nodes
    std::vector<int> foreseen_nodes;            ///< isolated soon, the likeliest first
    std::vector<int> beside_nodes;              ///< around all of those, taken along where there is room
    std::vector<int> contact_nodes;  ///< in touch with another body or the probe, or nearly; kMaxContactNodes count
    std::size_t pressed_nodes = 0;  ///< the first of contact_nodes carry force: they must be among the trailing nodes
  };
  std::uint64_t epoch = 0;  ///< simulation step of the state
  std::vector<Body> bodies;
};

/// What it gets. Lives in the slots of a LatestValue: nothing of it is copied when it changes hands.
struct FactorisedTissue {
  struct Body {
    Factorisation factor;
    std::vector<int> trailing_nodes;            ///< eliminated last: isolated and foreseen in some request
    IsolatedDofs isolated;                      ///< knows those; whoever holds the value may add more (its own slot)
    std::vector<Eigen::Quaterniond> rotations;  ///< [points] of the matrix: as requested
    std::vector<SqueezedTet> squeezed;          ///< the same
    std::vector<Eigen::Matrix3d> cofactors;     ///< the same
    std::vector<PointStiffness> stiffening;     ///< the same
    std::vector<MembraneGradient> membrane;     ///< the same
  };
  std::uint64_t epoch = 0;
  std::vector<Body> bodies;
};

/// Whether the trailing nodes are all that a request must have: isolated, the nearer half of the foreseen, pressed.
bool covers(std::span<const int> trailing_nodes, const FactorisationRequest::Body& request, const TissueModel& model);

/// Whether the matrix of a factor is still that of a state, nearly: no point has turned by more than `turn`, and what
/// the barrier adds, and cof F of quadratic elements, have changed by no more than that share, and no point or
/// triangle of the capsule has become stiffer or softer by more than a twentieth (an engineering value).
/// @param now   all but its rotations and nodes
/// @param turn  rad
bool nearly_of(const FactorisedTissue::Body& factor, std::span<const Eigen::Quaterniond> rotations,
               const FactorisationRequest::Body& now, double turn);

/// Between the simulation thread (request, update, latest) and the worker thread (step). No locks.
/// The nodes eliminated last are chosen anew, with another symbolic analysis, only when they lack an isolated node,
/// one of the nearer half of the foreseen ones, or a pressed one: the rest is the margin that makes this rare.
class FactorisationWorker {
public:
  /// Analyses and factorises the bodies at rest: latest() is valid, epoch 0. `models` must outlive the worker.
  /// @param dt  period of the simulation loop, s (damping, eq. 5)
  /// @param coarsest  that the factors may be read in
  /// @param two_threads  a second thread takes part in large factorisations; the bits do not know of it
  /// @throws std::invalid_argument if a body is not held well enough to be positive definite
  FactorisationWorker(std::span<const TissueModel> models, double dt,
                      PassPrecision coarsest = PassPrecision::twelve_bits, bool two_threads = true);

  /// Worker: takes the latest request, factorises all bodies, publishes; false if there was none. A matrix that is
  /// not positive definite is counted in failures() and nothing is published.
  bool step();
  /// Any thread: no request is waiting or in work.
  bool idle() const {
    return requested_.load(std::memory_order_acquire) == finished_.load(std::memory_order_acquire);
  }

  /// Any thread: requests that could not be factorised.
  std::uint64_t failures() const { return failures_.load(std::memory_order_acquire); }

  /// Simulation: the request to fill, sized; then submit() it.
  FactorisationRequest& request() { return requests_.back(); }
  void submit();
  /// Simulation: swaps in the latest result if there is a newer one.
  bool update() { return results_.update(); }
  /// Simulation: the factorisation taken last.
  FactorisedTissue& latest() { return results_.front(); }
  const FactorisedTissue& latest() const { return results_.front(); }

private:
  std::span<const TissueModel> models_;
  double dt_;
  Companion helper_;
  SolveWorkspace workspace_;  // worker's, after construction
  std::vector<StiffnessPattern> patterns_;
  std::vector<std::vector<double>> values_;
  std::vector<std::vector<int>> corridors_;  // [bodies] nodes to eliminate last
  LatestValue<FactorisationRequest> requests_;
  LatestValue<FactorisedTissue> results_;
  std::atomic<std::uint64_t> requested_{0};
  std::atomic<std::uint64_t> finished_{0};
  std::atomic<std::uint64_t> failures_{0};
};

}  // namespace stylet::physics
