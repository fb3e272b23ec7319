#include "engine/import/scene_files.h"

#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_quality.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace stylet::import {
namespace {

using Json = nlohmann::ordered_json;

/// Micrometres, and a millionth of a quaternion: last-bit differences of another machine's library vanish.
double rounded(double value) {
  const double out = std::round(value * 1e6) * 1e-6;
  return std::round(out * 1e6) / 1e6 + 0.0;  // no -0
}

Json triple(const Eigen::Vector3d& x) {
  return {rounded(x.x()), rounded(x.y()), rounded(x.z())};
}

Json hold_json(const Hold& hold) {
  Json json = Json::object();
  if (!hold.near.empty()) {
    json["near"] = hold.near;
    json["distance_mm"] = rounded(hold.within * 1e3);
  }
  if (hold.plane) {
    const Eigen::Vector3d normal = hold.plane->normal();
    json["plane"] = {{"point", triple(-hold.plane->offset() * normal)}, {"normal", triple(normal)}};
  }
  if (hold.outside_box) {
    // A scenario's coordinates lie within 5 m; a box that is open on a side was written with more.
    const Eigen::Vector3d min = hold.outside_box->min().cwiseMax(-5).cwiseMin(5);
    const Eigen::Vector3d max = hold.outside_box->max().cwiseMax(min).cwiseMin(5);
    json["outside_box"] = {{"min", triple(min)}, {"max", triple(max)}};
  }
  return json;
}

/// From the side of the entry, from the feet and from above, as far away as shows entry and target with what is about
/// them.
Json camera_json(const ImportedScene& imported) {
  const Eigen::Vector3d centre = 0.5 * (imported.entry + imported.target);
  Eigen::Vector3d from = imported.outward;
  from.y() = 0;
  if (from.norm() < 0.1) from = Eigen::Vector3d::UnitZ();
  from = (from.normalized() + Eigen::Vector3d(0, -0.75, 0.55)).normalized();
  return {{"eye", triple(centre + 0.58 * from)},
          {"look_at", triple(centre)},
          {"up", triple(Eigen::Vector3d::UnitZ())},
          {"vertical_fov_deg", 28.5}};
}

/// What a biopsy is trained and scored by where nobody has said it: engineering values, as the shipped liver biopsy
/// has them. Forbidden is what bleeds or leaks.
void propose_exercise(const ImportedScene& imported, const SideScenario& scenario, Json& json) {
  constexpr const char* kProposed = "proposed by the import: engineering value";
  constexpr std::size_t kMostForbidden = 32;  // content::kMaxForbidden
  Json forbidden = Json::array();
  for (const SceneOrgan& organ : imported.organs) {
    const bool spared = organ.role == "vessel" || organ.tissue == "outside" || leaks(organ.tissue);
    const bool meant = organ.id == scenario.target || organ.role == "visual" || organ.role == "ignore";
    const bool carries_target = std::ranges::any_of(imported.organs, [&](const SceneOrgan& other) {
      return other.id == scenario.target && other.body == organ.id;
    });
    if (spared && !meant && !carries_target && organ.id != scenario.wall.skin && forbidden.size() < kMostForbidden) {
      forbidden.push_back(organ.id);
    }
  }
  if (!forbidden.empty()) json["forbidden"] = std::move(forbidden);
  const auto criterion = [&](const char* metric, double full, double zero, double weight, bool critical) {
    Json row{{"metric", metric}, {"full", full}, {"zero", zero}, {"weight", weight}};
    if (critical) row["critical"] = true;
    row["source"] = kProposed;
    return row;
  };
  json["pass_mark"] = 70;
  json["scoring"] =
      Json::array({criterion("tumour_content", 80, 30, 5, true), criterion("punctures", 1, 4, 2, false),
                   criterion("skin_contacts", 1, 5, 1, false), criterion("out_of_plane_time", 0.5, 5, 2, false),
                   criterion("angle_error", 5, 20, 1, false), criterion("time_in_tissue", 30, 180, 1, false)});
  if (json.contains("forbidden")) json["scoring"].push_back(criterion("forbidden_hits", 0, 1, 2, true));
  // Needles shoot 22 or 11 mm ahead, with a core 5 mm shorter: the longer one that a way through the target's middle
  // holds. The planned path ends there.
  const double half = imported.path.empty() ? 0 : imported.path.back().to - imported.path.back().from;
  const int throw_mm = 2 * half < 0.017 ? 11 : 22;
  const double deep_mm = 1e3 * (imported.target - imported.entry).norm();
  std::string way;
  for (const PathPiece& piece : imported.path) {
    if (way.empty() || !way.ends_with(piece.organ)) way += (way.empty() ? "" : ", ") + piece.organ;
  }
  json["briefing"] = {
      {"goal", fmt::format("Bring the needle's tip to the {} and take one core of it.", scenario.target)},
      {"steps", Json::array({fmt::format("Find the {} in the image, {:.0f} mm from the skin on a straight way.",
                                         scenario.target, deep_mm),
                             "Go in with the needle in the plane of the image, and keep the tip in sight.",
                             fmt::format("Stop where the needle enters it: fired, it shoots {} mm ahead. Fire, then "
                                         "finish.",
                                         throw_mm)})}};
  if (!way.empty()) json["briefing"]["anatomy"] = "On the straight way: " + way + ".";
  json["sampling"] = {{"kind", "biopsy"}, {"throw_mm", throw_mm}, {"bore_mm", 1.1}};
  json["hints"] = Json::array(
      {{{"when", {{"probe_lifted", true}}}, {"text", "The probe has lost the skin: press it on gently."}},
       {{"when", {{"stage", "procedure"}, {"force_n", {6, 100}}}}, {"text", "You push hard: are you on a rib?"}},
       {{"when", {{"stage", "procedure"}, {"tip_inside", true}, {"off_plane_mm", {3, 1000}}}},
        {"text", "The tip is out of the image: turn the probe until you see it before you go on."}}});
}

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

std::string scenario_json(const ImportedScene& imported, const SideFile& side) {
  const SideScenario& scenario = *side.scenario;
  Json json;
  json["format"] = "stylet-scenario";
  json["version"] = 1;
  json["name"] = scenario.name;
  json["title"] = scenario.title;
  if (!scenario.source.empty()) json["source"] = scenario.source;
  json["tissues"] = "tissues.json";
  json["needle"] = "needle.json";
  json["motion"] = "motion.json";
  const Eigen::Quaterniond& q = imported.probe.orientation;
  json["probe"] = {{"file", "probe.json"},
                   {"position", triple(imported.probe.position)},
                   {"orientation", {rounded(q.w()), rounded(q.x()), rounded(q.y()), rounded(q.z())}},
                   {"presses", scenario.wall.id}};
  json["organs"] = Json::array({{{"file", "organs.glb"}}});
  for (const SceneBody& body : imported.bodies) {
    Json entry;
    entry["name"] = body.id;
    entry["mesh"] =
        body.cell > 0 ? Json{{"cell_mm", rounded(body.cell * 1e3)}} : Json{{"target_nodes", body.target_nodes}};
    if (body.element == physics::Element::quadratic) entry["mesh"]["element"] = "quadratic";
    entry["fixed"] = Json::array();
    for (const Hold& hold : body.holds) entry["fixed"].push_back(hold_json(hold));
    json["bodies"].push_back(entry);
  }
  if (!imported.contacts.empty()) {
    for (const auto& [nodes_of, surface_of] : imported.contacts) {
      json["contacts"].push_back({{"nodes_of", nodes_of}, {"surface_of", surface_of}});
    }
  }
  json["labels"] = {{"spacing_mm", rounded(scenario.label_spacing * 1e3)}};
  json["targets"] = Json::array({{{"name", scenario.target}, {"organ", scenario.target}}});
  json["camera"] = camera_json(imported);
  propose_exercise(imported, scenario, json);
  json["rates"] = {{"haptic_hz", 1000}, {"simulation_hz", 50}};
  json["coupling"] = "stylet";
  json["contact_spacing_mm"] = 10;
  return json.dump(2) + "\n";
}

std::vector<BodyAccount> body_accounts(const ImportedScene& imported, const content::Scene& scene) {
  std::vector<BodyAccount> accounts;
  for (const content::DeformableBody& body : scene.bodies) {
    const mesh::TetQuality quality = mesh::tet_quality(body.mesh);
    BodyAccount account{.name = body.name,
                        .nodes = body.mesh.nodes.size(),
                        .tetrahedra = body.mesh.tets.size(),
                        .held = body.fixed_nodes.size(),
                        .surface_volume = 0,
                        .volume = quality.volume,
                        .min_dihedral_deg = quality.min_dihedral_deg,
                        .max_dihedral_deg = quality.max_dihedral_deg,
                        .inverted = quality.inverted};
    for (const gltf::AnnotatedSurface& surface : imported.surfaces) {
      if (surface.name == body.name) account.surface_volume = mesh::inspect(surface.mesh).volume;
    }
    accounts.push_back(account);
  }
  return accounts;
}

std::string scene_report_json(const ImportedScene& imported, const content::Scene& scene, const SideFile& side,
                              const std::vector<SourceFile>& files, const std::vector<std::string>& loading) {
  Json json;
  json["format"] = "stylet-import-report";
  json["version"] = 1;
  json["scenario"] = side.scenario->name;
  json["side_file"] = side.path.filename().string();
  json["files"] = Json::array();
  for (const SourceFile& file : files) {
    json["files"].push_back({{"file", file.path.filename().string()},
                             {"format", file.format},
                             {"assumptions", file.assumptions},
                             {"parts", file.parts.size()}});
  }
  json["left_out"] = imported.left_out;
  json["scan_cuts"] = Json::array();
  for (const ScanCut& cut : imported.cuts) {
    json["scan_cuts"].push_back(
        {{"towards", cut.name()}, {"axis", cut.axis}, {"at_m", rounded(cut.at)}, {"area_m2", cut.area}});
  }
  json["organs"] = Json::array();
  for (const SceneOrgan& organ : imported.organs) {
    json["organs"].push_back({{"id", organ.id},
                              {"role", organ.role},
                              {"tissue", organ.tissue},
                              {"body", organ.body},
                              {"parts", organ.parts},
                              {"triangles", organ.triangles},
                              {"pieces", organ.pieces},
                              {"volume_m3", organ.volume},
                              {"notes", organ.notes}});
  }
  json["bodies"] = Json::array();
  for (const BodyAccount& body : body_accounts(imported, scene)) {
    json["bodies"].push_back({{"name", body.name},
                              {"nodes", body.nodes},
                              {"tetrahedra", body.tetrahedra},
                              {"held_nodes", body.held},
                              {"surface_volume_m3", body.surface_volume},
                              {"volume_m3", body.volume},
                              {"volume_error", body.volume / body.surface_volume - 1},
                              {"inverted", body.inverted},
                              {"min_dihedral_deg", body.min_dihedral_deg},
                              {"max_dihedral_deg", body.max_dihedral_deg}});
  }
  json["overlaps"] = Json::array();
  for (const Overlap& overlap : imported.overlaps) {
    json["overlaps"].push_back({{"gives_way", overlap.gives_way},
                                {"counts", overlap.counts},
                                {"volume_m3", overlap.volume},
                                {"share_of_smaller", overlap.share}});
  }
  json["entry"] = triple(imported.entry);
  json["target"] = triple(imported.target);
  json["path"] = Json::array();
  for (const PathPiece& piece : imported.path) {
    json["path"].push_back({{"organ", piece.organ}, {"from_m", piece.from}, {"to_m", piece.to}});
  }
  json["wall_depth_m"] = imported.wall_depth;
  json["warnings"] = imported.warnings;
  for (const std::string& warning : loading) json["warnings"].push_back(warning);
  // Names of parts come from files and need not be UTF-8.
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string scene_report_text(const ImportedScene& imported, const content::Scene& scene, const SideFile& side,
                              const std::vector<SourceFile>& files, const std::vector<std::string>& loading) {
  const std::string& name = side.scenario->name;
  std::string text = fmt::format("{}\n{}\n", name, std::string(name.size(), '='));
  const auto out = std::back_inserter(text);
  for (const SourceFile& file : files) {
    fmt::format_to(out, "from {} ({}, {} parts)\n", file.path.filename().string(), file.format, file.parts.size());
    for (const std::string& assumption : file.assumptions) fmt::format_to(out, "  {}\n", assumption);
  }
  fmt::format_to(out, "by   {}\n", side.path.filename().string());
  if (!imported.left_out.empty()) fmt::format_to(out, "left out: {}\n", list(imported.left_out));

  fmt::format_to(out, "\nscan\n");
  for (const ScanCut& cut : imported.cuts) {
    fmt::format_to(out, "- ends towards {} at {} = {:.1f} mm: {:.0f} cm2 of the body are cut off flat\n", cut.name(),
                   "xyz"[cut.axis], cut.at * 1e3, cut.area * 1e4);
  }
  if (imported.cuts.empty()) fmt::format_to(out, "- no flat cut\n");

  fmt::format_to(out, "\n{:<28} {:<9} {:<17} {:<16} {:>9} {:>6} {:>9}\n", "organ", "role", "tissue", "moves with",
                 "triangles", "pieces", "ml");
  for (const SceneOrgan& organ : imported.organs) {
    fmt::format_to(out, "{:<28} {:<9} {:<17} {:<16} {:>9} {:>6} {:>9}\n", organ.id, organ.role, organ.tissue,
                   organ.body.empty() ? "- (rigid)" : organ.body, organ.triangles, organ.pieces,
                   organ.volume > 0 ? fmt::format("{:.1f}", organ.volume * 1e6) : "open");
    for (const std::string& note : organ.notes) fmt::format_to(out, "    {}\n", note);
  }

  fmt::format_to(out, "\nbodies that deform\n");
  for (const BodyAccount& body : body_accounts(imported, scene)) {
    fmt::format_to(out,
                   "- {}: {} nodes ({} held), {} tetrahedra, {:.4g} ml ({:+.2f} % of its surface), dihedral angles "
                   "{:.1f} to {:.1f} degrees, {} inverted\n",
                   body.name, body.nodes, body.held, body.tetrahedra, body.volume * 1e6,
                   100 * (body.volume / body.surface_volume - 1), body.min_dihedral_deg, body.max_dihedral_deg,
                   body.inverted);
  }

  fmt::format_to(out, "\noverlaps: the second counts\n");
  for (const Overlap& overlap : imported.overlaps) {
    fmt::format_to(out, "- {} / {}: {:.2g} ml, {:.1f} % of the smaller\n", overlap.gives_way, overlap.counts,
                   overlap.volume * 1e6, 100 * overlap.share);
  }
  if (imported.overlaps.empty()) fmt::format_to(out, "- none\n");

  fmt::format_to(out, "\nneedle: entry [{:.4f}, {:.4f}, {:.4f}], {:.0f} mm to the middle of {}; on a straight way\n",
                 imported.entry.x(), imported.entry.y(), imported.entry.z(),
                 (imported.target - imported.entry).norm() * 1e3, side.scenario->target);
  for (const PathPiece& piece : imported.path) {
    fmt::format_to(out, "- {:.1f} to {:.1f} mm: {}\n", piece.from * 1e3, piece.to * 1e3, piece.organ);
  }
  if (!imported.warnings.empty() || !loading.empty()) fmt::format_to(out, "\nto look at\n");
  for (const std::string& warning : imported.warnings) fmt::format_to(out, "- {}\n", warning);
  for (const std::string& warning : loading) fmt::format_to(out, "- {}\n", warning);
  return text;
}

}  // namespace stylet::import
