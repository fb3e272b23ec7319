#include "engine/procedures/kinds.h"

#include "engine/procedures/ablation/kind.h"
#include "engine/procedures/aspiration/kind.h"
#include "engine/procedures/biopsy/kind.h"

#include <algorithm>
#include <array>

namespace stylet::procedures {

std::span<const Kind* const> kinds() {
  static const std::array<const Kind*, 3> kKinds{&biopsy::kind(), &ablation::kind(), &aspiration::kind()};
  return kKinds;
}

const Kind* find_kind(std::string_view name) {
  const auto found = std::ranges::find(kinds(), name, &Kind::name);
  return found == kinds().end() ? nullptr : *found;
}

const Kind* kind_of(const content::Exercise& exercise) {
  return exercise.plan ? find_kind(exercise.plan->kind) : nullptr;
}

std::span<const content::MetricRow> metric_table() {
  static const std::vector<content::MetricRow> table = [] {
    std::vector<content::MetricRow> all(content::metric_table().begin(), content::metric_table().end());
    for (const Kind* kind : kinds()) all.insert(all.end(), kind->metrics().begin(), kind->metrics().end());
    return all;
  }();
  return table;
}

}  // namespace stylet::procedures
