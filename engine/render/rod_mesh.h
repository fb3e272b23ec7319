// Straight rods: the cores of a biopsy where they lay, the needle that is fired for them, the parts of a syringe,
// controllers in the hands.
#pragma once

#include "engine/state/biopsy_shot.h"
#include "engine/state/frame_state.h"
#include "shaders/shared.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace stylet::render {

/// With flat ends. Patient frame, m.
struct Rod {
  Eigen::Vector3f from = Eigen::Vector3f::Zero();
  Eigen::Vector3f to = Eigen::Vector3f::Zero();
  float radius = 0;
  float taper = 1;  ///< radius at `to` over that at `from`
};

/// Builds the vertices of some rods. The triangles are the same for all: those of the first n rods come first.
class RodMesh {
public:
  /// @param most  rods that there may be
  explicit RodMesh(std::size_t most);

  std::span<const std::uint32_t> indices() const { return indices_; }
  std::size_t vertex_count() const { return vertices_.size(); }
  /// Of the triangles of so many rods.
  static constexpr std::uint32_t index_count(std::size_t rods) {
    return static_cast<std::uint32_t>(rods) * (kRings - 1) * kSides * 6;
  }
  /// What goes beyond the most is left out.
  std::span<const DrawnVertex> shape(std::span<const Rod> rods);

private:
  static constexpr std::uint32_t kSides = 20;
  static constexpr std::uint32_t kRings = 6;  // an end's middle, its rim twice, the other's rim twice, its middle

  std::vector<std::uint32_t> indices_;
  std::vector<DrawnVertex> vertices_;
};

/// The cores, as they lay.
std::vector<Rod> core_rods(std::span<const state::CoreTrack> cores);

/// What stands out of a biopsy needle that was fired: the stylet's shank, its notch, its point, the cannula.
inline constexpr std::size_t kShotParts = 5;
/// @param tip, orientation  of the needle: +Z ahead; the notch is open to +X
/// @param radius  of the cannula, m
std::array<Rod, kShotParts> shot_rods(const state::BiopsyShot& shot, const Eigen::Vector3f& tip,
                                      const Eigen::Quaternionf& orientation, float radius);

/// A controller as a hand holds it, whoever made it: handle, head, trigger.
inline constexpr std::size_t kControllerParts = 3;
/// @param patient_from_grip  origin in the palm, -Z along the handle to the thumb
std::array<Rod, kControllerParts> controller_rods(const Eigen::Isometry3d& patient_from_grip);

/// Parts of a syringe on the needle's hub, in the order of the rods.
enum class SyringePart : std::uint8_t { fluid, seal, stem, thumb_rest, nozzle, barrel };
inline constexpr std::size_t kSyringeParts = 6;
/// A barrel four times as long as wide, its plunger as far out as it holds fluid.
/// @param hub, orientation  of the needle: +Z ahead, away from the syringe
std::array<Rod, kSyringeParts> syringe_rods(const state::SyringeState& syringe, const Eigen::Vector3f& hub,
                                            const Eigen::Quaternionf& orientation);

}  // namespace stylet::render
