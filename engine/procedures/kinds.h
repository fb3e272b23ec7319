// The kinds of procedures that there are: one table.
#pragma once

#include "engine/procedures/interface/procedure.h"

#include <span>
#include <string_view>

namespace stylet::procedures {

std::span<const Kind* const> kinds();
/// Null: there is none of this name.
const Kind* find_kind(std::string_view name);
/// Of the exercise; null: nothing is sampled or destroyed.
const Kind* kind_of(const content::Exercise& exercise);

/// Every metric that a scenario can score: those of every procedure, then those of the kinds.
std::span<const content::MetricRow> metric_table();

}  // namespace stylet::procedures
