// Cores that a biopsy has cut, as they are seen: rods where they lay.
#pragma once

#include "engine/state/frame_state.h"
#include "shaders/shared.h"

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::render {

/// Builds the vertices of up to kMost rods. The triangles are the same for all: those of the first n rods come first.
class CoreMesh {
public:
  static constexpr std::size_t kMost = 20;

  CoreMesh();

  std::span<const std::uint32_t> indices() const { return indices_; }
  std::size_t vertex_count() const { return vertices_.size(); }
  /// Of the triangles of the first `cores` rods.
  static std::uint32_t index_count(std::size_t cores);
  /// Closed rods from end to end. What goes beyond kMost is left out. Patient frame.
  std::span<const DrawnVertex> shape(std::span<const state::CoreTrack> cores);

private:
  static constexpr std::uint32_t kSides = 10;
  static constexpr std::uint32_t kRings = 4;  // the middle of an end, its rim twice, the other's middle

  std::vector<std::uint32_t> indices_;
  std::vector<DrawnVertex> vertices_;
};

}  // namespace stylet::render
