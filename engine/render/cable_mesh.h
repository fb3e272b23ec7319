// The probe's cable as it is seen: from its tail, over the patient, to the ultrasound machine.
#pragma once

#include "engine/render/room_layout.h"
#include "shaders/shared.h"

#include <Eigen/Geometry>

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::render {

/// Builds the cable's vertices from the pose of the probe. The triangles are the same for every shape.
class CableMesh {
public:
  explicit CableMesh(const RoomLayout& layout);

  std::span<const std::uint32_t> indices() const { return indices_; }
  std::size_t vertex_count() const { return vertices_.size(); }
  /// A smooth tube that leaves the probe along its grip, lies on what it meets and ends at the machine. No mechanics:
  /// the same pose gives the same cable. Patient frame.
  std::span<const DrawnVertex> shape(const Eigen::Isometry3d& patient_from_probe);

private:
  static constexpr int kPoints = 56;
  static constexpr int kSides = 10;

  /// On what it would lie in. Table frame.
  Eigen::Vector3d clear_of_patient(const Eigen::Vector3d& at) const;

  RoomLayout layout_;
  std::vector<std::uint32_t> indices_;
  std::vector<Eigen::Vector3d> points_;  ///< table frame
  std::vector<DrawnVertex> vertices_;
};

}  // namespace stylet::render
