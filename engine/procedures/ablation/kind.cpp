#include "engine/procedures/ablation/kind.h"

#include "engine/procedures/ablation/heating.h"
#include "engine/procedures/ablation/zone_replay.h"

#include <algorithm>
#include <array>

namespace stylet::procedures::ablation {
namespace {

constexpr std::array kKeys{"exposed_mm", "power_w", "max_temperature_c", "duration_s", "time_factor", "margin_mm"};
constexpr std::array kMetrics{KindMetric{"ablation_coverage", "ablation coverage", "%",
                                         "share of the target and 5 mm around it in the ablated zone", "Stylet"}};

class AblationKind final : public Kind {
public:
  std::string_view name() const override { return kName; }
  std::span<const char* const> keys() const override { return kKeys; }

  std::unique_ptr<content::ProcedurePlan> read(files::JsonObject& object) const override {
    auto plan = std::make_unique<Plan>();
    plan->exposed = object.number("exposed_mm", {5, 50}, plan->exposed * 1e3) * 1e-3;
    plan->power_w = object.number("power_w", {1, 300}, plan->power_w);
    plan->max_temperature = object.number("max_temperature_c", {50, 110}, plan->max_temperature);
    plan->duration_s = object.number("duration_s", {10, 3600}, plan->duration_s);
    plan->time_factor = object.number("time_factor", {1, 600}, plan->time_factor);
    plan->margin = object.number("margin_mm", {0, 20}, plan->margin * 1e3) * 1e-3;
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
  std::span<const KindMetric> metrics() const override { return kMetrics; }
  /// Of all that was heated until then: the last time tells.
  std::optional<double> measure(std::string_view, std::span<const recording::EventRecord> events) const override {
    const auto told = std::find_if(events.rbegin(), events.rend(),
                                   [](const recording::EventRecord& event) { return event.name == kAblatedEvent; });
    return told == events.rend() ? std::nullopt : std::optional(coverage_percent(*told));
  }

  std::string_view sampling_title() const override { return "Ablation"; }
  std::optional<Told> tell_step(const recording::EventRecord& event) const override {
    if (event.name == kStartedEvent) return Told{"Ablation started"};
    if (event.name != kStoppedEvent) return std::nullopt;
    return Told{"Ablation stopped", event.version_1_text().empty() ? recording::fields_in_words(event)
                                                                   : std::string(event.version_1_text())};
  }
  std::optional<Told> tell_result(const recording::EventRecord& event) const override {
    return event.name == kAblatedEvent ? std::optional(Told{"Ablated", in_words(event)}) : std::nullopt;
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
