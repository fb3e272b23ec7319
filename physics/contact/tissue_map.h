// What resists the needle where: the tissues of the patient in rest space, read at haptic rate.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace stylet::physics {

/// How a tissue resists the needle. SI.
struct InsertionResistance {
  double puncture_force = 0;        ///< on the tip, that breaks through its surface, N
  double cutting_force = 0;         ///< on the tip, that makes the track longer, N
  double cutting_viscosity = 0;     ///< what cutting takes more per speed, N s/m
  double friction_per_length = 0;   ///< Coulomb, on the shaft, N/m
  double friction_coefficient = 0;  ///< Coulomb, of the lateral force between shaft and tissue, -
  double viscous_friction = 0;      ///< per length of shaft and speed, N s/m^2
  double side_strength = 0;         ///< per length of shaft that is pressed sideways until it cuts, N/m; 0: holds
  bool rigid = false;               ///< bone: does not yield to the needle

  bool resists_sliding() const { return friction_per_length > 0 || friction_coefficient > 0 || viscous_friction > 0; }
  bool resists_cutting() const { return cutting_force > 0 || cutting_viscosity > 0; }
};

/// The surface between two tissues where it is tougher or weaker than the rule of puncture_force() says.
struct TissueSurface {
  int from = 0;  ///< either way
  int to = 0;
  double puncture_force = 0;  ///< N
};

/// Tissues by voxel in rest space, 0 outside the patient, and how each resists. Without voxels, everything inside a
/// body is tissue 1 of two. Never changes after load: every thread may read it.
struct TissueMap {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< centre of voxel (0, 0, 0), patient frame at rest, m
  double spacing = 1e-3;                             ///< m
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<std::uint8_t> labels;                  ///< x fastest; empty: one tissue
  std::vector<InsertionResistance> tissues{{}, {}};  ///< by label
  std::vector<TissueSurface> surfaces;
  /// By label, E at rest, Pa; empty: what surrounds the needle is as the mesh says, a mean over its elements.
  std::vector<double> young_modulus;

  /// Tissue at a rest position inside a body; never 0 nor bone: where the voxels say that, the nearest tissue within
  /// two voxels, else `inside`. @realtime
  int at(const Eigen::Vector3d& rest, int inside) const;
  /// Mean E of the soft tissue along a straight way at rest, Pa, continuous in its ends within tissue. 0: nothing is
  /// known of it.
  /// @realtime
  double modulus_along(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int steps) const;
  /// Bone at a position: it stays where it was at rest. 0: there is none. @realtime
  int bone_at(const Eigen::Vector3d& x) const;
  const InsertionResistance& resistance(int tissue) const { return tissues[tissue]; }
  /// Force on the tip that breaks through from one tissue to another, N: as `surfaces` say; from outside that of the
  /// tissue entered; else the smaller of the two, since an inclusion's membrane is the same from both sides; the
  /// larger where one is bone.
  /// @realtime
  double puncture_force(int from, int to) const;

private:
  /// E of the soft tissue around a position, between voxels, Pa; 0: there is none.
  double modulus_at(const Eigen::Vector3d& x) const;
  Eigen::Vector3i voxel_at(const Eigen::Vector3d& x) const;
  int label(const Eigen::Vector3i& voxel) const;
};

}  // namespace stylet::physics
