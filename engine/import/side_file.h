// The side file of an import (content/README.md, "Side files", "stylet-import"): which parts make which organ, and
// how they become a whole scenario. Names and numbers, checked but nothing loaded.
#pragma once

#include "engine/files/json_reader.h"
#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stylet::import {

/// An organ of one or more parts, of one file or of several.
struct SideOrgan {
  std::string pointer{};  ///< place, for messages
  std::string id{};
  std::vector<std::string> parts{};  ///< patterns of part names (OrganRequest); default: the id
  std::string role = "boundary";     ///< boundary, region, vessel, target, visual, ignore
  std::string tissue{};              ///< row of the tissue table; empty: by the annotation, else the id
  std::string body{};                ///< deformable organ that carries it; empty: rigid
  bool deformable = false;           ///< becomes a body of its own
  int priority = 0;                  ///< where organs overlap the higher one counts; equal: the later in the list
  std::optional<double> within{};    ///< m; only what lies so near to `body` is carried, the rest is rigid
  double cell = 0;                   ///< m; 0: target_nodes counts
  int target_nodes = 2300;
  physics::Element element = physics::Element::linear;
  std::vector<std::string> held_by{};  ///< organs whose neighbourhood does not move
  double held_within = 0.005;          ///< m
  double held_back = 0;                ///< share of its depth, from the back, that does not move
  double ball = 0;                     ///< m; no part but a ball of this diameter that is made up, in `body`
};

/// A layer of the wall, from the skin inwards.
struct WallLayer {
  std::string pointer{};
  std::string tissue{};
  double thickness = 0;  ///< m; 0: to the inner face
};

/// The body within a depth of the skin over a field, minus the organs inside.
struct SideWall {
  std::string pointer{};
  std::string id = "abdominal_wall";
  std::string skin{};  ///< organ id of the whole body's surface; empty: derived (derived_body.h)
  double depth = 0.025;
  std::optional<Eigen::AlignedBox3d> box{};  ///< the field; absent: the ball
  double radius = 0.080;                     ///< of the ball about the entry, m
  std::vector<WallLayer> layers{};
  double clearance = 0.001;  ///< between the wall and the organs taken out of it, m
  double cell = 0;
  int target_nodes = 2000;
  physics::Element element = physics::Element::linear;
  std::vector<std::string> held_by{};  ///< organs that stay inside the wall and hold it: ribs
  double held_within = 0.005;
  std::string filler{};  ///< tissue of the body between the organs; empty: nothing lies there
};

struct SideProbe {
  std::string file = "c5_2";                 ///< as SideScenario::needle
  std::optional<Eigen::Vector3d> at{};       ///< absent: beside the entry (site_search.h)
  std::optional<Eigen::Vector3d> look_at{};  ///< absent: the target
};

struct SideContact {
  std::string pointer{};
  std::string nodes_of{};
  std::string surface_of{};
};

struct SideScenario {
  std::string pointer{};
  std::string name{};
  std::string title{};
  std::string source{};  ///< where the organs come from, and their licence
  SideWall wall{};
  std::optional<Eigen::Vector3d> entry{};  ///< patient frame, near the skin; absent: site_search.h
  std::string target{};                    ///< organ id
  std::string needle = "18g_150mm";        ///< file beside the side file, or name of one in content/needles
  SideProbe probe{};
  std::optional<std::vector<SideContact>> contacts{};  ///< absent: every deformable organ against the wall
  double label_spacing = 0.001;                        ///< m
};

struct SideFile {
  std::filesystem::path path{};
  std::vector<SideOrgan> organs{};
  std::optional<SideScenario> scenario{};  ///< absent: the organs alone
  std::string proposed{};                  ///< text of one that was proposed: left with what is made by it
};

/// Its keys.
const files::FileFormat& side_file_format();

/// Problems go to `file`: also ids that are used twice or that no organ has.
SideFile read_side_file(files::JsonFile& file);

}  // namespace stylet::import
