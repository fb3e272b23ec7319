#include "engine/readers/exercise_file.h"

#include <fmt/format.h>

#include <string_view>

namespace stylet::readers {

namespace key = files::key;
using files::Key;

namespace {

constexpr struct {
  Key goal = key::text("goal", "one sentence");
  Key steps = key::texts("steps", "one sentence each").optional();
  Key anatomy = key::text("anatomy", "what lies where, and what to spare").optional();
} kBriefing;

constexpr struct {
  Key kind = key::choice("kind", files::one_of<"none", "biopsy", "ablation">, "what is done there").otherwise("none");
  Key automatic = key::boolean("auto",
                               "it fires, or heats, by itself where the needle rests (below 3 mm/s for 0.25 s) in a "
                               "target that has had none; else by button 1 or a key")
                      .otherwise(false);
} kSampling;

constexpr content::BiopsyGun kGun;
constexpr struct {
  Key samples = key::integer("samples", {1, 20}, "cores wanted").otherwise(content::Sampling{}.samples);
  Key throw_length =
      key::number("throw_mm", "mm", {5, 40}, "how far the stylet shoots ahead").otherwise(kGun.throw_length * 1e3);
  Key notch = key::number("notch_mm", "mm", {1, 40}, "length of the core; absent: 5 less than throw_mm").optional();
  Key bore = key::number("bore_mm", "mm", {0.2, 5}, "diameter of the core").otherwise(kGun.bore * 1e3);
} kBiopsy;

constexpr content::AblationPlan kPlan;
constexpr struct {
  Key exposed = key::number("exposed_mm", "mm", {5, 50}, "length of the bare tip, all of which must be in tissue")
                    .otherwise(kPlan.exposed * 1e3);
  Key power = key::number("power_w", "W", {1, 300}, "most that goes into the tissue").otherwise(kPlan.power_w);
  Key max_temperature =
      key::number("max_temperature_c", "degrees Celsius", {50, 110}, "that no tissue exceeds: power is taken back")
          .otherwise(kPlan.max_temperature);
  Key duration = key::number("duration_s", "s", {10, 3600}, "of heating").otherwise(kPlan.duration_s);
  Key time_factor = key::number("time_factor", "", {1, 600}, "seconds of heating in a second of the session")
                        .otherwise(kPlan.time_factor);
  Key margin = key::number("margin_mm", "mm", {0, 20}, "around the target that is to be destroyed too")
                   .otherwise(kPlan.margin * 1e3);
} kAblation;

const files::KeyTable& sampling_table() {
  static const files::KeyTable table{
      .keys = files::keys_of(kSampling),
      .by = kSampling.kind.name,
      .variants = {{"biopsy", files::keys_of(kBiopsy)}, {"ablation", files::keys_of(kAblation)}}};
  return table;
}

constexpr struct {
  Key stage = key::choice("stage", files::one_of<"briefing", "procedure", "sampling", "debrief">, "of the session")
                  .optional();
  Key tip_inside = key::boolean("tip_inside", "the tip is in tissue");
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

content::Sampling read_sampling(files::JsonObject object) {
  content::Sampling sampling;
  const std::string kind = object.choice(kSampling.kind);
  sampling.kind = kind == "biopsy"     ? content::SamplingKind::biopsy
                  : kind == "ablation" ? content::SamplingKind::ablation
                                       : content::SamplingKind::none;
  sampling_table().each([&](const Key& key, std::string_view of) {
    if (!of.empty() && of != kind && object.has(key)) {
      object.problem(key, fmt::format("is for kind {} only; take it out or correct the kind", of));
    }
  });
  sampling.automatic = object.boolean(kSampling.automatic);
  sampling.samples = object.integer(kBiopsy.samples);
  content::BiopsyGun& gun = sampling.gun;
  gun.throw_length = object.number(kBiopsy.throw_length) * 1e-3;
  gun.notch = object.number(kBiopsy.notch, (gun.throw_length - content::BiopsyGun::kStyletPoint) * 1e3) * 1e-3;
  gun.bore = object.number(kBiopsy.bore) * 1e-3;
  if (gun.notch > gun.throw_length) object.problem(kBiopsy.notch, "is longer than throw_mm; shorten it");
  content::AblationPlan& plan = sampling.ablation;
  plan.exposed = object.number(kAblation.exposed) * 1e-3;
  plan.power_w = object.number(kAblation.power);
  plan.max_temperature = object.number(kAblation.max_temperature);
  plan.duration_s = object.number(kAblation.duration);
  plan.time_factor = object.number(kAblation.time_factor);
  plan.margin = object.number(kAblation.margin) * 1e-3;
  object.finish();
  return sampling;
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
  if (auto sampling = scenario.object(kExercise.sampling)) exercise.sampling = read_sampling(*sampling);
  for (files::JsonObject& hint : scenario.objects(kExercise.hints)) exercise.hints.push_back(read_hint(hint));
  return exercise;
}

}  // namespace stylet::readers
