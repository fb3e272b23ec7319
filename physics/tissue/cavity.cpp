#include "physics/tissue/cavity.h"

#include "physics/tissue/corotational.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace stylet::physics {
namespace {

constexpr double kLeastShare = 0.01;
constexpr double kLargestShare = 2;
constexpr double kFastest = 0.01;   // change of g in a step: no tetrahedron turns inside out when a share jumps
constexpr double kLargestSize = 5;  // either way: beyond it something else is wrong

}  // namespace

Cavity::Cavity(const TissueModel& model, std::vector<int> tets) : tets_(std::move(tets)) {
  std::sort(tets_.begin(), tets_.end());
  if (tets_.empty() || tets_.front() < 0 || tets_.back() >= model.tet_count() ||
      std::adjacent_find(tets_.begin(), tets_.end()) != tets_.end()) {
    throw std::invalid_argument("cavity: its " + std::to_string(tets_.size()) +
                                " tetrahedra must be different ones of the body");
  }
  if (model.is_quadratic()) {
    for (std::size_t i = 0; i < tets_.size(); ++i) {
      const int of_run = static_cast<int>(i % kTetsOfRefined);
      if (tets_.size() % kTetsOfRefined != 0 || tets_[i] % kTetsOfRefined != of_run) {
        throw std::invalid_argument("cavity: it must be of whole quadratic elements, eight tetrahedra each");
      }
      if (of_run == 0) elements_.push_back(tets_[i] / kTetsOfRefined);
    }
  }
  for (const int t : tets_) rest_volume_ += model.tets[t].volume;
  full_volume_ = rest_volume_;
}

bool Cavity::fill(double share, double volume) {
  const double before = size_;
  if (share == 1) {
    if (size_ == 1) full_volume_ = volume;
    size_ = std::clamp(1.0, size_ - kFastest, size_ + kFastest);
    return size_ != before;
  }
  // The mean stretch follows g by a factor between 0 and 1, as stiff as the filling is against the tissue around it:
  // moved by all that is missing, g settles without overshoot.
  const double wanted = std::cbrt(std::clamp(share, kLeastShare, kLargestShare) * full_volume_ / rest_volume_);
  const double missing = wanted - std::cbrt(std::max(volume, 0.0) / rest_volume_);
  size_ = std::clamp(size_ + std::clamp(missing, -kFastest, kFastest), -kLargestSize, kLargestSize);
  return size_ != before;
}

CavityState Cavity::state(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                          std::span<const Eigen::Quaterniond> rotations, std::span<const StrainMemory> memory) const {
  CavityState state;
  double work = 0;  // sum V sigma : S = dU / d ln s of all lengths of the cavity times s, = -3 p v
  for (const int e : elements_) {
    const ElementWork of_element = work_of(model, positions, rotations, e, size_, memory);
    state.volume += of_element.volume;
    work += of_element.work;
  }
  if (elements_.empty()) {
    for (const int t : tets_) {
      const TetRest& rest = model.tets[t];
      const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
      const CorotatedStress local = corotated_stress(model, t, f, rotations[t].toRotationMatrix(), size_, memory);
      state.volume += rest.volume * f.determinant();
      work += rest.volume * local.stress.cwiseProduct(local.stretch).sum();
    }
  }
  if (state.volume > 0) state.pressure = -work / (3 * state.volume);
  return state;
}

}  // namespace stylet::physics
