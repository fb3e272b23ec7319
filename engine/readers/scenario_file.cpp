#include "engine/readers/scenario_file.h"

#include "engine/procedures/kinds.h"
#include "engine/readers/exercise_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace stylet::readers {

namespace key = files::key;
using files::Key;
using files::Names;
using files::table_of;

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr files::Range kCoordinate{-kPatientExtent, kPatientExtent};
constexpr files::Range kComponent{-1e3, 1e3};
constexpr files::Range kThreshold{-1e6, 1e6};
constexpr double kLongestSession = 86400;  // s
constexpr files::Range kBreath{-50, 50};   // mm

Names metric_names() {
  Names names;
  for (const content::MetricRow& metric : procedures::metric_table()) names.push_back(metric.name);
  return names;
}

// ---- the keys, in the order of the schema

constexpr struct {
  Key file = key::file("file", "stylet-probe file");
  Key position = key::vector("position", "m", kCoordinate,
                             "centre of the face; more than 10 mm from the skin, or turned away from it, warns");
  Key orientation = key::quaternion("orientation", "patient from probe; or axis and lateral in its place").optional();
  Key axis = key::vector("axis", "", kComponent, "probe +Z, into the body, any length").optional();
  Key lateral =
      key::vector("lateral", "", kComponent, "probe +X, image right, made perpendicular to axis").optional();
  Key presses = key::text("presses", "body that its head is held against; absent: it touches nothing").optional();
  Key gel =
      key::boolean("gel",
                   "between head and skin: the head glides (friction 0.05); without it dry skin is dragged along "
                   "(0.5), and the image is dark where head and skin are apart")
          .otherwise(true);
} kHeldProbe;

constexpr struct {
  Key id = key::text("id", "organ id; absent: the node's name").optional();
  Key role = key::choice("role", gltf::organ_roles, "as in the annotations").optional();
  Key body = key::text("body", "deformable body that carries it").optional();
  Key tissue = key::text("tissue", "row of the tissue table").optional();
} kNode;

constexpr struct {
  Key file = key::file("file", "glTF 2.0 file");
  Key position = key::vector("position", "m", kCoordinate, "p_patient = position + orientation * scale * p_file")
                     .otherwise(0, 0, 0);
  Key orientation = key::quaternion("orientation", "patient from file").otherwise(1, 0, 0, 0);
  Key scale = key::number("scale", "", {1e-4, 1e4}, "0.001 for files in millimetres").otherwise(1);
  Key nodes = key::entries("nodes", table_of<kNode>, "by node name: what the file itself does not say, or says wrong")
                  .optional();
} kOrgan;

constexpr struct {
  Key cell = key::number("cell_mm", "mm", {1, 100}, "edge of the lattice cell").either();
  Key target_nodes =
      key::integer("target_nodes", {50, 50000}, "the cell is found for about this many nodes").either();
  Key element = key::choice("element", files::one_of<"linear", "quadratic">,
                            "linear: locks where tissue bends or hardly gives way; quadratic: of ten nodes, does not")
                    .otherwise("linear");
} kMesh;

constexpr struct {
  Key min = key::vector("min", "m", kCoordinate, "lower corner");
  Key max = key::vector("max", "m", kCoordinate, "upper corner");
} kBox;

constexpr struct {
  Key point = key::vector("point", "m", kCoordinate, "on the plane");
  Key normal = key::vector("normal", "", kComponent, "any length").otherwise(0, 0, 1);
} kPlane;

constexpr struct {
  Key box = key::object("box", table_of<kBox>, "inside").optional();
  Key outside_box = key::object("outside_box", table_of<kBox>, "outside").optional();
  Key plane = key::object("plane", table_of<kPlane>, "on the side of its normal").optional();
  Key near = key::texts("near", "organ ids, one of them within distance_mm").optional();
  Key distance = key::number("distance_mm", "mm", {0, 200}, "for near").otherwise(5);
  Key breathing =
      key::vector("breathing_mm", "mm", kBreath, "how these nodes move from expiration to full inspiration")
          .otherwise(0, 0, 0);
} kFixed;

constexpr struct {
  Key name = key::text("name", "unique; glTF nodes name it in organ.body");
  Key boundary = key::text("boundary", "organ id of the surface to tetrahedralise; absent: the name").optional();
  Key carries = key::texts("carries", "organ ids it carries, besides those whose annotation names it").optional();
  Key mesh = key::object("mesh", table_of<kMesh>, "size of its tetrahedra");
  Key fixed = key::objects("fixed", table_of<kFixed>,
                           "regions: nodes that meet every condition of one are held, at least 3 in all");
} kBody;

constexpr struct {
  Key name = key::text("name", "shown to the user");
  Key organ = key::text("organ", "organ id: centre and radius are those of its volume").either();
  Key centre = key::vector("centre", "m", kCoordinate, "with radius_mm").either();
  Key radius = key::number("radius_mm", "mm", {0.5, 200}, "of a centre").otherwise(10);
} kTarget;

constexpr struct {
  Key metric = key::choice("metric", metric_names, "its name; each metric once");
  Key full = key::number("full", "", kThreshold, "all points here and beyond, in the metric's unit");
  Key zero = key::number("zero", "", kThreshold, "none here and beyond, linear between; not the same as full");
  Key weight = key::number("weight", "", {0, 1000}, "share of the total").otherwise(1);
  Key critical = key::boolean("critical", "no points here: failed, whatever the total").otherwise(false);
  Key source = key::kSource;
} kCriterion;

constexpr struct {
  Key spacing =
      key::number("spacing_mm", "mm", {0.3, 20}, "of the voxels; grows until labels fit 64 MB").otherwise(1);
  Key filler = key::text("filler", "tissue between the organs, behind the wall").optional();
  Key behind = key::text("behind", "organ id of the wall; needed with filler").optional();
  Key front = key::vector("front", "", kComponent, "axis from the filler to the wall").otherwise(0, 0, 1);
} kLabels;

constexpr struct {
  Key frame = key::choice("frame", files::one_of<"patient", "room">, "of the coordinates").otherwise("patient");
  Key eye = key::vector("eye", "m", kCoordinate, "where it is");
  Key look_at = key::vector("look_at", "m", kCoordinate, "in the middle of the picture");
  Key up = key::vector("up", "", kComponent, "any length").otherwise(0, 1, 0);
  Key vertical_fov = key::number("vertical_fov_deg", "degrees", {5, 120}, "field of view").otherwise(35);
} kCamera;

constexpr struct {
  Key position = key::vector("position", "m", kCoordinate, "of the patient's origin").otherwise(0, 0, 0);
  Key orientation = key::quaternion("orientation", "room from patient; absent: supine").optional();
} kRoom;

constexpr struct {
  Key haptic = key::number("haptic_hz", "Hz", {content::kMinHapticHz, content::kMaxHapticHz}, "of the haptic loop")
                   .otherwise(content::LoopRates{}.haptic_hz);
  Key simulation = key::number("simulation_hz", "Hz", {1, 1000}, "of the simulation loop")
                       .otherwise(content::LoopRates{}.simulation_hz);
} kRates;

constexpr struct {
  Key peak = key::number("peak_n", "N", {0.1, 100}, "the largest; a device that gives less gets all forces smaller");
  Key held = key::number("held_n", "N", {0, 100}, "root of the mean square over 10 s, as motors warm; 0: not said")
                 .otherwise(0);
} kHandForce;

constexpr struct {
  Key entry = key::number("entry_off_mm", "mm", {0, 100}, "the tip waits up to so far beside where the motion begins")
                  .otherwise(0);
  Key aim = key::numbers("aim_off_mm", 2, "mm", {0, 200},
                         "the needle points so far beside the first target, [least, most]; more than its radius: "
                         "nobody hits it by going straight on")
                .optional();
  Key probe =
      key::numbers("probe_off_mm", 2, "mm", {0, 200}, "the probe lies so far from where it is held, [least, most]")
          .optional();
  Key turned = key::number("probe_turned_deg", "degrees", {0, 90}, "and is turned by up to so much about its axis")
                   .otherwise(0);
} kStart;

constexpr struct {
  Key nodes_of = key::text("nodes_of", "a body, best the one with the finer mesh");
  Key surface_of = key::text("surface_of", "another body");
} kContact;

constexpr struct {
  Key organs = key::texts("organs", "their ids");
  Key breathing = key::vector("breathing_mm", "mm", kBreath, "how far at full inspiration");
} kRigidBreathing;

constexpr struct {
  Key amplitude =
      key::number("amplitude", "", {0, 2}, "1: as breathing_mm of the fixed regions say; 0: held").otherwise(1);
  Key period = key::number("period_s", "s", {1, 30}, "of a breath").otherwise(4);
  Key holds =
      key::rows("holds", {2, 2}, {0, kLongestSession},
                "breath held at end-expiration: [from_s, to_s], ascending and apart; as many whole breaths as "
                "fit best are taken between them")
          .optional();
  Key rigid =
      key::object("rigid", table_of<kRigidBreathing>, "organs that no body carries and that go with the breath")
          .optional();
} kBreathing;

constexpr struct {
  Key name = key::text("name", "short, unique");
  Key title = key::text("title", "one line for people; absent: the name").optional();
  Key description = key::note("description", "for people");
  Key licence = key::kLicence;
  Key source = key::kSource;
  Key tissues = key::file("tissues", "stylet-tissues file");
  Key needle = key::file("needle", "stylet-needle file");
  Key motion = key::file("motion", "stylet-motion file");
  Key probe =
      key::object("probe", table_of<kHeldProbe>, "the probe and where it is held; a first image that is black warns");
  Key organs = key::objects("organs", table_of<kOrgan>,
                            "glTF files and where they are put; where organs overlap the later one counts");
  Key bodies = key::objects("bodies", table_of<kBody>, "what deforms").count({1, physics::kMaxBodies});
  Key targets = key::objects("targets", table_of<kTarget>, "what the tip must reach").optional();
  Key forbidden =
      key::texts("forbidden",
                 "organ ids that the needle must not enter; where organs overlap the later one counts, so "
                 "that a gallbladder does not count for its lumen")
          .count({0, content::kMaxForbidden})
          .optional();
  Key scoring = key::objects("scoring", table_of<kCriterion>,
                             "points for what the metrics say; absent: the session is measured, not scored")
                    .optional();
  Key pass_mark = key::number("pass_mark", "", {0, 100}, "of 100").otherwise(70);
  Key labels =
      key::object("labels", table_of<kLabels>, "the volume of tissue labels that ultrasound looks up").optional();
  Key camera = key::object("camera", table_of<kCamera>, "of the 3-D view");
  Key room = key::object("room_from_patient", table_of<kRoom>, "absent: supine, anterior up").optional();
  Key rates = key::object("rates", table_of<kRates>, "of the loops; haptic_hz is a whole multiple of simulation_hz")
                  .optional();
  Key coupling =
      key::choice("coupling", files::one_of<"stylet", "paper-updated", "paper-trajectory", "paper-frozen">,
                  "of needle and tissue: ours; the paper's with directions normal to the needle's edges, or to "
                  "the line of the contact points (III-C); the one before, with directions kept")
          .otherwise("stylet");
  Key shaft_friction =
      key::choice("shaft_friction", files::one_of<"coulomb", "lugre">,
                  "coupling stylet: coulomb sticks, then slips; lugre has bristles that bend and slip")
          .otherwise("coulomb");
  Key hand_force = key::object("hand_force", table_of<kHandForce>,
                               "what ordinary use puts on the hand; absent: a stylus gets the force as it is")
                       .optional();
  Key start = key::object("start", table_of<kStart>,
                          "where a trainee finds needle and probe, drawn anew each time (a demonstration begins as "
                          "the motion does); absent: aimed at the target, the probe where it is held")
                  .optional();
  Key contact_spacing =
      key::number("contact_spacing_mm", "mm", {1, 100}, "of contact points along the path").otherwise(10);
  Key damping_time =
      key::number("damping_time_s", "s", {0, 10}, "Kelvin-Voigt: damping = time * stiffness").otherwise(0);
  Key gravity = key::number("gravity_m_per_s2", "m/s^2", {0, 20},
                            "weight of the bodies, down in the room; 0: an organ out of a scan has sagged already")
                    .otherwise(0);
  Key contacts = key::objects("contacts", table_of<kContact>,
                              "bodies that slide on each other without passing through: nodes of one against the "
                              "surface of another")
                     .optional();
  Key breathing = key::object("breathing", table_of<kBreathing>, "quiet breathing; absent: none").optional();
} kScenario;

const files::KeyTable& scenario_table() {
  static const files::KeyTable table = [] {
    files::KeyTable made{.keys = files::keys_of(kScenario)};
    const std::vector<Key> exercise = exercise_keys();
    made.keys.insert(made.keys.end(), exercise.begin(), exercise.end());
    return made;
  }();
  return table;
}

// ---- reading

/// A direction; normalised.
Eigen::Vector3d direction(files::JsonObject& object, const Key& key, const Eigen::Vector3d& fallback) {
  const Eigen::Vector3d v = object.vector3(key, fallback);
  if (v.norm() > 1e-9) return v.normalized();
  object.problem(key, "has no length; write a direction");
  return fallback;
}

Eigen::Isometry3d pose(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translation() = position;
  out.linear() = orientation.toRotationMatrix();
  return out;
}

/// +Z along `axis`, +X as near to `lateral` as that allows.
Eigen::Quaterniond frame(files::JsonObject& object, const Eigen::Vector3d& axis, const Eigen::Vector3d& lateral) {
  const Eigen::Vector3d y = axis.cross(lateral);
  if (y.norm() < 0.05) {
    object.problem(kHeldProbe.lateral, "is parallel to axis; choose one across it");
    return Eigen::Quaterniond::Identity();
  }
  Eigen::Matrix3d rotation;
  rotation.col(1) = y.normalized();
  rotation.col(2) = axis;
  rotation.col(0) = rotation.col(1).cross(axis);
  return Eigen::Quaterniond(rotation).normalized();
}

/// Index of the body that `key` names.
int body_named(files::JsonObject& object, const Key& key, const std::vector<BodyRequest>& bodies) {
  const std::string name = object.text(key);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].name == name) return static_cast<int>(i);
  }
  object.problem(key, fmt::format("\"{}\" is not a body of this scenario; write the name of one", name));
  return -1;
}

void read_contacts(files::JsonObject& root, ScenarioFile& scenario) {
  for (files::JsonObject& contact : root.objects(kScenario.contacts)) {
    const int nodes_of = body_named(contact, kContact.nodes_of, scenario.bodies);
    const int surface_of = body_named(contact, kContact.surface_of, scenario.bodies);
    if (nodes_of == surface_of && nodes_of >= 0) contact.problem("", "names one body twice; name two");
    if (nodes_of >= 0 && surface_of >= 0) scenario.contacts.push_back({nodes_of, surface_of});
    contact.finish();
  }
}

/// [least, most] in mm.
Eigen::Vector2d ring(files::JsonObject& object, const Key& key) {
  const std::vector<double> ends = object.numbers(key, {0, 0});
  if (ends[0] > ends[1]) object.problem(key, "is less at most than at least; write [least, most]");
  return 1e-3 * Eigen::Vector2d(ends[0], ends[1]);
}

content::StartSpread read_start(files::JsonObject& object) {
  const content::StartSpread start{.entry_off = object.number(kStart.entry) * 1e-3,
                                   .aim_off = ring(object, kStart.aim),
                                   .probe_off = ring(object, kStart.probe),
                                   .probe_turned = object.number(kStart.turned) * std::numbers::pi / 180};
  object.finish();
  return start;
}

void read_probe_pose(files::JsonObject& root, ScenarioFile& scenario) {
  auto probe = root.object(kScenario.probe);
  if (!probe) return;
  scenario.probe = probe->file(kHeldProbe.file);
  scenario.probe_pose.position = probe->vector3(kHeldProbe.position);
  const bool quaternion = probe->has(kHeldProbe.orientation);
  scenario.probe_pose.orientation = probe->quaternion(kHeldProbe.orientation, Eigen::Quaterniond::Identity());
  const Eigen::Vector3d axis = direction(*probe, kHeldProbe.axis, -Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d lateral = direction(*probe, kHeldProbe.lateral, Eigen::Vector3d::UnitX());
  if (quaternion == (probe->has(kHeldProbe.axis) || probe->has(kHeldProbe.lateral))) {
    probe->problem("", "needs either orientation, or axis and lateral; keep one");
  } else if (!quaternion) {
    scenario.probe_pose.orientation = frame(*probe, axis, lateral);
  }
  if (!probe->text(kHeldProbe.presses).empty()) {
    scenario.probe_presses = body_named(*probe, kHeldProbe.presses, scenario.bodies);
  }
  scenario.probe_gel = probe->boolean(kHeldProbe.gel);
  probe->finish();
}

OrganFile read_organ_file(files::JsonObject object) {
  OrganFile organ;
  organ.path = object.file(kOrgan.file);
  organ.patient_from_file =
      Eigen::Affine3d(pose(object.vector3(kOrgan.position), object.quaternion(kOrgan.orientation)).matrix());
  organ.patient_from_file.scale(object.number(kOrgan.scale));
  if (auto nodes = object.object(kOrgan.nodes)) {
    for (auto& [name, node] : nodes->entries()) {
      NodeOverride& entry = organ.nodes[name];
      entry.organ.id = node.text(kNode.id, name);
      entry.organ.role = node.choice(kNode.role);
      entry.organ.body = node.text(kNode.body);
      entry.tissue = node.text(kNode.tissue);
      node.finish();
    }
  }
  object.finish();
  return organ;
}

Eigen::AlignedBox3d read_box(files::JsonObject box) {
  const Eigen::Vector3d min = box.vector3(kBox.min);
  const Eigen::Vector3d max = box.vector3(kBox.max);
  if ((min.array() > max.array()).any()) box.problem(kBox.max, "is below min in a component; swap them");
  box.finish();
  return {min, max};
}

FixedRegion read_fixed(files::JsonObject object) {
  FixedRegion region;
  region.pointer = object.pointer();
  if (auto box = object.object(kFixed.box)) region.box = read_box(*box);
  if (auto box = object.object(kFixed.outside_box)) region.outside_box = read_box(*box);
  if (auto plane = object.object(kFixed.plane)) {
    const Eigen::Vector3d point = plane->vector3(kPlane.point);
    region.plane.emplace(direction(*plane, kPlane.normal, Eigen::Vector3d::UnitZ()), point);
    plane->finish();
  }
  region.near = object.texts(kFixed.near);
  region.distance = object.number(kFixed.distance) * 1e-3;
  region.breathing = object.vector3(kFixed.breathing) * 1e-3;
  if (!region.box && !region.outside_box && !region.plane && region.near.empty()) {
    object.problem("", "names no region; add box, outside_box, plane or near");
  }
  object.finish();
  return region;
}

BodyRequest read_body(files::JsonObject object) {
  BodyRequest body;
  body.pointer = object.pointer();
  body.name = object.text(kBody.name);
  body.boundary = object.text(kBody.boundary, body.name);
  body.carries = object.texts(kBody.carries);
  if (auto mesh = object.object(kBody.mesh)) {
    const bool cell = mesh->has(kMesh.cell);
    const bool count = mesh->has(kMesh.target_nodes);
    body.cell = mesh->number(kMesh.cell, 0) * 1e-3;
    body.target_nodes = mesh->integer(kMesh.target_nodes, body.target_nodes);
    if (mesh->choice(kMesh.element) == "quadratic") body.element = physics::Element::quadratic;
    if (cell == count) mesh->problem("", "needs either cell_mm or target_nodes; keep one");
    mesh->finish();
  }
  for (files::JsonObject& region : object.objects(kBody.fixed)) body.fixed.push_back(read_fixed(region));
  object.finish();
  return body;
}

TargetRequest read_target(files::JsonObject object) {
  TargetRequest target;
  target.pointer = object.pointer();
  target.name = object.text(kTarget.name);
  target.organ = object.text(kTarget.organ);
  const bool centre = object.has(kTarget.centre);
  if (centre != target.organ.empty()) object.problem("", "needs either organ, or centre and radius_mm; keep one");
  target.centre = object.vector3(kTarget.centre);
  target.radius = object.number(kTarget.radius) * 1e-3;
  object.finish();
  return target;
}

content::Criterion read_criterion(files::JsonObject& object) {
  content::Criterion criterion;
  criterion.metric = object.text(kCriterion.metric);
  const Names metrics = metric_names();
  const std::set<std::string> names(metrics.begin(), metrics.end());
  if (object.has(kCriterion.metric) && !names.contains(criterion.metric)) {
    const std::string close = files::nearest(criterion.metric, names);
    object.problem(kCriterion.metric, fmt::format("\"{}\" is no metric; {}", criterion.metric,
                                                  close.empty() ? "content/README.md lists them"
                                                                : fmt::format("did you mean \"{}\"?", close)));
  }
  criterion.full = object.number(kCriterion.full);
  criterion.zero = object.number(kCriterion.zero);
  if (criterion.full == criterion.zero && object.has(kCriterion.full) && object.has(kCriterion.zero)) {
    object.problem(kCriterion.zero, "is the same as full; move them apart, points fall from one to the other");
  }
  criterion.weight = object.number(kCriterion.weight);
  criterion.critical = object.boolean(kCriterion.critical);
  object.finish();
  return criterion;
}

void read_scoring(files::JsonObject& root, ScenarioFile& scenario) {
  double weights = 0;
  for (files::JsonObject& object : root.objects(kScenario.scoring)) {
    const content::Criterion criterion = read_criterion(object);
    if (std::ranges::find(scenario.scoring, criterion.metric, &content::Criterion::metric) !=
        scenario.scoring.end()) {
      object.problem(kCriterion.metric,
                     fmt::format("\"{}\" is scored by an earlier entry; keep one", criterion.metric));
    }
    scenario.scoring.push_back(criterion);
    weights += criterion.weight;
  }
  if (!scenario.scoring.empty() && !(weights > 0)) {
    root.problem(kScenario.scoring, "has no weight above 0; there must be points for something");
  }
  scenario.pass_mark = root.number(kScenario.pass_mark);
  scenario.forbidden = root.texts(kScenario.forbidden);
  if (scenario.forbidden.size() > content::kMaxForbidden) {
    root.problem(kScenario.forbidden,
                 fmt::format("has {} organs, the limit is {}", scenario.forbidden.size(), content::kMaxForbidden));
  }
}

content::Camera read_camera(files::JsonObject object, const Eigen::Isometry3d& room_from_patient) {
  content::Camera camera;
  const bool room = object.choice(kCamera.frame) == "room";
  camera.eye = object.vector3(kCamera.eye);
  camera.look_at = object.vector3(kCamera.look_at);
  camera.up = direction(object, kCamera.up, Eigen::Vector3d::UnitY());
  camera.vertical_fov = object.number(kCamera.vertical_fov) * kDegree;
  if (room) {
    const Eigen::Isometry3d patient_from_room = room_from_patient.inverse();
    camera.eye = patient_from_room * camera.eye;
    camera.look_at = patient_from_room * camera.look_at;
    camera.up = patient_from_room.linear() * camera.up;
  }
  const Eigen::Vector3d forward = camera.look_at - camera.eye;
  if (forward.norm() < 1e-3) {
    object.problem(kCamera.look_at, "is where eye is; move one of them");
  } else if (forward.normalized().cross(camera.up).norm() < 1e-3) {
    object.problem(kCamera.up, "is along the view; choose another");
  }
  object.finish();
  return camera;
}

std::vector<std::array<double, 2>> read_holds(files::JsonObject& breathing) {
  std::vector<std::array<double, 2>> holds;
  const nlohmann::json* list = breathing.array(kBreathing.holds);
  if (list == nullptr) return holds;
  double last = 0;
  for (const nlohmann::json& entry : *list) {
    const bool pair = entry.is_array() && entry.size() == 2 && entry[0].is_number() && entry[1].is_number();
    const double from = pair ? entry[0].get<double>() : 0;
    const double to = pair ? entry[1].get<double>() : 0;
    if (!pair || !(from >= last) || !(to > from) || to > kLongestSession) {
      breathing.problem(kBreathing.holds,
                        fmt::format("entry {} is not [from_s, to_s] between the hold before it and {:.0f}; "
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
  labels.spacing = object.number(kLabels.spacing) * 1e-3;
  labels.filler = object.text(kLabels.filler);
  labels.behind = object.text(kLabels.behind);
  labels.front = direction(object, kLabels.front, Eigen::Vector3d::UnitZ());
  if (std::abs(labels.front.cwiseAbs().maxCoeff() - 1) > 1e-9) {
    object.problem(kLabels.front, "is not along an axis; write e.g. [0, 0, 1]");
  }
  if (labels.filler.empty() != labels.behind.empty()) {
    object.problem("", "has only one of filler and behind; add the other");
  }
  object.finish();
  return labels;
}

}  // namespace

const files::FileFormat& scenario_format() {
  static const files::FileFormat format{
      .name = "scenario", .title = "A training scenario", .table = scenario_table, .id = "stylet-scenario"};
  return format;
}

ScenarioTitle read_scenario_title(files::JsonObject& root) {
  const std::string name = root.text(kScenario.name);
  return {name, root.text(kScenario.title, name)};
}

ScenarioFile read_scenario_file(files::JsonFile& file) {
  files::JsonObject root = file.root(scenario_format());
  ScenarioFile scenario;
  scenario.path = file.path();
  const ScenarioTitle title = read_scenario_title(root);
  scenario.name = title.name;
  scenario.title = title.title;
  scenario.tissues = root.file(kScenario.tissues);
  scenario.needle = root.file(kScenario.needle);
  scenario.motion = root.file(kScenario.motion);
  for (files::JsonObject& organ : root.objects(kScenario.organs)) scenario.organs.push_back(read_organ_file(organ));

  std::set<std::string> names;
  for (files::JsonObject& object : root.objects(kScenario.bodies)) {
    scenario.bodies.push_back(read_body(object));
    if (!names.insert(scenario.bodies.back().name).second) {
      object.problem(kBody.name, "is used by an earlier body; rename one");
    }
  }
  if (root.has(kScenario.bodies) && scenario.bodies.empty())
    root.problem(kScenario.bodies, "is empty; a scenario needs one body");
  if (scenario.bodies.size() > physics::kMaxBodies) {
    root.problem(kScenario.bodies,
                 fmt::format("has {} bodies, the limit is {}", scenario.bodies.size(), physics::kMaxBodies));
  }
  read_probe_pose(root, scenario);
  read_contacts(root, scenario);
  for (files::JsonObject& target : root.objects(kScenario.targets)) scenario.targets.push_back(read_target(target));
  read_scoring(root, scenario);

  // Supine: the patient's front (+Z) is up (+Y) in the room, the head (+Y) points away (-Z).
  const double half = std::sqrt(0.5);
  scenario.room_from_patient.linear() = Eigen::Quaterniond(half, -half, 0, 0).toRotationMatrix();
  if (auto room = root.object(kScenario.room)) {
    const Eigen::Quaterniond supine(scenario.room_from_patient.linear());
    scenario.room_from_patient = pose(room->vector3(kRoom.position), room->quaternion(kRoom.orientation, supine));
    room->finish();
  }
  if (auto camera = root.object(kScenario.camera)) scenario.camera = read_camera(*camera, scenario.room_from_patient);
  if (auto labels = root.object(kScenario.labels)) scenario.labels = read_labels(*labels);
  if (auto rates = root.object(kScenario.rates)) {
    scenario.rates.haptic_hz = rates->number(kRates.haptic);
    scenario.rates.simulation_hz = rates->number(kRates.simulation);
    if (!scenario.rates.in_lockstep()) {
      rates->problem("", "haptic_hz is not a whole multiple of simulation_hz; lockstep needs that");
    }
    rates->finish();
  }
  scenario.coupling = root.choice(kScenario.coupling);
  scenario.shaft_friction = root.choice(kScenario.shaft_friction);
  if (auto hand_force = root.object(kScenario.hand_force)) {
    scenario.hand_force = {.peak = hand_force->number(kHandForce.peak), .held = hand_force->number(kHandForce.held)};
    hand_force->finish();
  }
  if (auto start = root.object(kScenario.start)) scenario.start = read_start(*start);
  scenario.contact_spacing = root.number(kScenario.contact_spacing) * 1e-3;
  if (auto breathing = root.object(kScenario.breathing)) {
    scenario.breathing.amplitude = breathing->number(kBreathing.amplitude);
    scenario.breathing.period = breathing->number(kBreathing.period);
    scenario.breathing.holds = read_holds(*breathing);
    if (auto rigid = breathing->object(kBreathing.rigid)) {
      scenario.breathing_organs = rigid->texts(kRigidBreathing.organs);
      scenario.breathing.rigid_motion = rigid->vector3(kRigidBreathing.breathing) * 1e-3;
      rigid->finish();
    }
    breathing->finish();
  }
  scenario.exercise = read_exercise(root);
  scenario.damping_time_s = root.number(kScenario.damping_time);
  scenario.gravity = root.number(kScenario.gravity);
  root.finish();
  return scenario;
}

}  // namespace stylet::readers
