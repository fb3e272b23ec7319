#include "engine/procedures/ablation/kind.h"

#include "engine/procedures/ablation/heating.h"
#include "engine/procedures/ablation/zone_replay.h"

#include <algorithm>
#include <array>

namespace stylet::procedures::ablation {
namespace {

namespace key = files::key;
using files::Key;

constexpr double kDefaultExposed = 30, kDefaultPower = 100, kDefaultMaxTemperature = 100, kDefaultDuration = 720,
                 kDefaultTimeFactor = 60, kDefaultMargin = 5;
constexpr struct {
  Key exposed = key::number("exposed_mm", "mm", {5, 50}, "length of the bare tip, all of which must be in tissue")
                    .otherwise(kDefaultExposed);
  Key power = key::number("power_w", "W", {1, 300}, "most that goes into the tissue").otherwise(kDefaultPower);
  Key max_temperature =
      key::number("max_temperature_c", "degrees Celsius", {50, 110}, "that no tissue exceeds: power is taken back")
          .otherwise(kDefaultMaxTemperature);
  Key duration = key::number("duration_s", "s", {10, 3600}, "of heating").otherwise(kDefaultDuration);
  Key time_factor = key::number("time_factor", "", {1, 600}, "seconds of heating in a second of the session")
                        .otherwise(kDefaultTimeFactor);
  Key margin = key::number("margin_mm", "mm", {0, 20}, "around the target that is to be destroyed too")
                   .otherwise(kDefaultMargin);
} kKeys;

constexpr std::array kMetrics{content::MetricRow{"ablation_coverage", "ablation coverage", "%",
                                                 "share of the target and 5 mm around it in the ablated zone",
                                                 "Stylet"}};

class AblationKind final : public Kind {
public:
  std::string_view name() const override { return kName; }
  std::vector<files::Key> keys() const override { return files::keys_of(kKeys); }

  std::unique_ptr<content::ProcedurePlan> read(files::JsonObject& object) const override {
    auto plan = std::make_unique<Plan>();
    plan->exposed = object.number(kKeys.exposed) * 1e-3;
    plan->power_w = object.number(kKeys.power);
    plan->max_temperature = object.number(kKeys.max_temperature);
    plan->duration_s = object.number(kKeys.duration);
    plan->time_factor = object.number(kKeys.time_factor);
    plan->margin = object.number(kKeys.margin) * 1e-3;
    plan->working_length = plan->exposed;
    plan->destroys = true;
    return plan;
  }

  std::unique_ptr<Procedure> begin(const content::Scene& scene) const override {
    return std::make_unique<Heating>(scene);
  }
  std::unique_ptr<ProcedureReplay> replay(const content::Scene& scene,
                                          std::span<const recording::EventRecord> events) const override {
    return std::make_unique<ZoneReplay>(scene, events);
  }

  std::string_view approach_event() const override { return kStartedEvent; }
  std::span<const content::MetricRow> metrics() const override { return kMetrics; }
  /// Of all that was heated until then: the last time tells.
  std::optional<double> measure(std::string_view, std::span<const recording::EventRecord> events,
                                const content::Scene&) const override {
    const auto last = std::find_if(events.rbegin(), events.rend(),
                                   [](const recording::EventRecord& event) { return event.name == kAblatedEvent; });
    return last == events.rend() ? std::nullopt : std::optional(coverage_percent(*last));
  }

  std::string_view sampling_title() const override { return "Ablation"; }
  std::optional<DebriefEntry> describe_step(const recording::EventRecord& event) const override {
    if (event.name == kStartedEvent) return DebriefEntry{"Ablation started"};
    if (event.name != kStoppedEvent) return std::nullopt;
    return DebriefEntry{"Ablation stopped", event.version_1_text().empty() ? recording::fields_in_words(event)
                                                                           : std::string(event.version_1_text())};
  }
  std::optional<DebriefEntry> describe_result(const recording::EventRecord& event) const override {
    return event.name == kAblatedEvent ? std::optional(DebriefEntry{"Ablated", in_words(event)}) : std::nullopt;
  }
  /// As a generator tells that its electrode is under power.
  std::optional<sound::Cue> cue_of(const recording::EventRecord& event) const override {
    if (event.name != kStartedEvent && event.name != kStoppedEvent) return std::nullopt;
    return sound::Cue{.time_s = event.time_s,
                      .sound = sound::Sound::generator,
                      .strength = event.name == kStartedEvent ? 1.0 : 0.0};
  }
  std::optional<Still> still(std::span<const recording::EventRecord> events, double, double to_s) const override {
    constexpr std::string_view kWords = "at the end of the heating";
    std::optional<Still> heated;
    bool heating = false;
    for (const recording::EventRecord& event : events) {
      if (event.time_s > to_s) continue;
      if (event.name == kStartedEvent) heating = true;
      if (event.name != kStoppedEvent) continue;
      heating = false;
      heated = {event.time_s, kWords};
    }
    if (heating) heated = {to_s, kWords};  // it goes on where the span or the recording ends
    return heated;
  }
};

}  // namespace

const Kind& kind() {
  static const AblationKind kKind;
  return kKind;
}

}  // namespace stylet::procedures::ablation
