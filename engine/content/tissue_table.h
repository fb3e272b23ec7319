// The tissue table (content/README.md, "stylet-tissues") and what a material in a glTF file may override in it.
#pragma once

#include "engine/content/scene.h"
#include "engine/files/json_reader.h"

#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::content {

/// extras.tissue of a material: a row of tissues.json, overridden value by value. Keys are ours (young_modulus_pa,
/// impedance_rayl, ...), whichever alias the file used.
struct TissueAnnotation {
  std::string preset;
  std::map<std::string, double> values;
};

/// One number of a tissue: its key, and where it goes.
struct TissueKey {
  std::string_view group;  ///< mechanics, needle, acoustics
  files::Key key;          ///< its alias is of the OpenUSD deformable proposal and its sibling blocks
  double& (*of)(Tissue&);
};

/// The table, and what surfaces between its tissues hold where the rule (TissueMap::puncture_force) does not fit.
struct TissueTable {
  std::vector<Tissue> tissues;
  std::vector<physics::TissueSurface> surfaces;
  std::vector<TissueWall> walls{};
};

/// Every number a tissue has, by group.
std::span<const TissueKey> tissue_keys();

/// Its keys.
const files::FileFormat& tissues_format();

/// Reads a tissue table: row 0 is "outside", the others follow by name, those that are fluid last: tables that gain
/// one keep the indices that recordings know. Problems go to `file`.
TissueTable read_tissues(files::JsonFile& file);

/// Reads the object extras.tissue of a material. @param[out] unknown  a line for each unknown key, appended
TissueAnnotation read_tissue_annotation(files::JsonObject tissue, std::vector<std::string>& unknown);

/// Index of the tissue an annotation means: its preset where nothing differs, else a new row named `name`, appended.
/// -1: there is no such preset.
int find_or_add_tissue(std::vector<Tissue>& tissues, const TissueAnnotation& annotation, const std::string& name);

/// Index of a tissue by name, -1: none.
int find_tissue(const std::vector<Tissue>& tissues, std::string_view name);

}  // namespace stylet::content
