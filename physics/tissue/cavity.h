// A cavity full of fluid in a body: some of its tetrahedra, which shrink as fluid is drawn from them.
//
// Fluid does not shrink; what fills the cavity is a soft compressible solid. So the size g that its tetrahedra would
// have without stress (physics/README.md eq. 34) is a multiplier: it is moved until the volume is that of the fluid.
// Below 0, where the wall pulls harder than the filling can at any size, it is a multiplier all the same.
#pragma once

#include "physics/tissue/strain_memory.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <span>
#include <vector>

namespace stylet::physics {

/// State of a cavity. Pressure counts from that at rest, where the body has no stress.
struct CavityState {
  double volume = 0;  ///< as deformed, m^3
  double pressure =
      0;  ///< of the fluid on the tissue, mean over the volume, Pa: negative where the wall pulls outward
};

class Cavity {
public:
  /// @throws std::invalid_argument if there are no tetrahedra, one twice or not of the model, or a part of a
  /// quadratic
  ///         element
  Cavity(const TissueModel& model, std::vector<int> tets);

  const std::vector<int>& tets() const { return tets_; }
  double size() const { return size_; }  ///< g

  /// Brings the size closer to where the volume is `share` of that when it was last full. A share of 1 is full: the
  /// size goes to 1, whatever the tissue around presses it to.
  /// @param share   0.01 .. 2, clamped
  /// @param volume  of the cavity now, m^3
  /// @return whether the size changed
  bool fill(double share, double volume);

  /// @param rotations  [tets of the model] of these very positions
  /// @param memory     as internal_forces()
  CavityState state(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                    std::span<const Eigen::Quaterniond> rotations, std::span<const StrainMemory> memory = {}) const;

private:
  std::vector<int> tets_;
  std::vector<int> elements_;  // quadratic ones
  double rest_volume_ = 0;     // m^3
  double full_volume_ = 0;     // when last full, m^3
  double size_ = 1;
};

}  // namespace stylet::physics
