#include "engine/content/tissue_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::content {

namespace key = files::key;
using files::Key;

namespace {

constexpr std::array<TissueKey, 27> kKeys{{
    {"mechanics",
     key::number("young_modulus_pa", "Pa", {10, 1e10}, "E; from 1 MPa on the tissue is rigid")
         .known_as("youngsModulus"),
     [](Tissue& t) -> double& { return t.mechanics.young_modulus; }},
    {"mechanics",
     key::number("poisson_ratio", "", {0, 0.499},
                 "nu; in bodies of linear elements at most 0.45 of it counts, beyond which they lock")
         .known_as("poissonsRatio"),
     [](Tissue& t) -> double& { return t.mechanics.poisson_ratio; }},
    {"mechanics", key::number("density_kg_per_m3", "kg/m^3", {1, 3000}, "rho").known_as("density"),
     [](Tissue& t) -> double& { return t.density; }},
    {"mechanics",
     key::number("stiffening", "", {0, 200}, "b: strained tissue is exp(b strain^2) times as stiff").otherwise(0),
     [](Tissue& t) -> double& { return t.mechanics.stiffening; }},
    {"mechanics",
     key::number("relaxation_share_1", "", {0, 0.45}, "share of the shear stress that fades while the strain stays")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.mechanics.relaxation[0].share; }},
    {"mechanics", key::number("relaxation_time_1_s", "s", {1e-3, 1e5}, "until 1/e of it is left").otherwise(1),
     [](Tissue& t) -> double& { return t.mechanics.relaxation[0].time_s; }},
    {"mechanics",
     key::number("relaxation_share_2", "", {0, 0.45}, "another share, which fades beside the first").otherwise(0),
     [](Tissue& t) -> double& { return t.mechanics.relaxation[1].share; }},
    {"mechanics", key::number("relaxation_time_2_s", "s", {1e-3, 1e5}, "until 1/e of that is left").otherwise(1),
     [](Tissue& t) -> double& { return t.mechanics.relaxation[1].time_s; }},
    {"mechanics",
     key::number("capsule_modulus_pa", "Pa", {0, 1e8}, "E of the capsule around a body of this tissue; 0: none")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.capsule_modulus; }},
    {"mechanics", key::number("capsule_thickness_m", "m", {0, 0.005}, "of that capsule").otherwise(0),
     [](Tissue& t) -> double& { return t.capsule_thickness; }},
    {"needle",
     key::number("puncture_force_n", "N", {0, 100}, "axial force that breaks its surface").known_as("punctureForce"),
     [](Tissue& t) -> double& { return t.needle.puncture_force; }},
    {"needle",
     key::number("friction_n_per_m", "N/m", {0, 10000}, "axial Coulomb friction per length of shaft")
         .known_as("frictionPerLength"),
     [](Tissue& t) -> double& { return t.needle.friction_per_length; }},
    {"needle",
     key::number("cutting_force_n", "N", {0, 100}, "force on the tip that makes the track longer")
         .known_as("cuttingForce")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.needle.cutting_force; }},
    {"needle",
     key::number("cutting_viscosity_n_s_per_m", "N s/m", {0, 1000}, "what cutting takes more per speed")
         .known_as("cuttingViscosity")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.needle.cutting_viscosity; }},
    {"needle",
     key::number("friction_coefficient", "", {0, 2}, "Coulomb, of the lateral force between shaft and tissue")
         .known_as("frictionCoefficient")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.needle.friction_coefficient; }},
    {"needle",
     key::number("viscous_friction_n_s_per_m2", "N s/m^2", {0, 10000}, "per length of shaft and speed")
         .known_as("viscousFrictionPerLength")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.needle.viscous_friction; }},
    {"needle",
     key::number("side_strength_n_per_m", "N/m", {0, 1e6},
                 "force per length of shaft that cuts the tissue beside it; 0: it holds whatever comes")
         .known_as("sideStrengthPerLength")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.needle.side_strength; }},
    {"acoustics", key::number("impedance_rayl", "Pa s/m", {1, 1e8}, "characteristic impedance").known_as("impedance"),
     [](Tissue& t) -> double& { return t.acoustics.impedance_rayl; }},
    {"acoustics", key::number("speed_of_sound_m_per_s", "m/s", {300, 6000}, "along a line").known_as("speedOfSound"),
     [](Tissue& t) -> double& { return t.acoustics.speed_of_sound; }},
    {"acoustics",
     key::number("attenuation_db_per_cm_mhz", "dB/(cm MHz)", {0, 100}, "one way").known_as("attenuation"),
     [](Tissue& t) -> double& { return t.acoustics.attenuation_db_per_cm_mhz; }},
    {"acoustics", key::number("backscatter_db", "dB", {-200, 60}, "relative to liver"),
     [](Tissue& t) -> double& { return t.acoustics.backscatter_db; }},
    {"acoustics", key::number("texture_db", "dB", {0, 20}, "rms of the slow variation"),
     [](Tissue& t) -> double& { return t.acoustics.texture_db; }},
    {"acoustics",
     key::number("layering", "", {0, 30},
                 "times that the texture is longer along the layers under the skin than across; 0: the same in all "
                 "directions")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.acoustics.layering; }},
    {"acoustics",
     key::number("septa_db", "dB", {0, 40}, "thin bright sheets in fat and muscle, over the tissue; 0: none")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.acoustics.septa_db; }},
    {"acoustics",
     key::number("triads_db", "dB", {0, 40}, "bright portal triads of liver, over the tissue; 0: none").otherwise(0),
     [](Tissue& t) -> double& { return t.acoustics.triads_db; }},
    {"acoustics",
     key::number("mirror", "", {0, 1}, "gas: amplitude of the mirror image of what lies in front; 0: none")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.acoustics.mirror; }},
    {"acoustics",
     key::number("ring_down", "", {0, 0.95},
                 "froth (bowel gas): amplitude of a reverberation over the one before; 0: none")
         .otherwise(0),
     [](Tissue& t) -> double& { return t.acoustics.ring_down; }},
}};

constexpr std::array<std::string_view, 3> kGroups{"mechanics", "needle", "acoustics"};

template <std::size_t group>
const files::KeyTable& group_table() {
  static const files::KeyTable table = [] {
    files::KeyTable made;
    for (const TissueKey& key : kKeys) {
      if (key.group == kGroups[group]) made.keys.push_back(key.key);
    }
    return made;
  }();
  return table;
}

constexpr struct {
  Key mechanics = key::object(kGroups[0], group_table<0>, "elasticity and mass");
  Key needle = key::object(kGroups[1], group_table<1>, "what a needle feels; coupling stylet only");
  Key acoustics = key::object(kGroups[2], group_table<2>, "at body temperature");
  Key colour =
      key::numbers("colour", 4, "", {0, 1},
                   "linear red, green, blue and opacity; the sheet of the operating room lies over the tissue "
                   "named skin")
          .otherwise(0.8, 0.8, 0.8, 1);
  Key fluid = key::boolean("fluid", "a needle can draw it").otherwise(false);
  Key sources = key::note("sources", "where the values come from").schema(R"({"type": "object"})");
} kRow;

constexpr struct {
  Key between = key::texts("between", "the two tissues by name").count({2, 2});
  Key puncture_force = key::number("puncture_force_n", "N", {0, 100}, "axial force that breaks it");
  Key source = key::note("source", "where the value comes from");
  Key wall =
      key::text("wall", "tissue of the first where it meets the second, one voxel thick, in the ultrasound image")
          .optional();
} kSurface;

constexpr struct {
  Key licence = key::kLicence;
  Key remark = key::note("note", "for readers");
  Key tissues = key::entries("tissues", files::table_of<kRow>,
                             "tissues by name; the row outside is what surrounds the patient and is label 0")
                    .schema(R"({"required": ["outside"], "maxProperties": 200})");
  Key surfaces =
      key::objects("surfaces", files::table_of<kSurface>,
                   "surfaces between two tissues, the same from both sides, that are tougher or weaker than "
                   "the tissues themselves say")
          .optional();
} kTable;

/// The keys of a group under a tissue.
void read_group(std::string_view group, files::JsonObject& values, Tissue& tissue) {
  for (const TissueKey& key : kKeys) {
    if (key.group == group) key.of(tissue) = values.number(key.key);
  }
  values.finish();
}

Tissue read_row(const std::string& name, files::JsonObject row) {
  Tissue tissue;
  tissue.name = name;
  for (const Key& group : {kRow.mechanics, kRow.needle, kRow.acoustics}) {
    if (auto values = row.object(group)) read_group(group.name, *values, tissue);
  }
  const auto colour = row.numbers(kRow.colour);
  for (std::size_t i = 0; i < 4; ++i) tissue.colour[i] = static_cast<float>(colour[i]);
  tissue.fluid = row.boolean(kRow.fluid);
  row.finish();
  return tissue;
}

void read_surface(files::JsonObject& object, TissueTable& table) {
  const std::vector<Tissue>& tissues = table.tissues;
  physics::TissueSurface surface;
  const std::vector<std::string> between = object.texts(kSurface.between);
  if (between.size() == 2 && between[0] != between[1]) {
    const std::array<int*, 2> sides{&surface.from, &surface.to};
    for (std::size_t i = 0; i < 2; ++i) {
      const int tissue = find_tissue(tissues, between[i]);
      if (tissue < 0) {
        object.problem(kSurface.between,
                       fmt::format("names the tissue \"{}\", which is not in this table; correct it", between[i]));
      }
      *sides[i] = std::max(tissue, 0);
    }
  } else if (!between.empty()) {
    object.problem(kSurface.between, "is not two different tissues");
  }
  surface.puncture_force = object.number(kSurface.puncture_force);
  if (const std::string name = object.text(kSurface.wall); !name.empty()) {
    const int wall = find_tissue(tissues, name);
    if (wall < 0) {
      object.problem(kSurface.wall,
                     fmt::format("names the tissue \"{}\", which is not in this table; correct it", name));
    }
    table.walls.push_back({.outside = surface.from, .inside = surface.to, .wall = std::max(wall, 0)});
  }
  object.finish();
  table.surfaces.push_back(surface);
}

}  // namespace

std::span<const TissueKey> tissue_keys() {
  return kKeys;
}

const files::FileFormat& tissues_format() {
  static const files::FileFormat format{.name = "tissues",
                                        .title = "Mechanics and acoustics of tissues",
                                        .table = files::table_of<kTable>,
                                        .id = "stylet-tissues"};
  return format;
}

TissueTable read_tissues(files::JsonFile& file) {
  files::JsonObject root = file.root(tissues_format());
  TissueTable read;
  std::vector<Tissue>& tissues = read.tissues;
  tissues.resize(1);
  tissues[0].name = "outside";
  bool outside = false;
  if (auto table = root.object(kTable.tissues)) {
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
  for (files::JsonObject& object : root.objects(kTable.surfaces)) read_surface(object, read);
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
      // Asked for even where it is absent: so that a key beside it finds the nearest that is known.
      const double value = values->number(key.key, std::numeric_limits<double>::quiet_NaN());
      if (!std::isnan(value)) annotation.values[std::string(key.key.name)] = value;
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
    tissue = tissues[base];
  }
  bool differs = base < 0;
  for (const TissueKey& key : kKeys) {
    const auto found = annotation.values.find(std::string(key.key.name));
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
