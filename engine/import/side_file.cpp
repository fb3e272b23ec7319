#include "engine/import/side_file.h"

#include "engine/gltf/gltf.h"
#include "physics/messages/messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace stylet::import {

namespace key = files::key;
using files::JsonFile;
using files::JsonObject;
using files::Key;
using files::table_of;

namespace {

constexpr files::Range kCoordinate{-100, 100};  // m, as glTF files

/// Keys of whatever deforms.
struct MeshKeys {
  Key cell = key::number("cell_mm", "mm", {1, 100}, "edge of the lattice of its tetrahedra; excludes target_nodes")
                 .optional();
  Key target_nodes;
  Key element = key::choice("element", files::one_of<"linear", "quadratic">,
                            "linear: locks where tissue bends or hardly gives way; quadratic: of ten nodes, does not")
                    .otherwise("linear");
  Key held_by = key::texts("held_by", "organ ids: nodes near them do not move").optional();
  Key held_within = key::number("held_within_mm", "mm", {0, 200}, "how near").otherwise(5);
};

constexpr Key nodes_key(int otherwise) {
  return key::integer("target_nodes", {50, 50000}, "nodes wanted").otherwise(otherwise);
}

constexpr struct {
  Key id = key::text("id", "names the organ; unique");
  Key parts =
      key::texts("parts",
                 "names of parts (glTF nodes, STL solids, OBJ objects, labels), * and ? fit any, upper or lower "
                 "case; of one file or of several in one frame, one piece or several; absent: the id")
          .optional()
          .count({1, -1});
  Key role = key::choice("role", gltf::organ_roles, "region, vessel and target lie in the body they name")
                 .otherwise("boundary");
  Key tissue =
      key::text("tissue",
                "row of the tissue table; outside is air: lung, bowel gas; absent: the file's annotation, else "
                "the id")
          .optional();
  Key body = key::text("body", "deformable organ, or the wall, that carries it; absent: rigid").optional();
  Key deformable =
      key::boolean("deformable", "becomes a body of its own, held where the end of the scan cuts it, too")
          .otherwise(false);
  Key priority = key::integer("priority", {-1000, 1000},
                              "where organs overlap the higher one counts; equal: the later in the list")
                     .otherwise(0);
  Key within = key::number("within_mm", "mm", {0.5, 100},
                           "only what lies so near to its body is carried; the rest becomes ID_rest, rigid")
                   .optional();
  MeshKeys mesh{.target_nodes = nodes_key(2300)};
  Key held_back = key::number("held_back_percent", "%", {0, 50},
                              "so much of its depth, from the back, does not move: where nothing else holds it")
                      .otherwise(0);
  Key ball =
      key::number("ball_mm", "mm", {4, 80},
                  "no part of a file: a ball of this diameter is made up, in its body where a needle gets to it; "
                  "smaller, down to half, where there is no room")
          .optional();
} kOrgan;

constexpr struct {
  Key min = key::vector("min", "m", kCoordinate, "lower corner");
  Key max = key::vector("max", "m", kCoordinate, "upper corner");
} kField;

constexpr struct {
  Key tissue = key::text("tissue", "row of the tissue table");
  Key thickness =
      key::number("thickness_mm", "mm", {0.5, 200}, "of all but the last, which reaches the inner face").optional();
} kLayer;

constexpr struct {
  Key id = key::text("id", "names it").otherwise("abdominal_wall");
  Key skin =
      key::text("skin", "organ id of the surface of the whole body; absent: derived from all that was segmented")
          .optional();
  Key depth = key::number("depth_mm", "mm", {3, 200}, "from the skin to the inner face").otherwise(25);
  Key box = key::object("box", table_of<kField>, "the field, patient frame; excludes radius_mm").optional();
  Key radius = key::number("radius_mm", "mm", {20, 500}, "the field is a ball about the entry").otherwise(80);
  Key layers = key::objects("layers", table_of<kLayer>, "from the skin inwards; absent: skin 2 mm, fat 8 mm, muscle")
                   .optional();
  Key clearance =
      key::number("clearance_mm", "mm", {0, 20}, "between the wall and the organs taken out of it").otherwise(1);
  MeshKeys mesh{.target_nodes = nodes_key(2000)};
  Key filler = key::text("filler", "tissue of the body between the organs; absent: nothing lies there").optional();
} kWall;

constexpr struct {
  Key file = key::text("file", "beside the side file, or the name of one in content/probes").otherwise("c5_2");
  Key at = key::vector("at", "m", kCoordinate,
                       "on the skin, within 15 mm; absent: beside the entry, where it sees the target")
               .optional();
  Key look_at = key::vector("look_at", "m", kCoordinate, "what its image holds; absent: the target").optional();
} kProbe;

constexpr struct {
  Key nodes_of = key::text("nodes_of", "body");
  Key surface_of = key::text("surface_of", "body");
} kContact;

constexpr struct {
  Key name = key::text("name", "short, unique");
  Key title = key::text("title", "one line for people; absent: the name").optional();
  Key source = key::text("source", "where the organs come from, and their licence").optional();
  Key wall = key::object("wall", table_of<kWall>, "the abdominal wall, which no atlas has as an organ");
  Key entry =
      key::vector("entry", "m", kCoordinate,
                  "of the needle, within 15 mm of the skin, moved onto it; absent: the best way to the target")
          .optional();
  Key target = key::text("target", "organ id");
  Key needle =
      key::text("needle", "file beside the side file, or the name of one in content/needles").otherwise("18g_150mm");
  Key probe = key::object("probe", table_of<kProbe>,
                          "it lies flat on the skin, turned so that its image holds the needle, coming from the left")
                  .optional();
  Key contacts = key::objects("contacts", table_of<kContact>,
                              "bodies that slide on each other; absent: every deformable organ against the wall")
                     .optional();
  Key label_spacing = key::number("label_spacing_mm", "mm", {0.3, 20}, "of the label volume").otherwise(1);
} kScenario;

constexpr struct {
  Key licence = key::kLicence;
  Key description = key::note("description", "for people");
  Key organs =
      key::objects("organs", table_of<kOrgan>, "later ones lie inside or in front of earlier ones").count({1, -1});
  Key scenario = key::object("scenario", table_of<kScenario>,
                             "what makes a whole scenario of the organs; absent: the organs alone")
                     .optional();
} kSide;

/// Also the name of a folder or a node: no slash, no leading dot, something.
std::string read_id(JsonObject& object, const Key& key) {
  const std::string id = object.text(key);
  if (object.has(key) && (id.empty() || id.front() == '.' || id.find('/') != std::string::npos)) {
    object.problem(key, "is no id; write a word without slashes that does not begin with a dot");
  }
  return id;
}

void read_mesh(JsonObject& object, const MeshKeys& keys, double& cell, int& target_nodes, physics::Element& element) {
  if (object.has(keys.cell) && object.has(keys.target_nodes)) {
    object.problem(keys.cell, "and target_nodes exclude each other; keep one");
  }
  cell = object.number(keys.cell, 0) * 1e-3;
  target_nodes = object.integer(keys.target_nodes);
  if (object.choice(keys.element) == "quadratic") element = physics::Element::quadratic;
}

void read_holds(JsonObject& object, const MeshKeys& keys, std::vector<std::string>& held_by, double& held_within) {
  held_by = object.texts(keys.held_by);
  held_within = object.number(keys.held_within) * 1e-3;
}

SideOrgan read_organ(JsonObject object) {
  SideOrgan organ;
  organ.pointer = object.pointer();
  organ.id = read_id(object, kOrgan.id);
  organ.parts = object.texts(kOrgan.parts, {organ.id});
  if (object.has(kOrgan.parts) && organ.parts.empty())
    object.problem(kOrgan.parts, "is empty; name a part, * and ? fit any");
  organ.role = object.choice(kOrgan.role);
  organ.tissue = object.text(kOrgan.tissue);
  organ.body = object.text(kOrgan.body);
  organ.deformable = object.boolean(kOrgan.deformable);
  organ.priority = object.integer(kOrgan.priority);
  const double within = object.number(kOrgan.within, 0);
  if (within > 0) organ.within = within * 1e-3;
  read_mesh(object, kOrgan.mesh, organ.cell, organ.target_nodes, organ.element);
  read_holds(object, kOrgan.mesh, organ.held_by, organ.held_within);
  organ.held_back = object.number(kOrgan.held_back) * 1e-2;
  organ.ball = object.number(kOrgan.ball, 0) * 1e-3;
  if (organ.ball > 0 && organ.body.empty()) object.problem(kOrgan.ball, "lies in a body; add body");
  if (organ.ball > 0 && object.has(kOrgan.parts)) object.problem(kOrgan.ball, "is no part of a file; remove parts");
  if (organ.deformable && organ.role != "boundary") {
    object.problem(kOrgan.role, "of what is deformable is boundary; correct one of the two");
  }
  if (organ.deformable && !organ.body.empty()) {
    object.problem(kOrgan.body, "carries what does not deform itself; remove body or deformable");
  }
  if (organ.within && organ.body.empty()) {
    object.problem(kOrgan.within, "says how much of it a body carries; add body");
  }
  if (!organ.deformable && object.has(kOrgan.held_back)) {
    object.problem(kOrgan.held_back, "is for what deforms; add \"deformable\": true");
  }
  for (const Key& key : files::keys_of(kOrgan.mesh)) {
    if (!organ.deformable && object.has(key)) object.problem(key, "is for what deforms; add \"deformable\": true");
  }
  object.finish();
  return organ;
}

SideWall read_wall(JsonFile& file, JsonObject object) {
  SideWall wall;
  wall.pointer = object.pointer();
  wall.id = read_id(object, kWall.id);
  wall.skin = object.text(kWall.skin);
  wall.depth = object.number(kWall.depth) * 1e-3;
  if (auto box = object.object(kWall.box)) {
    const Eigen::Vector3d min = box->vector3(kField.min);
    const Eigen::Vector3d max = box->vector3(kField.max);
    if ((min.array() >= max.array()).any())
      box->problem(kField.max, "is not above min in every component; correct one");
    wall.box.emplace(min, max);
    box->finish();
    if (object.has(kWall.radius)) object.problem(kWall.radius, "and box exclude each other; keep one");
  }
  wall.radius = object.number(kWall.radius) * 1e-3;
  for (JsonObject& layer : object.objects(kWall.layers)) {
    wall.layers.push_back({.pointer = layer.pointer(),
                           .tissue = layer.text(kLayer.tissue),
                           .thickness = layer.number(kLayer.thickness, 0) * 1e-3});
    layer.finish();
  }
  if (wall.layers.empty()) {
    wall.layers = {{.pointer = wall.pointer, .tissue = "skin", .thickness = 0.002},
                   {.pointer = wall.pointer, .tissue = "fat", .thickness = 0.008},
                   {.pointer = wall.pointer, .tissue = "muscle", .thickness = 0}};
  }
  double from = 0;
  for (std::size_t i = 0; i < wall.layers.size(); ++i) {
    const bool last = i + 1 == wall.layers.size();
    if (last != (wall.layers[i].thickness == 0)) {
      file.add_problem(wall.layers[i].pointer, last ? "is the last and reaches the inner face; remove thickness_mm"
                                                    : "needs thickness_mm; only the last layer goes without");
    }
    if (from >= wall.depth) {
      file.add_problem(
          wall.layers[i].pointer,
          fmt::format("begins {:.3g} mm below the skin, but the wall ends at its depth_mm of {:.3g}; make "
                      "the layers before it thinner or the wall deeper",
                      from * 1e3, wall.depth * 1e3));
    }
    from += wall.layers[i].thickness;
  }
  wall.clearance = object.number(kWall.clearance) * 1e-3;
  read_mesh(object, kWall.mesh, wall.cell, wall.target_nodes, wall.element);
  read_holds(object, kWall.mesh, wall.held_by, wall.held_within);
  wall.filler = object.text(kWall.filler);
  object.finish();
  return wall;
}

SideScenario read_scenario(JsonFile& file, JsonObject object) {
  SideScenario scenario;
  scenario.pointer = object.pointer();
  scenario.name = read_id(object, kScenario.name);
  scenario.title = object.text(kScenario.title, scenario.name);
  scenario.source = object.text(kScenario.source);
  if (auto wall = object.object(kScenario.wall)) scenario.wall = read_wall(file, *wall);
  const Eigen::Vector3d entry = object.vector3(kScenario.entry);
  if (object.has(kScenario.entry)) scenario.entry = entry;
  scenario.target = object.text(kScenario.target);
  scenario.needle = object.text(kScenario.needle);
  if (auto probe = object.object(kScenario.probe)) {
    scenario.probe.file = probe->text(kProbe.file);
    const Eigen::Vector3d at = probe->vector3(kProbe.at);
    if (probe->has(kProbe.at)) scenario.probe.at = at;
    const Eigen::Vector3d look_at = probe->vector3(kProbe.look_at);
    if (probe->has(kProbe.look_at)) scenario.probe.look_at = look_at;
    probe->finish();
  }
  if (object.has(kScenario.contacts)) {
    scenario.contacts.emplace();
    for (JsonObject& contact : object.objects(kScenario.contacts)) {
      scenario.contacts->push_back({.pointer = contact.pointer(),
                                    .nodes_of = contact.text(kContact.nodes_of),
                                    .surface_of = contact.text(kContact.surface_of)});
      contact.finish();
    }
  }
  scenario.label_spacing = object.number(kScenario.label_spacing) * 1e-3;
  object.finish();
  return scenario;
}

/// Ids that a side file names, against those it has.
class Ids {
public:
  Ids(JsonFile& file, const SideFile& side) : file_(file) {
    for (const SideOrgan& organ : side.organs) {
      if (!organ.id.empty() && !organs_.insert(organ.id).second) {
        file.add_problem(organ.pointer + "/id", "is used by an earlier organ; rename one, or name all parts in one");
      }
      if (organ.deformable) bodies_.insert(organ.id);
    }
    if (!side.scenario) return;
    const SideWall& wall = side.scenario->wall;
    if (organs_.contains(wall.id)) file.add_problem(wall.pointer + "/id", "is that of an organ; choose another");
    bodies_.insert(wall.id);
  }
  void organ(const std::string& pointer, const std::string& id) const { demand(pointer, id, organs_, "an organ"); }
  void body(const std::string& pointer, const std::string& id) const { demand(pointer, id, bodies_, "deformable"); }
  std::size_t bodies() const { return bodies_.size(); }

private:
  void demand(const std::string& pointer, const std::string& id, const std::set<std::string>& ids,
              const char* what) const {
    if (id.empty() || ids.contains(id)) return;
    const std::string close = files::nearest(id, ids);
    file_.add_problem(pointer, fmt::format("\"{}\" is not {} of this file{}", id, what,
                                           close.empty() ? "; correct it" : "; did you mean \"" + close + "\"?"));
  }
  JsonFile& file_;
  std::set<std::string> organs_;
  std::set<std::string> bodies_;
};

void check_ids(JsonFile& file, const SideFile& side) {
  const Ids ids(file, side);
  for (const SideOrgan& organ : side.organs) {
    if (side.scenario) ids.body(organ.pointer + "/body", organ.body);
    for (std::size_t i = 0; i < organ.held_by.size(); ++i) {
      ids.organ(fmt::format("{}/held_by/{}", organ.pointer, i), organ.held_by[i]);
    }
  }
  if (!side.scenario) return;
  const SideScenario& scenario = *side.scenario;
  ids.organ(scenario.wall.pointer + "/skin", scenario.wall.skin);
  for (std::size_t i = 0; i < scenario.wall.held_by.size(); ++i) {
    ids.organ(fmt::format("{}/held_by/{}", scenario.wall.pointer, i), scenario.wall.held_by[i]);
  }
  ids.organ(scenario.pointer + "/target", scenario.target);
  if (ids.bodies() > physics::kMaxBodies) {
    file.add_problem("/organs", fmt::format("has {} deformable organs with the wall, the limit is {}; let some be "
                                            "rigid",
                                            ids.bodies(), physics::kMaxBodies));
  }
  if (!scenario.contacts) return;
  for (const SideContact& contact : *scenario.contacts) {
    ids.body(contact.pointer + "/nodes_of", contact.nodes_of);
    ids.body(contact.pointer + "/surface_of", contact.surface_of);
    if (contact.nodes_of == contact.surface_of) file.add_problem(contact.pointer, "names one body twice; name two");
  }
}

}  // namespace

const files::FileFormat& side_file_format() {
  static const files::FileFormat format{.name = "import",
                                        .title = "How organs of other programs become a scenario; patient frame",
                                        .table = table_of<kSide>,
                                        .id = "stylet-import"};
  return format;
}

SideFile read_side_file(JsonFile& file) {
  JsonObject root = file.root(side_file_format());
  SideFile side;
  side.path = file.path();
  for (JsonObject& organ : root.objects(kSide.organs)) side.organs.push_back(read_organ(organ));
  if (root.has(kSide.organs) && side.organs.empty()) root.problem(kSide.organs, "is empty; name an organ");
  if (auto scenario = root.object(kSide.scenario)) side.scenario = read_scenario(file, *scenario);
  root.finish();
  check_ids(file, side);
  return side;
}

}  // namespace stylet::import
