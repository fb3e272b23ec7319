#include "engine/readers/exercise_file.h"

#include <fmt/format.h>

#include <array>

namespace stylet::readers {
namespace {

constexpr std::array kBiopsyKeys{"throw_mm", "notch_mm", "bore_mm", "samples"};
constexpr std::array kAblationKeys{"exposed_mm", "power_w",     "max_temperature_c",
                                   "duration_s", "time_factor", "margin_mm"};

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

content::Sampling read_sampling(files::JsonObject object) {
  content::Sampling sampling;
  const std::string kind = object.choice("kind", {"none", "biopsy", "ablation"}, "none");
  sampling.kind = kind == "biopsy"     ? content::SamplingKind::biopsy
                  : kind == "ablation" ? content::SamplingKind::ablation
                                       : content::SamplingKind::none;
  const auto only_for = [&](content::SamplingKind with, const char* name, const auto& keys) {
    for (const char* key : keys) {
      if (sampling.kind != with && object.has(key)) {
        object.problem(key, fmt::format("is for kind {} only; take it out or correct the kind", name));
      }
    }
  };
  only_for(content::SamplingKind::biopsy, "biopsy", kBiopsyKeys);
  only_for(content::SamplingKind::ablation, "ablation", kAblationKeys);
  sampling.automatic = object.boolean("auto", false);
  sampling.samples = object.integer("samples", 1, 20, sampling.samples);
  content::BiopsyGun& gun = sampling.gun;
  gun.throw_length = object.number("throw_mm", {5, 40}, gun.throw_length * 1e3) * 1e-3;
  gun.notch = object.number("notch_mm", {1, 40}, (gun.throw_length - content::BiopsyGun::kStyletPoint) * 1e3) * 1e-3;
  gun.bore = object.number("bore_mm", {0.2, 5}, gun.bore * 1e3) * 1e-3;
  if (gun.notch > gun.throw_length) object.problem("notch_mm", "is longer than throw_mm; shorten it");
  content::AblationPlan& plan = sampling.ablation;
  plan.exposed = object.number("exposed_mm", {5, 50}, plan.exposed * 1e3) * 1e-3;
  plan.power_w = object.number("power_w", {1, 300}, plan.power_w);
  plan.max_temperature = object.number("max_temperature_c", {50, 110}, plan.max_temperature);
  plan.duration_s = object.number("duration_s", {10, 3600}, plan.duration_s);
  plan.time_factor = object.number("time_factor", {1, 600}, plan.time_factor);
  plan.margin = object.number("margin_mm", {0, 20}, plan.margin * 1e3) * 1e-3;
  object.finish();
  return sampling;
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
  if (auto sampling = scenario.object("sampling", false)) exercise.sampling = read_sampling(*sampling);
  for (files::JsonObject& hint : scenario.objects("hints", false)) exercise.hints.push_back(read_hint(hint));
  return exercise;
}

}  // namespace stylet::readers
