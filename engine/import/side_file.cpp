#include "engine/import/side_file.h"

#include "physics/messages/messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace stylet::import {
namespace {

using files::JsonFile;
using files::JsonObject;
using files::Range;

constexpr Range kCoordinate{-100, 100};  // m, as glTF files

/// Also the name of a folder or a node: no slash, no leading dot, something.
std::string read_id(JsonObject& object, const std::string& key, const std::string& fallback = {}) {
  const std::string id = fallback.empty() ? object.text(key) : object.text(key, fallback);
  if (object.has(key) && (id.empty() || id.front() == '.' || id.find('/') != std::string::npos)) {
    object.problem(key, "is no id; write a word without slashes that does not begin with a dot");
  }
  return id;
}

void read_mesh(JsonObject& object, double& cell, int& target_nodes) {
  if (object.has("cell_mm") && object.has("target_nodes")) {
    object.problem("cell_mm", "and target_nodes exclude each other; keep one");
  }
  cell = object.number("cell_mm", {1, 100}, 0) * 1e-3;
  target_nodes = object.integer("target_nodes", 50, 50000, target_nodes);
}

void read_holds(JsonObject& object, std::vector<std::string>& held_by, double& held_within) {
  held_by = object.texts("held_by");
  held_within = object.number("held_within_mm", {0, 200}, held_within * 1e3) * 1e-3;
}

SideOrgan read_organ(JsonObject object) {
  SideOrgan organ;
  organ.pointer = object.pointer();
  organ.id = read_id(object, "id");
  organ.parts = object.texts("parts", {organ.id});
  if (object.has("parts") && organ.parts.empty()) object.problem("parts", "is empty; name a part, * and ? fit any");
  organ.role = object.choice("role", {"boundary", "region", "vessel", "target", "visual", "ignore"}, organ.role);
  organ.tissue = object.text("tissue", "");
  organ.body = object.text("body", "");
  organ.deformable = object.boolean("deformable", false);
  organ.priority = object.integer("priority", -1000, 1000, 0);
  const double within = object.number("within_mm", {0.5, 100}, 0);
  if (within > 0) organ.within = within * 1e-3;
  read_mesh(object, organ.cell, organ.target_nodes);
  read_holds(object, organ.held_by, organ.held_within);
  if (organ.deformable && organ.role != "boundary") {
    object.problem("role", "of what is deformable is boundary; correct one of the two");
  }
  if (organ.deformable && !organ.body.empty()) {
    object.problem("body", "carries what does not deform itself; remove body or deformable");
  }
  if (organ.within && organ.body.empty()) {
    object.problem("within_mm", "says how much of it a body carries; add body");
  }
  for (const char* key : {"cell_mm", "target_nodes", "held_by", "held_within_mm"}) {
    if (!organ.deformable && object.has(key)) object.problem(key, "is for what deforms; add \"deformable\": true");
  }
  object.finish();
  return organ;
}

SideWall read_wall(JsonFile& file, JsonObject object) {
  SideWall wall;
  wall.pointer = object.pointer();
  wall.id = read_id(object, "id", wall.id);
  wall.skin = object.text("skin");
  wall.depth = object.number("depth_mm", {3, 200}, wall.depth * 1e3) * 1e-3;
  if (auto box = object.object("box", false)) {
    const Eigen::Vector3d min = box->vector3("min", kCoordinate);
    const Eigen::Vector3d max = box->vector3("max", kCoordinate);
    if ((min.array() >= max.array()).any()) box->problem("max", "is not above min in every component; correct one");
    wall.box.emplace(min, max);
    box->finish();
    if (object.has("radius_mm")) object.problem("radius_mm", "and box exclude each other; keep one");
  }
  wall.radius = object.number("radius_mm", {20, 500}, wall.radius * 1e3) * 1e-3;
  for (JsonObject& layer : object.objects("layers", false)) {
    wall.layers.push_back({.pointer = layer.pointer(),
                           .tissue = layer.text("tissue"),
                           .thickness = layer.number("thickness_mm", {0.5, 200}, 0) * 1e-3});
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
  wall.clearance = object.number("clearance_mm", {0, 20}, wall.clearance * 1e3) * 1e-3;
  read_mesh(object, wall.cell, wall.target_nodes);
  read_holds(object, wall.held_by, wall.held_within);
  wall.filler = object.text("filler", "");
  object.finish();
  return wall;
}

SideScenario read_scenario(JsonFile& file, JsonObject object) {
  SideScenario scenario;
  scenario.pointer = object.pointer();
  scenario.name = read_id(object, "name");
  scenario.title = object.text("title", scenario.name);
  scenario.source = object.text("source", "");
  if (auto wall = object.object("wall")) scenario.wall = read_wall(file, *wall);
  scenario.entry = object.vector3("entry", kCoordinate);
  scenario.target = object.text("target");
  scenario.needle = object.text("needle", scenario.needle);
  if (auto probe = object.object("probe")) {
    scenario.probe.file = probe->text("file", "c5_2");
    scenario.probe.at = probe->vector3("at", kCoordinate);
    const Eigen::Vector3d look_at = probe->vector3("look_at", kCoordinate, Eigen::Vector3d::Zero());
    if (probe->has("look_at")) scenario.probe.look_at = look_at;
    probe->finish();
  }
  if (object.has("contacts")) {
    scenario.contacts.emplace();
    for (JsonObject& contact : object.objects("contacts")) {
      scenario.contacts->push_back({.pointer = contact.pointer(),
                                    .nodes_of = contact.text("nodes_of"),
                                    .surface_of = contact.text("surface_of")});
      contact.finish();
    }
  }
  scenario.label_spacing = object.number("label_spacing_mm", {0.3, 20}, 1) * 1e-3;
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

SideFile read_side_file(JsonFile& file) {
  JsonObject root = file.root("stylet-import", 1);
  SideFile side;
  side.path = file.path();
  for (const char* key : {"description", "licence"}) root.ignore(key);
  for (JsonObject& organ : root.objects("organs")) side.organs.push_back(read_organ(organ));
  if (root.has("organs") && side.organs.empty()) root.problem("organs", "is empty; name an organ");
  if (auto scenario = root.object("scenario", false)) side.scenario = read_scenario(file, *scenario);
  root.finish();
  check_ids(file, side);
  return side;
}

}  // namespace stylet::import
