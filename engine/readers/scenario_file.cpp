#include "engine/readers/scenario_file.h"

#include "engine/content/metric_names.h"
#include "engine/procedures/kinds.h"
#include "engine/readers/exercise_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace stylet::readers {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr files::Range kCoordinate{-kPatientExtent, kPatientExtent};
constexpr files::Range kComponent{-1e3, 1e3};
constexpr files::Range kThreshold{-1e6, 1e6};
constexpr double kLongestSession = 86400;  // s

/// A direction; normalised.
Eigen::Vector3d direction(files::JsonObject& object, const std::string& key, const Eigen::Vector3d& fallback) {
  const Eigen::Vector3d v = object.vector3(key, kComponent, fallback);
  if (v.norm() > 1e-9) return v.normalized();
  object.problem(key, "has no length; write a direction");
  return fallback;
}

Eigen::Isometry3d pose(files::JsonObject& object,
                       const Eigen::Quaterniond& orientation = Eigen::Quaterniond::Identity()) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translation() = object.vector3("position", kCoordinate, Eigen::Vector3d::Zero());
  out.linear() = object.quaternion("orientation", orientation).toRotationMatrix();
  return out;
}

/// +Z along `axis`, +X as near to `lateral` as that allows.
Eigen::Quaterniond frame(files::JsonObject& object, const Eigen::Vector3d& axis, const Eigen::Vector3d& lateral) {
  const Eigen::Vector3d y = axis.cross(lateral);
  if (y.norm() < 0.05) {
    object.problem("lateral", "is parallel to axis; choose one across it");
    return Eigen::Quaterniond::Identity();
  }
  Eigen::Matrix3d rotation;
  rotation.col(1) = y.normalized();
  rotation.col(2) = axis;
  rotation.col(0) = rotation.col(1).cross(axis);
  return Eigen::Quaterniond(rotation).normalized();
}

/// Index of the body that `key` names: `name`, already read.
int body_named(files::JsonObject& object, const std::string& key, const std::string& name,
               const std::vector<BodyRequest>& bodies) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].name == name) return static_cast<int>(i);
  }
  object.problem(key, fmt::format("\"{}\" is not a body of this scenario; write the name of one", name));
  return -1;
}

void read_contacts(files::JsonObject& root, ScenarioFile& scenario) {
  for (files::JsonObject& contact : root.objects("contacts", false)) {
    const int nodes_of = body_named(contact, "nodes_of", contact.text("nodes_of"), scenario.bodies);
    const int surface_of = body_named(contact, "surface_of", contact.text("surface_of"), scenario.bodies);
    if (nodes_of == surface_of && nodes_of >= 0) contact.problem("", "names one body twice; name two");
    if (nodes_of >= 0 && surface_of >= 0) scenario.contacts.push_back({nodes_of, surface_of});
    contact.finish();
  }
}

void read_probe_pose(files::JsonObject root, ScenarioFile& scenario) {
  auto probe = root.object("probe");
  if (!probe) return;
  scenario.probe = probe->file("file");
  scenario.probe_pose.position = probe->vector3("position", kCoordinate);
  const bool quaternion = probe->has("orientation");
  scenario.probe_pose.orientation = probe->quaternion("orientation", Eigen::Quaterniond::Identity());
  const Eigen::Vector3d axis = direction(*probe, "axis", -Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d lateral = direction(*probe, "lateral", Eigen::Vector3d::UnitX());
  if (quaternion == (probe->has("axis") || probe->has("lateral"))) {
    probe->problem("", "needs either orientation, or axis and lateral; keep one");
  } else if (!quaternion) {
    scenario.probe_pose.orientation = frame(*probe, axis, lateral);
  }
  const std::string presses = probe->text("presses", "");
  if (!presses.empty()) scenario.probe_presses = body_named(*probe, "presses", presses, scenario.bodies);
  scenario.probe_gel = probe->boolean("gel", true);
  probe->finish();
}

OrganFile read_organ_file(files::JsonObject object) {
  OrganFile organ;
  organ.path = object.file("file");
  organ.patient_from_file = Eigen::Affine3d(pose(object).matrix());
  organ.patient_from_file.scale(object.number("scale", {1e-4, 1e4}, 1));
  if (auto nodes = object.object("nodes", false)) {
    for (auto& [name, node] : nodes->entries()) {
      NodeOverride& entry = organ.nodes[name];
      entry.organ.id = node.text("id", name);
      entry.organ.role = node.choice("role", {"boundary", "region", "vessel", "target", "visual", "ignore"}, "");
      entry.organ.body = node.text("body", "");
      entry.tissue = node.text("tissue", "");
      node.finish();
    }
  }
  object.finish();
  return organ;
}

Eigen::AlignedBox3d read_box(files::JsonObject box) {
  const Eigen::Vector3d min = box.vector3("min", kCoordinate);
  const Eigen::Vector3d max = box.vector3("max", kCoordinate);
  if ((min.array() > max.array()).any()) box.problem("max", "is below min in a component; swap them");
  box.finish();
  return {min, max};
}

FixedRegion read_fixed(files::JsonObject object) {
  FixedRegion region;
  region.pointer = object.pointer();
  if (auto box = object.object("box", false)) region.box = read_box(*box);
  if (auto box = object.object("outside_box", false)) region.outside_box = read_box(*box);
  if (auto plane = object.object("plane", false)) {
    const Eigen::Vector3d point = plane->vector3("point", kCoordinate);
    region.plane.emplace(direction(*plane, "normal", Eigen::Vector3d::UnitZ()), point);
    plane->finish();
  }
  region.near = object.texts("near");
  region.distance = object.number("distance_mm", {0, 200}, 5) * 1e-3;
  region.breathing = object.vector3("breathing_mm", {-50, 50}, Eigen::Vector3d::Zero()) * 1e-3;
  if (!region.box && !region.outside_box && !region.plane && region.near.empty()) {
    object.problem("", "names no region; add box, outside_box, plane or near");
  }
  object.finish();
  return region;
}

BodyRequest read_body(files::JsonObject object) {
  BodyRequest body;
  body.pointer = object.pointer();
  body.name = object.text("name");
  body.boundary = object.text("boundary", body.name);
  body.carries = object.texts("carries");
  if (auto mesh = object.object("mesh")) {
    const bool cell = mesh->has("cell_mm");
    const bool count = mesh->has("target_nodes");
    body.cell = mesh->number("cell_mm", {1, 100}, 0) * 1e-3;
    body.target_nodes = mesh->integer("target_nodes", 50, 50000, body.target_nodes);
    if (cell == count) mesh->problem("", "needs either cell_mm or target_nodes; keep one");
    mesh->finish();
  }
  for (files::JsonObject& region : object.objects("fixed")) body.fixed.push_back(read_fixed(region));
  object.finish();
  return body;
}

TargetRequest read_target(files::JsonObject object) {
  TargetRequest target;
  target.pointer = object.pointer();
  target.name = object.text("name");
  target.organ = object.text("organ", "");
  const bool centre = object.has("centre");
  if (centre != target.organ.empty()) object.problem("", "needs either organ, or centre and radius_mm; keep one");
  target.centre = object.vector3("centre", kCoordinate, Eigen::Vector3d::Zero());
  target.radius = object.number("radius_mm", {0.5, 200}, 10) * 1e-3;
  object.finish();
  return target;
}

content::Criterion read_criterion(files::JsonObject& object) {
  content::Criterion criterion;
  criterion.metric = object.text("metric");
  std::set<std::string> names(content::kMetricNames.begin(), content::kMetricNames.end());
  for (const procedures::KindMetric& metric : procedures::metrics()) names.emplace(metric.name);
  if (!criterion.metric.empty() && !names.contains(criterion.metric)) {
    const std::string close = files::nearest(criterion.metric, names);
    object.problem("metric", fmt::format("\"{}\" is no metric; {}", criterion.metric,
                                         close.empty() ? "content/README.md lists them"
                                                       : fmt::format("did you mean \"{}\"?", close)));
  }
  criterion.full = object.number("full", kThreshold);
  criterion.zero = object.number("zero", kThreshold);
  if (criterion.full == criterion.zero && object.has("full") && object.has("zero")) {
    object.problem("zero", "is the same as full; move them apart, points fall from one to the other");
  }
  criterion.weight = object.number("weight", {0, 1000}, 1);
  criterion.critical = object.boolean("critical", false);
  object.ignore("source");
  object.finish();
  return criterion;
}

void read_scoring(files::JsonObject& root, ScenarioFile& scenario) {
  double weights = 0;
  for (files::JsonObject& object : root.objects("scoring", false)) {
    const content::Criterion criterion = read_criterion(object);
    if (std::ranges::find(scenario.scoring, criterion.metric, &content::Criterion::metric) !=
        scenario.scoring.end()) {
      object.problem("metric", fmt::format("\"{}\" is scored by an earlier entry; keep one", criterion.metric));
    }
    scenario.scoring.push_back(criterion);
    weights += criterion.weight;
  }
  if (!scenario.scoring.empty() && !(weights > 0)) {
    root.problem("scoring", "has no weight above 0; there must be points for something");
  }
  scenario.pass_mark = root.number("pass_mark", {0, 100}, scenario.pass_mark);
  scenario.forbidden = root.texts("forbidden");
  if (scenario.forbidden.size() > content::kMaxForbidden) {
    root.problem("forbidden",
                 fmt::format("has {} organs, the limit is {}", scenario.forbidden.size(), content::kMaxForbidden));
  }
}

content::Camera read_camera(files::JsonObject object, const Eigen::Isometry3d& room_from_patient) {
  content::Camera camera;
  const bool room = object.choice("frame", {"patient", "room"}, "patient") == "room";
  camera.eye = object.vector3("eye", kCoordinate);
  camera.look_at = object.vector3("look_at", kCoordinate);
  camera.up = direction(object, "up", Eigen::Vector3d::UnitY());
  camera.vertical_fov = object.number("vertical_fov_deg", {5, 120}, 35) * kDegree;
  if (room) {
    const Eigen::Isometry3d patient_from_room = room_from_patient.inverse();
    camera.eye = patient_from_room * camera.eye;
    camera.look_at = patient_from_room * camera.look_at;
    camera.up = patient_from_room.linear() * camera.up;
  }
  const Eigen::Vector3d forward = camera.look_at - camera.eye;
  if (forward.norm() < 1e-3) {
    object.problem("look_at", "is where eye is; move one of them");
  } else if (forward.normalized().cross(camera.up).norm() < 1e-3) {
    object.problem("up", "is along the view; choose another");
  }
  object.finish();
  return camera;
}

std::vector<std::array<double, 2>> read_holds(files::JsonObject& breathing) {
  std::vector<std::array<double, 2>> holds;
  const nlohmann::json* list = breathing.array("holds", false);
  if (list == nullptr) return holds;
  double last = 0;
  for (const nlohmann::json& entry : *list) {
    const bool pair = entry.is_array() && entry.size() == 2 && entry[0].is_number() && entry[1].is_number();
    const double from = pair ? entry[0].get<double>() : 0;
    const double to = pair ? entry[1].get<double>() : 0;
    if (!pair || !(from >= last) || !(to > from) || to > kLongestSession) {
      breathing.problem("holds", fmt::format("entry {} is not [from_s, to_s] between the hold before it and {:.0f}; "
                                             "correct it",
                                             holds.size(), kLongestSession));
      return {};
    }
    holds.push_back({from, to});
    last = to;
  }
  return holds;
}

LabelRequest read_labels(files::JsonObject object) {
  LabelRequest labels;
  labels.spacing = object.number("spacing_mm", {0.3, 20}, 1) * 1e-3;
  labels.filler = object.text("filler", "");
  labels.behind = object.text("behind", "");
  labels.front = direction(object, "front", Eigen::Vector3d::UnitZ());
  if (std::abs(labels.front.cwiseAbs().maxCoeff() - 1) > 1e-9) {
    object.problem("front", "is not along an axis; write e.g. [0, 0, 1]");
  }
  if (labels.filler.empty() != labels.behind.empty()) {
    object.problem("", "has only one of filler and behind; add the other");
  }
  object.finish();
  return labels;
}

}  // namespace

ScenarioFile read_scenario_file(files::JsonFile& file) {
  files::JsonObject root = file.root("stylet-scenario", 1);
  ScenarioFile scenario;
  scenario.path = file.path();
  scenario.name = root.text("name");
  scenario.title = root.text("title", scenario.name);
  for (const char* key : {"description", "licence", "source"}) root.ignore(key);
  scenario.tissues = root.file("tissues");
  scenario.needle = root.file("needle");
  scenario.motion = root.file("motion");
  for (files::JsonObject& organ : root.objects("organs")) scenario.organs.push_back(read_organ_file(organ));

  std::set<std::string> names;
  for (files::JsonObject& object : root.objects("bodies")) {
    scenario.bodies.push_back(read_body(object));
    if (!names.insert(scenario.bodies.back().name).second) {
      object.problem("name", "is used by an earlier body; rename one");
    }
  }
  if (root.has("bodies") && scenario.bodies.empty()) root.problem("bodies", "is empty; a scenario needs one body");
  if (scenario.bodies.size() > physics::kMaxBodies) {
    root.problem("bodies",
                 fmt::format("has {} bodies, the limit is {}", scenario.bodies.size(), physics::kMaxBodies));
  }
  read_probe_pose(root, scenario);
  root.ignore("probe");
  read_contacts(root, scenario);
  for (files::JsonObject& target : root.objects("targets", false)) scenario.targets.push_back(read_target(target));
  read_scoring(root, scenario);

  // Supine: the patient's front (+Z) is up (+Y) in the room, the head (+Y) points away (-Z).
  const double half = std::sqrt(0.5);
  scenario.room_from_patient.linear() = Eigen::Quaterniond(half, -half, 0, 0).toRotationMatrix();
  if (auto room = root.object("room_from_patient", false)) {
    scenario.room_from_patient = pose(*room, Eigen::Quaterniond(scenario.room_from_patient.linear()));
    room->finish();
  }
  if (auto camera = root.object("camera")) scenario.camera = read_camera(*camera, scenario.room_from_patient);
  if (auto labels = root.object("labels", false)) scenario.labels = read_labels(*labels);
  if (auto rates = root.object("rates", false)) {
    scenario.rates.haptic_hz =
        rates->number("haptic_hz", {content::kMinHapticHz, content::kMaxHapticHz}, scenario.rates.haptic_hz);
    scenario.rates.simulation_hz = rates->number("simulation_hz", {1, 1000}, scenario.rates.simulation_hz);
    if (!scenario.rates.in_lockstep()) {
      rates->problem("", "haptic_hz is not a whole multiple of simulation_hz; lockstep needs that");
    }
    rates->finish();
  }
  scenario.coupling = root.choice("coupling", {"stylet", "paper-updated", "paper-frozen"}, "stylet");
  scenario.shaft_friction = root.choice("shaft_friction", {"coulomb", "lugre"}, "coulomb");
  scenario.contact_spacing = root.number("contact_spacing_mm", {1, 100}, 10) * 1e-3;
  if (auto breathing = root.object("breathing", false)) {
    scenario.breathing.amplitude = breathing->number("amplitude", {0, 2}, 1);
    scenario.breathing.period = breathing->number("period_s", {1, 30}, scenario.breathing.period);
    scenario.breathing.holds = read_holds(*breathing);
    if (auto rigid = breathing->object("rigid", false)) {
      scenario.breathing_organs = rigid->texts("organs");
      scenario.breathing.rigid_motion = rigid->vector3("breathing_mm", {-50, 50}) * 1e-3;
      rigid->finish();
    }
    breathing->finish();
  }
  scenario.exercise = read_exercise(root);
  scenario.damping_time_s = root.number("damping_time_s", {0, 10}, 0);
  scenario.gravity = root.number("gravity_m_per_s2", {0, 20}, 0);
  root.finish();
  return scenario;
}

}  // namespace stylet::readers
