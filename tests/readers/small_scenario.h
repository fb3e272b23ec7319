// A complete scenario of three spheres in a temporary folder, to be broken by tests.
#pragma once

#include "tests/gltf/glb.h"
#include "tests/support/temporary_folder.h"

#include <nlohmann/json.hpp>

#include <string>

namespace stylet::readers::test {

/// A ball of liver (50 mm) held by a ball of bone, with a tumour (10 mm) inside. Edit the members, then write().
struct SmallScenario {
  support::TemporaryFolder folder;
  gltf::test::Glb organs;
  nlohmann::json scenario;
  nlohmann::json tissues;
  nlohmann::json needle;
  nlohmann::json probe;
  nlohmann::json motion;

  SmallScenario() {
    using nlohmann::json;
    const Eigen::Vector3d centre(0.1, 0, 0);
    organs.add("liver_ball", gltf::test::sphere(centre, 0.05),
               {{"id", "liver"}, {"role", "boundary"}, {"body", "liver"}}, {{"preset", "liver"}});
    organs.add("bone_ball", gltf::test::sphere(centre + Eigen::Vector3d(0, 0, -0.06), 0.02),
               {{"id", "bone"}, {"role", "boundary"}}, {{"preset", "bone"}});
    organs.add("tumour_ball", gltf::test::sphere(centre + Eigen::Vector3d(0.01, 0, 0), 0.01),
               {{"id", "tumour"}, {"role", "target"}, {"body", "liver"}}, {{"preset", "tumour"}});
    scenario = json::parse(R"({
      "format": "stylet-scenario", "version": 1, "name": "small", "title": "three balls",
      "tissues": "tissues.json", "needle": "needle.json", "motion": "motion.json",
      "probe": {"file": "probe.json", "position": [0.1, 0, 0.05], "axis": [0, 0, -1], "lateral": [1, 0, 0]},
      "organs": [{"file": "organs.glb"}],
      "bodies": [{"name": "liver", "mesh": {"cell_mm": 25}, "fixed": [{"near": ["bone"], "distance_mm": 5}]}],
      "targets": [{"name": "tumour", "organ": "tumour"}],
      "labels": {"spacing_mm": 2},
      "camera": {"eye": [0, 0, 1], "look_at": [0.1, 0, 0], "up": [0, 1, 0]}})");
    const auto row = [](double young, double impedance) {
      json out = json::parse(R"({"mechanics": {"poisson_ratio": 0.45, "density_kg_per_m3": 1000},
        "needle": {"puncture_force_n": 1, "friction_n_per_m": 20},
        "acoustics": {"speed_of_sound_m_per_s": 1540, "attenuation_db_per_cm_mhz": 0.5, "backscatter_db": 0,
                      "texture_db": 1}, "colour": [0.5, 0.2, 0.1, 1], "sources": {}})");
      out["mechanics"]["young_modulus_pa"] = young;
      out["acoustics"]["impedance_rayl"] = impedance;
      return out;
    };
    tissues = {{"format", "stylet-tissues"}, {"version", 1}, {"tissues", {}}};
    tissues["tissues"] = {{"outside", row(10, 1.5e6)},
                          {"bone", row(1e9, 6e6)},
                          {"liver", row(5e3, 1.65e6)},
                          {"tumour", row(1e4, 1.66e6)}};
    needle = json::parse(R"({"format": "stylet-needle", "version": 1, "name": "n", "length_mm": 150,
      "outer_diameter_mm": 1.27, "inner_diameter_mm": 0.8, "young_modulus_pa": 2e11, "poisson_ratio": 0.3})");
    probe = json::parse(R"({"format": "stylet-probe", "version": 1, "name": "p", "kind": "convex", "radius_mm": 60,
      "field_of_view_deg": 60, "depth_mm": 150, "frequency_mhz": 3.5})");
    motion = json::parse(R"({"format": "stylet-motion", "version": 1,
      "tracks": {"stylus": [[0, 0.1, 0, 0.2, 0, 1, 0, 0], [1, 0.1, 0, 0.19, 0, 1, 0, 0]]}})");
  }

  std::filesystem::path path() const { return folder.path() / "scenario.json"; }

  std::filesystem::path write() const {
    folder.write("organs.glb", organs.bytes());
    folder.write("tissues.json", tissues.dump(1));
    folder.write("needle.json", needle.dump(1));
    folder.write("probe.json", probe.dump(1));
    folder.write("motion.json", motion.dump(1));
    return folder.write("scenario.json", scenario.dump(1));
  }
};

}  // namespace stylet::readers::test
