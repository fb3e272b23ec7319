#include "engine/lab/page/page_parts.h"

#include "engine/files/html.h"
#include "engine/lab/page/style.h"
#include "engine/lab/store/export.h"

#include <fmt/format.h>

namespace stylet::lab::page {

using files::html::escaped;

std::string page_begin(const std::string& title) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta http-equiv=\"Content-Security-Policy\" "
      "content=\"default-src 'none'; style-src 'unsafe-inline'\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><meta name=\"color-scheme\" content=\"light dark\"><meta "
      "name=\"robots\" content=\"noindex\"><title>{} - Stylet lab</title><style>\n{}</style></head><body>\n",
      escaped(title), kStyle);
}

std::string page_end(const PageFacts& facts) {
  const std::string leave =
      facts.actions
          ? fmt::format(R"(<form class="do" method="post" action="logout"><input type="hidden" name="token" )"
                        R"(value="{}">Logged in as {} <button>Log out</button></form>)",
                        escaped(facts.actions->token), isolated(facts.actions->instructor))
          : "";
  return leave +
         fmt::format(
             "<footer>Stylet {}, {}. A gate proposes that somebody is competent; a person decides. Training use "
             "only: that "
             "these numbers hold in the clinic is not shown. Not a medical device.</footer>\n</body></html>\n",
             escaped(facts.build), store::utc_text(facts.made_ms).substr(0, 16) + " UTC");
}

std::string isolated(std::string_view text) {
  return "<bdi>" + escaped(text) + "</bdi>";
}

std::string name_of(const store::Person& person) {
  if (person.name.empty()) return escaped(person.pseudonym);
  return fmt::format("{} ({})", isolated(person.name), escaped(person.pseudonym));
}

StandingMark mark_of(course::Standing standing) {
  switch (standing) {
    case course::Standing::locked:
      return {"locked", "\u00b7", "locked"};
    case course::Standing::practising:
      return {"practising", "\u25cb", "practice"};
    case course::Standing::graded:
      return {"graded", "\u25d0", "graded, gate not passed"};
    case course::Standing::competent:
      return {"competent", "\u25cf", "gate passed"};
    default:
      return {"alarm", "\u25b2", "alarm after the gate"};
  }
}

std::string date_of(std::int64_t day) {
  return store::local_text(day * 86'400'000, 0).substr(0, 10);
}

std::string result_of(const store::AttemptRecord& attempt) {
  if (!attempt.excluded.empty()) return "excluded: " + attempt.excluded;
  if (attempt.status == "running") return "under way";
  if (attempt.status == "crashed") return "\u2717 cut off";
  if (attempt.status == "aborted") return "\u2717 broken off";
  if (!attempt.passed) return "measured";
  if (*attempt.passed) return "\u2713 passed";
  return attempt.failed_critical.empty() ? "\u2717 failed" : "\u2717 failed: " + attempt.failed_critical;
}

}  // namespace stylet::lab::page
