// The abdominal wall that no atlas has as an organ: the body within a depth of the skin over a field, minus the
// organs inside.
#pragma once

#include "engine/files/pulse.h"
#include "engine/import/scan_cut.h"
#include "engine/import/side_file.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace stylet::import {

/// The patient's outside: the whole body, its skin, where the scan cuts it.
class Body {
public:
  /// @param surface  closed
  explicit Body(const mesh::TriangleMesh& surface);

  const std::vector<ScanCut>& cuts() const { return cuts_; }
  /// Metres to the skin (a cut is none), positive inside the body, negative outside; beyond a cut of no meaning.
  double depth(const Eigen::Vector3d& x) const;
  /// Point of the skin nearest to x and its outward normal.
  mesh::Solid::Nearest on_skin(const Eigen::Vector3d& x) const { return skin_.nearest(x); }
  const mesh::Solid& solid() const { return solid_; }

private:
  std::vector<ScanCut> cuts_;
  mesh::Solid solid_;
  mesh::Solid skin_;  // open: only its unsigned distance counts
};

/// The field of a wall as an implicit surface: metres, negative inside. Ends short of the scan's cuts.
double field_distance(const SideWall& wall, const Eigen::Vector3d& entry, const std::vector<ScanCut>& cuts,
                      const Eigen::Vector3d& x);

/// One closed surface of the wall, nested: the first is the whole wall, each other what lies deeper than the layers
/// before it.
struct WallSurface {
  std::string tissue;
  mesh::TriangleMesh surface;
  double inner_from = 0;  ///< depth where it begins, m
};

/// @param pulse   called often meanwhile; may throw to end it
/// @param inside  organs that are taken out, closed surfaces
/// @throws files::ContentError  the field meets no body, or only organs
std::vector<WallSurface> derive_wall(const SideWall& wall, const Eigen::Vector3d& entry, const Body& body,
                                     const std::vector<const mesh::Solid*>& inside, const std::string& place,
                                     const files::Pulse& pulse = {});

}  // namespace stylet::import
