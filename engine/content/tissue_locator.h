// What lies at a point of the patient, as deformed and breathing as it is.
#pragma once

#include "engine/content/scene.h"
#include "physics/tissue/tet_topology.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace stylet::content {

/// Bone and cartilage: the needle does not get in. Fifty times stiffer than any tissue that deforms.
inline bool is_bone(const Tissue& tissue) {
  return tissue.mechanics.young_modulus >= 1e6;  // Pa
}

/// The anatomy at a point.
struct TissuePlace {
  int tissue = 0;                                  ///< index into Scene::tissues; 0: outside, or a gap between organs
  int body = -1;                                   ///< deformable body that it goes with, -1: none, or kBreathes
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();  ///< where that point of the tissue was at rest, m
  std::uint32_t forbidden = 0;                     ///< bit i: in Scene::forbidden[i]
};

/// Carries points back through the deformed tetrahedra, or the breath, to the label volume. One thread: a search
/// starts where the one before ended. The same points in the same order get the same answers.
class TissueLocator {
public:
  /// Keeps a reference to `scene`.
  explicit TissueLocator(const Scene& scene);

  /// The tissue as it is now, for find(). Keeps a reference to `tissue`.
  /// @param time_s  session time, which tells the breath
  void update(const physics::TissueState& tissue, double time_s);

  /// What is at `x`, patient frame. Where bodies overlap, the later one counts.
  TissuePlace find(const Eigen::Vector3d& x);
  /// Whether `x` is in a deformable body.
  bool in_body(const Eigen::Vector3d& x) { return find_body(x).body >= 0; }

  /// Body and tetrahedron that carry a point; body -1: none does.
  struct Carrier {
    int body = -1;
    physics::TetPoint point{};
  };
  /// Of a point at rest.
  Carrier carrier(const Eigen::Vector3d& rest) const;
  /// Where it is carried to; where nothing carries it, it stays.
  Eigen::Vector3d carried(const Carrier& at, const Eigen::Vector3d& rest) const;

private:
  Carrier find_body(const Eigen::Vector3d& x);
  TissuePlace labelled(const Carrier& at, const Eigen::Vector3d& x) const;

  const Scene& scene_;
  std::vector<physics::TetTopology> topologies_;  // [bodies]
  std::vector<Eigen::Matrix3Xd> rest_;            // [bodies]
  const physics::TissueState* tissue_ = nullptr;
  std::array<Eigen::AlignedBox3d, physics::kMaxBodies> boxes_;
  std::array<int, physics::kMaxBodies> hints_{};
  Eigen::Vector3d breath_ = Eigen::Vector3d::Zero();
};

}  // namespace stylet::content
