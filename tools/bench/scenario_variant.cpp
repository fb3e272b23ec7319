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

}  // namespace

content::Scene scenario_variant(const std::string& name, const MeshChoice& choice) {
  const fs::path shipped = readers::find_scenario(name);
  nlohmann::json json = files::JsonFile(shipped).tree();
  make_absolute(json, shipped.parent_path());
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
  const fs::path file = folder.path() / "scenario.json";
  std::ofstream(file) << json.dump(1);
  content::Scene scene = readers::load_scene(file);
  for (content::Tissue& tissue : scene.tissues) tissue.mechanics.poisson_ratio = choice.poisson_ratio;
  for (content::DeformableBody& body : scene.bodies) {
    for (physics::ElasticMaterial& material : body.tet_mechanics) material.poisson_ratio = choice.poisson_ratio;
  }
  return scene;
}

}  // namespace stylet::bench
