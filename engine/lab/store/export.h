// Attempts for other programs: a table for statistics, and everything as JSON. By pseudonym; names stay in the
// roster.
#pragma once

#include "engine/lab/store/lab.h"

#include <string>

namespace stylet::lab::store {

struct ExportScope {
  std::string trainee{};      ///< Person::id; empty: of all
  bool for_research = false;  ///< of those alone who agreed to it, and of those who are nobody any more
};
/// RFC 4180: a row an attempt, a column a metric, in order of time; empty: not measured.
std::string attempts_as_csv(Lab& lab, const ExportScope& scope = {});
/// {"format": "stylet-lab-export", "version": 1, "attempts": [...]}; of one trainee also "consent" and "notes".
std::string attempts_as_json(Lab& lab, const ExportScope& scope = {});

/// "2026-03-02T09:16:25.480Z"
std::string utc_text(std::int64_t ms);
/// "2026-03-02 10:16", where it was.
std::string local_text(std::int64_t ms, int utc_offset_min);

}  // namespace stylet::lab::store
