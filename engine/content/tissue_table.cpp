#include "engine/content/tissue_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::content {
namespace {

constexpr std::array<TissueKey, 19> kKeys{{
    {"mechanics",
     "young_modulus_pa",
     "youngsModulus",
     {10, 1e10},
     [](Tissue& t) -> double& { return t.mechanics.young_modulus; }},
    {"mechanics",
     "poisson_ratio",
     "poissonsRatio",
     {0, 0.499},
     [](Tissue& t) -> double& { return t.mechanics.poisson_ratio; }},
    {"mechanics", "density_kg_per_m3", "density", {1, 3000}, [](Tissue& t) -> double& { return t.density; }},
    {"needle",
     "puncture_force_n",
     "punctureForce",
     {0, 100},
     [](Tissue& t) -> double& { return t.needle.puncture_force; }},
    {"needle",
     "friction_n_per_m",
     "frictionPerLength",
     {0, 10000},
     [](Tissue& t) -> double& { return t.needle.friction_per_length; }},
    {"needle",
     "cutting_force_n",
     "cuttingForce",
     {0, 100},
     [](Tissue& t) -> double& { return t.needle.cutting_force; },
     false},
    {"needle",
     "cutting_viscosity_n_s_per_m",
     "cuttingViscosity",
     {0, 1000},
     [](Tissue& t) -> double& { return t.needle.cutting_viscosity; },
     false},
    {"needle",
     "friction_coefficient",
     "frictionCoefficient",
     {0, 2},
     [](Tissue& t) -> double& { return t.needle.friction_coefficient; },
     false},
    {"needle",
     "viscous_friction_n_s_per_m2",
     "viscousFrictionPerLength",
     {0, 10000},
     [](Tissue& t) -> double& { return t.needle.viscous_friction; },
     false},
    {"acoustics",
     "impedance_rayl",
     "impedance",
     {1, 1e8},
     [](Tissue& t) -> double& { return t.acoustics.impedance_rayl; }},
    {"acoustics",
     "speed_of_sound_m_per_s",
     "speedOfSound",
     {300, 6000},
     [](Tissue& t) -> double& { return t.acoustics.speed_of_sound; }},
    {"acoustics",
     "attenuation_db_per_cm_mhz",
     "attenuation",
     {0, 100},
     [](Tissue& t) -> double& { return t.acoustics.attenuation_db_per_cm_mhz; }},
    {"acoustics", "backscatter_db", "", {-200, 60}, [](Tissue& t) -> double& { return t.acoustics.backscatter_db; }},
    {"acoustics", "texture_db", "", {0, 20}, [](Tissue& t) -> double& { return t.acoustics.texture_db; }},
    {"acoustics", "layering", "", {0, 30}, [](Tissue& t) -> double& { return t.acoustics.layering; }, false},
    {"acoustics", "septa_db", "", {0, 40}, [](Tissue& t) -> double& { return t.acoustics.septa_db; }, false},
    {"acoustics", "triads_db", "", {0, 40}, [](Tissue& t) -> double& { return t.acoustics.triads_db; }, false},
    {"acoustics", "mirror", "", {0, 1}, [](Tissue& t) -> double& { return t.acoustics.mirror; }, false},
    {"acoustics", "ring_down", "", {0, 0.95}, [](Tissue& t) -> double& { return t.acoustics.ring_down; }, false},
}};

constexpr std::array<std::string_view, 3> kGroups{"mechanics", "needle", "acoustics"};

Tissue read_row(const std::string& name, files::JsonObject row) {
  Tissue tissue;
  tissue.name = name;
  for (const std::string_view group : kGroups) {
    auto values = row.object(std::string(group));
    if (!values) continue;
    for (const TissueKey& key : kKeys) {
      if (key.group != group) continue;
      if (!key.alias.empty()) values->alias(std::string(key.key), std::string(key.alias));
      const std::string number(key.key);
      key.of(tissue) = key.required ? values->number(number, key.range) : values->number(number, key.range, 0);
    }
    values->finish();
  }
  const auto colour = row.numbers("colour", 4, {0, 1}, {0.8, 0.8, 0.8, 1});
  for (std::size_t i = 0; i < 4; ++i) tissue.colour[i] = static_cast<float>(colour[i]);
  tissue.fluid = row.boolean("fluid", false);
  row.ignore("sources");
  row.finish();
  return tissue;
}

void read_surface(files::JsonObject& object, TissueTable& table) {
  const std::vector<Tissue>& tissues = table.tissues;
  physics::TissueSurface surface;
  const std::vector<std::string> between = object.texts("between");
  if (between.size() == 2 && between[0] != between[1]) {
    const std::array<int*, 2> sides{&surface.from, &surface.to};
    for (std::size_t i = 0; i < 2; ++i) {
      const int tissue = find_tissue(tissues, between[i]);
      if (tissue < 0) {
        object.problem("between",
                       fmt::format("names the tissue \"{}\", which is not in this table; correct it", between[i]));
      }
      *sides[i] = std::max(tissue, 0);
    }
  } else if (!between.empty()) {
    object.problem("between", "is not two different tissues");
  }
  surface.puncture_force = object.number("puncture_force_n", {0, 100});
  if (const std::string name = object.text("wall", ""); !name.empty()) {
    const int wall = find_tissue(tissues, name);
    if (wall < 0) {
      object.problem("wall", fmt::format("names the tissue \"{}\", which is not in this table; correct it", name));
    }
    table.walls.push_back({.outside = surface.from, .inside = surface.to, .wall = std::max(wall, 0)});
  }
  object.ignore("source");
  object.finish();
  table.surfaces.push_back(surface);
}

}  // namespace

std::span<const TissueKey> tissue_keys() {
  return kKeys;
}

TissueTable read_tissues(files::JsonFile& file) {
  files::JsonObject root = file.root("stylet-tissues", 1);
  root.ignore("licence");
  root.ignore("note");
  TissueTable read;
  std::vector<Tissue>& tissues = read.tissues;
  tissues.resize(1);
  tissues[0].name = "outside";
  bool outside = false;
  if (auto table = root.object("tissues")) {
    for (auto& [name, row] : table->entries()) {
      Tissue tissue = read_row(name, row);
      if (name == "outside") {
        tissues[0] = std::move(tissue);
        outside = true;
      } else {
        tissues.push_back(std::move(tissue));
      }
    }
    std::stable_partition(tissues.begin() + 1, tissues.end(), [](const Tissue& tissue) { return !tissue.fluid; });
    if (!outside) table->problem("outside", "is missing; add the tissue around the patient (gel or air)");
    // A label is a byte, and glTF materials may add rows.
    if (tissues.size() > 200) table->problem("", fmt::format("has {} tissues, the limit is 200", tissues.size()));
  }
  for (files::JsonObject& object : root.objects("surfaces", false)) read_surface(object, read);
  root.finish();
  return read;
}

TissueAnnotation read_tissue_annotation(files::JsonObject tissue, std::vector<std::string>& unknown) {
  TissueAnnotation annotation;
  const auto add_unknown = [&](const files::JsonObject& object) {
    for (std::string& line : object.unknown_keys()) unknown.push_back(std::move(line));
  };
  tissue.integer("version", 1, 1, 1);
  annotation.preset = tissue.text("preset", "");
  for (const std::string_view group : kGroups) {
    auto values = tissue.object(std::string(group), false);
    if (!values) continue;
    for (const TissueKey& key : kKeys) {
      if (key.group != group) continue;
      const std::string name(key.key);
      if (!key.alias.empty()) values->alias(name, std::string(key.alias));
      // Asked for even where it is absent: so that a key beside it finds the nearest that is known.
      const double value = values->number(name, key.range, std::numeric_limits<double>::quiet_NaN());
      if (!std::isnan(value)) annotation.values[name] = value;
    }
    add_unknown(*values);
  }
  add_unknown(tissue);
  return annotation;
}

int find_tissue(const std::vector<Tissue>& tissues, std::string_view name) {
  const auto found = std::find_if(tissues.begin(), tissues.end(), [&](const Tissue& t) { return t.name == name; });
  return found == tissues.end() ? -1 : static_cast<int>(found - tissues.begin());
}

int find_or_add_tissue(std::vector<Tissue>& tissues, const TissueAnnotation& annotation, const std::string& name) {
  int base = -1;
  Tissue tissue;
  if (!annotation.preset.empty()) {
    base = find_tissue(tissues, annotation.preset);
    if (base < 0) return -1;
    tissue = tissues[static_cast<std::size_t>(base)];
  }
  bool differs = base < 0;
  for (const TissueKey& key : kKeys) {
    const auto found = annotation.values.find(std::string(key.key));
    if (found == annotation.values.end()) continue;
    differs = differs || key.of(tissue) != found->second;
    key.of(tissue) = found->second;
  }
  if (!differs) return base;
  if (tissues.size() > std::numeric_limits<std::uint8_t>::max()) return -1;
  tissue.name = name;
  tissues.push_back(tissue);
  return static_cast<int>(tissues.size()) - 1;
}

}  // namespace stylet::content
