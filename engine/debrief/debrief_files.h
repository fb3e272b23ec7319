// The debrief as numbers: debrief.json, debrief.csv and path.csv. content/README.md specifies them.
#pragma once

#include "engine/debrief/debrief_data.h"

#include <nlohmann/json.hpp>

#include <string>

namespace stylet::debrief {

/// The object of debrief.json: everything but outlines and pictures.
nlohmann::ordered_json to_json(const DebriefData& data);

/// RFC 4180: one row for the score, each metric and each event.
std::string debrief_csv(const DebriefData& data);
/// RFC 4180: one row a moment of the trainee's way, then of the expert's.
std::string path_csv(const DebriefData& data);

/// A unit as print has it: "mm2" as "mm²".
std::string unit_text(const std::string& unit);
/// "12.3 mm", "3", "not measured".
std::string value_text(const std::optional<double>& value, const std::string& unit);

}  // namespace stylet::debrief
