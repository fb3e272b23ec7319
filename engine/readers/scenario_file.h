// A scenario file as written: names, paths and numbers, checked but nothing loaded (content/README.md,
// "stylet-scenario").
#pragma once

#include "engine/content/exercise.h"
#include "engine/content/scene.h"
#include "engine/files/json_reader.h"
#include "engine/gltf/gltf.h"
#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace stylet::readers {

inline constexpr double kPatientExtent = 5;  ///< m; coordinates of a scenario lie within

/// What a scenario says about a glTF node, over the node's own extras.
struct NodeOverride {
  gltf::OrganAnnotation organ;
  std::string tissue;
};

/// A glTF file and where it is put.
struct OrganFile {
  std::filesystem::path path;
  Eigen::Affine3d patient_from_file = Eigen::Affine3d::Identity();
  std::map<std::string, NodeOverride> nodes;  ///< by node name
};

/// Nodes of a deformable body that do not move: those that meet every condition given.
struct FixedRegion {
  std::string pointer;                                  ///< place, for messages
  std::optional<Eigen::AlignedBox3d> box;               ///< inside
  std::optional<Eigen::AlignedBox3d> outside_box;       ///< outside
  std::optional<Eigen::Hyperplane<double, 3>> plane;    ///< on the side of its normal
  std::vector<std::string> near;                        ///< organs, one of them within `distance`
  double distance = 0;                                  ///< m
  Eigen::Vector3d breathing = Eigen::Vector3d::Zero();  ///< their displacement at full inspiration, m
};

/// A deformable body to be made.
struct BodyRequest {
  std::string pointer;
  std::string name;
  std::string boundary;              ///< organ id of its surface
  std::vector<std::string> carries;  ///< organ ids, besides those whose annotation names this body
  double cell = 0;                   ///< m; 0: target_nodes counts
  int target_nodes = 2300;
  physics::Element element = physics::Element::linear;
  std::vector<FixedRegion> fixed;
};

struct TargetRequest {
  std::string pointer;
  std::string name;
  std::string organ;  ///< id; empty: centre and radius are given
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0.01;
};

struct LabelRequest {
  double spacing = 0.001;                            ///< m
  std::string filler;                                ///< tissue between the organs; empty: outside
  std::string behind;                                ///< organ id of the wall the filler lies behind
  Eigen::Vector3d front = Eigen::Vector3d::UnitZ();  ///< an axis, from the filler to the wall
};

struct ScenarioFile {
  std::filesystem::path path;
  std::string name;
  std::string title;
  std::filesystem::path tissues;
  std::filesystem::path needle;
  std::filesystem::path probe;
  std::filesystem::path motion;
  physics::RigidPose probe_pose;
  int probe_presses = -1;  ///< index into bodies, -1: none
  bool probe_gel = true;
  std::vector<OrganFile> organs;
  std::vector<BodyRequest> bodies;
  std::vector<TargetRequest> targets;
  std::vector<std::string> forbidden;  ///< organ ids
  std::vector<content::Criterion> scoring;
  double pass_mark = 70;
  LabelRequest labels;
  content::Camera camera;
  Eigen::Isometry3d room_from_patient = Eigen::Isometry3d::Identity();
  content::LoopRates rates;
  std::string coupling;
  std::string shaft_friction;
  content::HandForce hand_force;
  content::StartSpread start;
  double contact_spacing = 0.010;
  double damping_time_s = 0;
  double gravity = 0;  ///< m/s^2, down in the room
  std::vector<content::BodyContact> contacts;
  content::Breathing breathing;
  std::vector<std::string> breathing_organs;  ///< ids of rigid ones that go with the breath
  content::Exercise exercise;
};

/// Its keys.
const files::FileFormat& scenario_format();

/// What it is called. Problems go to `root`'s file.
struct ScenarioTitle {
  std::string name;
  std::string title;
};
ScenarioTitle read_scenario_title(files::JsonObject& root);

/// Problems go to `file`.
ScenarioFile read_scenario_file(files::JsonFile& file);

}  // namespace stylet::readers
