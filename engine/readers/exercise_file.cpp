#include "engine/readers/exercise_file.h"

#include "engine/procedures/kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string_view>
#include <vector>

namespace stylet::readers {

namespace key = files::key;
using files::Key;

namespace {

constexpr struct {
  Key goal = key::text("goal", "one sentence");
  Key steps = key::texts("steps", "one sentence each").optional();
  Key anatomy = key::text("anatomy", "what lies where, and what to spare").optional();
} kBriefing;

constexpr std::string_view kNone = "none";

files::Names procedure_names() {
  files::Names names{kNone};
  for (const procedures::Kind* kind : procedures::kinds()) names.push_back(kind->name());
  return names;
}

constexpr struct {
  Key kind = key::choice("kind", procedure_names, "what is done there").otherwise(kNone);
  Key automatic = key::boolean("auto",
                               "it begins by itself where the needle rests (below 3 mm/s for 0.25 s) in a "
                               "target that has had none; else by button 1 or a key")
                      .otherwise(false);
} kSampling;

const files::KeyTable& sampling_table() {
  static const files::KeyTable table = [] {
    files::KeyTable all{.keys = files::keys_of(kSampling), .by = kSampling.kind.name};
    for (const procedures::Kind* kind : procedures::kinds()) all.variants.push_back({kind->name(), kind->keys()});
    return all;
  }();
  return table;
}

constexpr struct {
  Key stage = key::choice("stage", files::one_of<"briefing", "procedure", "sampling", "debrief">, "of the session")
                  .optional();
  Key tip_inside = key::boolean("tip_inside", "the needle is in the patient");
  Key probe_lifted = key::boolean("probe_lifted", "the probe touches no skin");
  Key stage_s = key::numbers("stage_s", 2, "s", {0, 86400}, "since the stage began, [from, to]").optional();
  Key depth = key::numbers("depth_mm", 2, "mm", {0, 400}, "of needle in tissue, [from, to]").optional();
  Key distance = key::numbers("distance_mm", 2, "mm", {-100, 1000},
                              "from the tip to the surface of the next target, negative inside, [from, to]")
                     .optional();
  Key off_plane =
      key::numbers("off_plane_mm", 2, "mm", {0, 1000}, "from the tip to the image plane, [from, to]").optional();
  Key force = key::numbers("force_n", 2, "N", {0, 100}, "on the hand, [from, to]").optional();
  Key samples = key::numbers("samples", 2, "", {0, 100}, "taken so far, [from, to]").optional();
} kWhen;

constexpr struct {
  Key when = key::object("when", files::table_of<kWhen>, "all that is given must hold");
  Key text = key::text("text", "one sentence");
} kHint;

constexpr struct {
  Key briefing =
      key::object("briefing", files::table_of<kBriefing>, "what the trainee reads before the procedure").optional();
  Key sampling = key::object("sampling", sampling_table, "what happens at the target").optional();
  Key hints = key::objects("hints", files::table_of<kHint>,
                           "sentences for the trainee; the first whose conditions all hold is shown")
                  .optional();
} kExercise;

/// [from, to] of a quantity that `scale` takes to SI.
content::Interval interval(files::JsonObject& object, const Key& key, double scale) {
  const std::vector<double> ends = object.numbers(key, {key.range.min, key.range.max});
  if (!object.has(key)) return {};
  if (ends[0] > ends[1]) object.problem(key, "ends before it begins; write [from, to]");
  return {ends[0] * scale, ends[1] * scale};
}

std::optional<bool> flag(files::JsonObject& object, const Key& key) {
  const bool value = object.boolean(key);
  return object.has(key) ? std::optional(value) : std::nullopt;
}

content::Briefing read_briefing(files::JsonObject object) {
  content::Briefing briefing{.goal = object.text(kBriefing.goal),
                             .steps = object.texts(kBriefing.steps),
                             .anatomy = object.text(kBriefing.anatomy)};
  object.finish();
  return briefing;
}

/// The plan of the kind that the scenario names; null for "none".
std::shared_ptr<const content::ProcedurePlan> read_sampling(files::JsonObject object) {
  const std::string name = object.choice(kSampling.kind);
  sampling_table().each([&](const Key& key, std::string_view of) {
    if (!of.empty() && of != name && object.has(key)) {
      object.problem(key, fmt::format("is for kind {} only; take it out or correct the kind", of));
    }
  });
  // Every kind reads its keys, so that all of them are known; the plan is that of the kind chosen.
  std::unique_ptr<content::ProcedurePlan> plan;
  for (const procedures::Kind* kind : procedures::kinds()) {
    std::unique_ptr<content::ProcedurePlan> read = kind->read(object);
    if (kind->name() == name) plan = std::move(read);
  }
  const bool automatic = object.boolean(kSampling.automatic);
  if (plan) plan->automatic = automatic;
  object.finish();
  return plan;
}

content::Hint read_hint(files::JsonObject object) {
  content::Hint hint;
  hint.text = object.text(kHint.text);
  if (auto when = object.object(kHint.when)) {
    hint.stage = when->choice(kWhen.stage);
    hint.tip_inside = flag(*when, kWhen.tip_inside);
    hint.probe_lifted = flag(*when, kWhen.probe_lifted);
    hint.stage_s = interval(*when, kWhen.stage_s, 1);
    hint.depth = interval(*when, kWhen.depth, 1e-3);
    hint.distance = interval(*when, kWhen.distance, 1e-3);
    hint.off_plane = interval(*when, kWhen.off_plane, 1e-3);
    hint.force = interval(*when, kWhen.force, 1);
    hint.samples = interval(*when, kWhen.samples, 1);
    when->finish();
  }
  object.finish();
  return hint;
}

}  // namespace

std::vector<Key> exercise_keys() {
  return files::keys_of(kExercise);
}

content::Exercise read_exercise(files::JsonObject& scenario) {
  content::Exercise exercise;
  if (auto briefing = scenario.object(kExercise.briefing)) exercise.briefing = read_briefing(*briefing);
  if (auto sampling = scenario.object(kExercise.sampling)) exercise.plan = read_sampling(*sampling);
  for (files::JsonObject& hint : scenario.objects(kExercise.hints)) exercise.hints.push_back(read_hint(hint));
  return exercise;
}

}  // namespace stylet::readers
