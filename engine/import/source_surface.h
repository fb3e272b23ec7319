// A named surface out of a file that says nothing about organs: STL and OBJ, as 3D Slicer and Blender write them.
#pragma once

#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::import {

/// Axes of a file's coordinates. Patient frame: +X left, +Y superior, +Z anterior.
enum class Axes {
  patient,  ///< as glTF: the patient frame itself
  ras,      ///< +X right, +Y anterior, +Z superior
  lps,      ///< +X left, +Y posterior, +Z superior
};

/// patient_from_file: a rotation (or reflection: none of these mirrors) and the scale to metres.
Eigen::Affine3d patient_from_file(Axes axes, double metres_per_unit);

/// One object, group or solid of a file.
struct SourceSurface {
  std::string name;
  mesh::TriangleMesh mesh;  ///< in the file's own frame and unit, not welded
};

/// What 3D Slicer writes into a header or comment.
std::optional<Axes> stated_axes(std::string_view comment);

struct SurfaceFile {
  std::vector<SourceSurface> surfaces;
  std::optional<Axes> axes;           ///< where the file says so: SPACE=LPS or SPACE=RAS in a comment (3D Slicer)
  std::vector<std::string> warnings;  ///< one line each
};

/// Caps that keep a bad file from exhausting memory or time.
struct SurfaceLimits {
  std::size_t file_bytes = 512u << 20;
  std::size_t elements = 5'000'000;  ///< vertices, and triangles, of the whole file
  std::size_t surfaces = 10'000;
  double coordinate = 1e5;  ///< |x| in the unit of the file
};

}  // namespace stylet::import
