#include "tools/bench/scenario_variant.h"

#include "engine/files/json_reader.h"
#include "engine/readers/scenario.h"
#include "tools/bench/scratch.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace stylet::bench {
namespace {

namespace fs = std::filesystem;

/// Files are named from the scenario's folder.
void make_absolute(nlohmann::json& json, const fs::path& folder) {
  if (json.is_string()) {
    const auto text = json.get<std::string>();
    std::error_code ignored;
    if (text.ends_with(".json") || text.ends_with(".glb")) {
      if (fs::is_regular_file(folder / text, ignored)) json = fs::weakly_canonical(folder / text).string();
    }
  } else if (json.is_structured()) {
    for (nlohmann::json& part : json) make_absolute(part, folder);
  }
}

/// With the paths of what it names absolute.
nlohmann::json shipped_scenario(const std::string& name) {
  const fs::path shipped = readers::find_scenario(name);
  nlohmann::json json = files::JsonFile(shipped).tree();
  make_absolute(json, shipped.parent_path());
  return json;
}

fs::path write_json(const Scratch& folder, const char* name, const nlohmann::json& json) {
  fs::path file = folder.path() / name;
  std::ofstream(file) << json.dump(1);
  return file;
}

}  // namespace

content::Scene scenario_with_tissues(const std::string& name, const std::string& tissues) {
  nlohmann::json json = shipped_scenario(name);
  nlohmann::json table = files::JsonFile(json["tissues"].get<std::string>()).tree();
  table.merge_patch(nlohmann::json::parse(tissues));
  const Scratch folder;
  json["tissues"] = write_json(folder, "tissues.json", table).string();
  return readers::load_scene(write_json(folder, "scenario.json", json));
}

content::Scene scenario_variant(const std::string& name, const MeshChoice& choice) {
  nlohmann::json json = shipped_scenario(name);
  for (nlohmann::json& body : json["bodies"]) {
    nlohmann::json& mesh = body["mesh"];
    if (mesh.contains("target_nodes")) {
      mesh["target_nodes"] = std::lround(choice.nodes * mesh["target_nodes"].get<double>());
    } else {
      mesh["cell_mm"] = mesh["cell_mm"].get<double>() / std::cbrt(choice.nodes);
    }
    if (choice.wall_nodes > 0 && body["name"] == "abdominal_wall") mesh = {{"target_nodes", choice.wall_nodes}};
    mesh["element"] = choice.element == physics::Element::quadratic ? "quadratic" : "linear";
  }
  const Scratch folder;
  content::Scene scene = readers::load_scene(write_json(folder, "scenario.json", json));
  for (content::Tissue& tissue : scene.tissues) tissue.mechanics.poisson_ratio = choice.poisson_ratio;
  for (content::DeformableBody& body : scene.bodies) {
    for (physics::ElasticMaterial& material : body.tet_mechanics) material.poisson_ratio = choice.poisson_ratio;
  }
  return scene;
}

}  // namespace stylet::bench
