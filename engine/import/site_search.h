// Where needle, probe and a made-up lesion go in a patient for whom nobody has said it.
//
// Each is the best of many places by a cost in millimetres, which is an engineering value as a whole: the length of
// the way, and more where it leads through or past what must be spared, or where the image would not show the needle.
#pragma once

#include "engine/content/scene.h"
#include "engine/import/derived_wall.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

namespace stylet::import {

enum class SiteKind : std::uint8_t {
  free,    ///< nothing, or what a needle may pass
  spared,  ///< bleeds or leaks
  air,     ///< neither needle nor ultrasound
  hard,    ///< bone, cartilage: the same
  carrier  ///< the organ that the target lies in
};

struct SiteOrgan {
  const mesh::TriangleMesh* surface = nullptr;  ///< closed
  SiteKind kind = SiteKind::free;
};

/// Needle and beam make at least this angle with each other at the target, where the anatomy allows it, rad. A shaft
/// is a mirror: at 90 degrees all of it returns to the probe, at 20 hardly anything (Hopkins and Bradley 2001,
/// Nichols 2003), so the needle is led in as flat below the probe as the way allows.
inline constexpr double kLeastToBeam = 40 * std::numbers::pi / 180;

class SiteSearch {
public:
  /// @param organs  where two overlap the later one counts; at least one is the carrier, or `around` says where to
  /// look
  /// @param probe   its face and its beams; its pose does not count
  /// @param around  the target, m, patient frame
  SiteSearch(std::span<const SiteOrgan> organs, const Body& body, const SideWall& wall, const content::Probe& probe,
             const Eigen::AlignedBox3d& around, std::function<void()> pulse);

  /// Middle of a ball in the carrier that keeps off its surface and off what is spared, about 65 mm below the skin on
  /// a good way that a probe sees. Nothing: the carrier is too small for it.
  std::optional<Eigen::Vector3d> ball(double radius) const;

  struct Sites {
    Eigen::Vector3d entry = Eigen::Vector3d::Zero();  ///< on the skin
    Eigen::Vector3d probe = Eigen::Vector3d::Zero();
    double cost = 0;  ///< mm
  };
  /// On a supine patient, clear of the ends of the scan, the probe in the field of the wall beside the entry.
  /// @param entry  where that is known already
  /// Nothing: no place on the skin will do.
  std::optional<Sites> sites(const Eigen::Vector3d& target, const std::optional<Eigen::Vector3d>& entry) const;

private:
  struct Skin {
    Eigen::Vector3d point, normal;
  };
  SiteKind kind_at(const Eigen::Vector3d& x) const;
  double clear_at(const Eigen::Vector3d& x) const;
  double deep_at(const Eigen::Vector3d& x) const;
  std::optional<std::size_t> cell_of(const Eigen::Vector3d& x) const;
  std::vector<float> distance_to(const std::function<bool(SiteKind)>& is) const;
  double way_cost(const Skin& entry, const Eigen::Vector3d& target) const;
  double view_cost(const Skin& probe, const Eigen::Vector3d& entry, const Eigen::Vector3d& target, double most) const;

  const Body& body_;
  const SideWall& wall_;
  const content::Probe& probe_;
  std::function<void()> pulse_;
  content::LabelVolume grid_;    // its geometry
  std::vector<SiteKind> kinds_;  // [cells]
  std::vector<float> clear_;     // [cells] m to what is spared, air or hard
  std::vector<float> deep_;      // [cells] m to what is not the carrier
  std::vector<Skin> skin_;       // places on it
};

}  // namespace stylet::import
