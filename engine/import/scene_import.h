// From organs of other programs to a whole scenario: every organ with its role, the abdominal wall derived, the
// needle and the probe placed, and an account of what was found.
#pragma once

#include "engine/content/scene.h"
#include "engine/gltf/gltf_writer.h"
#include "engine/import/organ_import.h"
#include "engine/import/scan_cut.h"
#include "engine/import/side_file.h"
#include "physics/messages/messages.h"
#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace stylet::import {

/// Nodes of a body that do not move, as a scenario says it: near organs, or beyond a plane, or outside a box.
struct Hold {
  std::vector<std::string> near{};
  double within = 0;  ///< m
  std::optional<Eigen::Hyperplane<double, 3>> plane{};
  std::optional<Eigen::AlignedBox3d> outside_box{};
};

struct SceneBody {
  std::string id{};
  double cell = 0;  ///< m; 0: target_nodes counts
  int target_nodes = 0;
  physics::Element element = physics::Element::linear;
  std::vector<Hold> holds{};
};

/// What became of an organ.
struct SceneOrgan {
  std::string id{};
  std::string role{};
  std::string tissue{};
  std::string body{};
  std::vector<std::string> parts{};  ///< empty: derived
  std::size_t triangles = 0;
  int pieces = 0;     ///< connected
  double volume = 0;  ///< m^3; 0: open
  std::vector<std::string> notes{};
};

/// Two organs in one place.
struct Overlap {
  std::string gives_way{};
  std::string counts{};
  double volume = 0;  ///< m^3
  double share = 0;   ///< of the smaller organ
};

/// A stretch of the straight line from the entry to the target.
struct PathPiece {
  std::string organ{};
  double from = 0, to = 0;  ///< m below the entry
};

struct ImportedScene {
  std::vector<gltf::AnnotatedSurface> surfaces{};  ///< in the order of the file: the later one counts
  std::vector<SceneBody> bodies{};
  std::vector<std::pair<std::string, std::string>> contacts{};  ///< nodes of, surface of
  Eigen::Vector3d entry = Eigen::Vector3d::Zero();              ///< on the skin
  Eigen::Vector3d outward = Eigen::Vector3d::UnitZ();           ///< normal of the skin there
  Eigen::Vector3d target = Eigen::Vector3d::Zero();             ///< centre of its volume
  physics::RigidPose probe{};                                   ///< patient from probe

  std::vector<SceneOrgan> organs{};
  std::vector<ScanCut> cuts{};
  std::vector<Overlap> overlaps{};  ///< largest first
  std::vector<PathPiece> path{};
  double wall_depth = 0;                ///< m
  std::vector<std::string> left_out{};  ///< parts of the files that no organ takes
  std::vector<std::string> warnings{};  ///< what an author should look at, one line each
};

/// Whether a needle that only passes an organ of this tissue does harm there.
bool leaks(const std::string& tissue);

/// Completes what the side file leaves open: the body, the entry, the probe, made-up lesions.
/// @param tissues  names of the tissue table
/// @param probe    the one that is held; its pose does not count
/// @throws files::ContentError  "side file:pointer: what; what to do"
ImportedScene import_scene(const std::vector<SourceFile>& files, const SideFile& side,
                           const std::set<std::string>& tissues, const content::Probe& probe,
                           const ImportProgress& progress);

}  // namespace stylet::import
