#include "engine/readers/exercise_file.h"

#include "engine/procedures/kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string_view>
#include <vector>

namespace stylet::readers {
namespace {

/// [from, to] of a quantity that `scale` takes to SI.
content::Interval interval(files::JsonObject& object, const std::string& key, files::Range range, double scale) {
  if (!object.has(key)) {
    object.ignore(key);
    return {};
  }
  const std::vector<double> ends = object.numbers(key, 2, range, {range.min, range.max});
  if (ends[0] > ends[1]) object.problem(key, "ends before it begins; write [from, to]");
  return {ends[0] * scale, ends[1] * scale};
}

std::optional<bool> flag(files::JsonObject& object, const std::string& key) {
  const bool value = object.boolean(key, false);
  return object.has(key) ? std::optional(value) : std::nullopt;
}

content::Briefing read_briefing(files::JsonObject object) {
  content::Briefing briefing{
      .goal = object.text("goal"), .steps = object.texts("steps"), .anatomy = object.text("anatomy", "")};
  object.finish();
  return briefing;
}

/// The plan of the kind that the scenario names; null for "none".
std::shared_ptr<const content::ProcedurePlan> read_sampling(files::JsonObject object) {
  constexpr const char* kNone = "none";
  std::vector<std::string_view> names{kNone};
  for (const procedures::Kind* kind : procedures::kinds()) names.push_back(kind->name());
  const std::string name = object.choice("kind", names, kNone);
  const procedures::Kind* chosen = procedures::find_kind(name);
  for (const procedures::Kind* kind : procedures::kinds()) {
    if (kind == chosen) continue;
    for (const char* key : kind->keys()) {
      if (chosen != nullptr && std::ranges::find(chosen->keys(), std::string_view(key)) != chosen->keys().end())
        continue;
      if (object.has(key)) {
        object.problem(key, fmt::format("is for kind {} only; take it out or correct the kind", kind->name()));
      }
    }
  }
  const bool automatic = object.boolean("auto", false);
  std::unique_ptr<content::ProcedurePlan> plan = chosen != nullptr ? chosen->read(object) : nullptr;
  if (plan) plan->automatic = automatic;
  // What is asked for is accepted: each kind's keys are known, wherever they belong.
  for (const procedures::Kind* kind : procedures::kinds()) {
    for (const char* key : kind->keys()) object.ignore(key);
  }
  object.finish();
  return plan;
}

content::Hint read_hint(files::JsonObject object) {
  content::Hint hint;
  hint.text = object.text("text");
  if (auto when = object.object("when")) {
    hint.stage = when->choice("stage", {"briefing", "procedure", "sampling", "debrief"}, "");
    hint.tip_inside = flag(*when, "tip_inside");
    hint.probe_lifted = flag(*when, "probe_lifted");
    hint.stage_s = interval(*when, "stage_s", {0, 86400}, 1);
    hint.depth = interval(*when, "depth_mm", {0, 400}, 1e-3);
    hint.distance = interval(*when, "distance_mm", {-100, 1000}, 1e-3);
    hint.off_plane = interval(*when, "off_plane_mm", {0, 1000}, 1e-3);
    hint.force = interval(*when, "force_n", {0, 100}, 1);
    hint.samples = interval(*when, "samples", {0, 100}, 1);
    when->finish();
  }
  object.finish();
  return hint;
}

}  // namespace

content::Exercise read_exercise(files::JsonObject& scenario) {
  content::Exercise exercise;
  if (auto briefing = scenario.object("briefing", false)) exercise.briefing = read_briefing(*briefing);
  if (auto sampling = scenario.object("sampling", false)) exercise.plan = read_sampling(*sampling);
  for (files::JsonObject& hint : scenario.objects("hints", false)) exercise.hints.push_back(read_hint(hint));
  return exercise;
}

}  // namespace stylet::readers
