#include "engine/procedures/biopsy/kind.h"

#include "engine/procedures/biopsy/biopsy.h"
#include "engine/procedures/biopsy/core_replay.h"

#include <algorithm>
#include <array>

namespace stylet::procedures::biopsy {
namespace {

namespace key = files::key;
using files::Key;

constexpr Gun kGun;
constexpr struct {
  Key samples = key::integer("samples", {1, 20}, "cores wanted").otherwise(1);
  Key throw_length =
      key::number("throw_mm", "mm", {5, 40}, "how far the stylet shoots ahead").otherwise(kGun.throw_length * 1e3);
  Key notch = key::number("notch_mm", "mm", {1, 40}, "length of the core; absent: 5 less than throw_mm").optional();
  Key bore = key::number("bore_mm", "mm", {0.2, 5}, "diameter of the core").otherwise(kGun.bore * 1e3);
} kKeys;

constexpr std::string_view kTumourContent = "tumour_content";
constexpr std::string_view kThrowBeyond = "throw_beyond";
constexpr std::array kMetrics{
    content::MetricRow{kTumourContent, "tumour in the cores", "%",
                       "share of the target's tissue in the volume of the cores wanted", "Stylet",
                       "a core is a cylinder of the bore ahead of the tip, throw less the stylet's own tip long, in "
                       "the tissue as it lies at that moment; one that was not taken holds none"},
    content::MetricRow{kThrowBeyond, "shot beyond the target", "mm",
                       "farthest that a fired stylet came out behind the target, along the needle", "Stylet",
                       "the planned end of the needle; of the cores that hold some of the target"}};

/// Mean of the cores, over as many as were wanted at least; none was taken: nothing.
std::optional<double> tumour_content(std::span<const recording::EventRecord> events, int wanted) {
  double sum = 0;
  int cores = 0;
  for (const recording::EventRecord& event : events) {
    const auto percent = target_percent(event);
    if (!percent) continue;
    sum += *percent;
    ++cores;
  }
  return cores > 0 ? std::optional(sum / std::max(cores, wanted)) : std::nullopt;
}

std::optional<double> throw_beyond(std::span<const recording::EventRecord> events) {
  std::optional<double> farthest;
  for (const recording::EventRecord& event : events) {
    if (const auto beyond = end_beyond(event)) farthest = std::max(farthest.value_or(0), 1e3 * *beyond);
  }
  return farthest;
}

constexpr double kNotchSeen = 0.15;  // s after the shot: the stylet is out, the cannula still to follow

class BiopsyKind final : public Kind {
public:
  std::string_view name() const override { return kName; }
  std::vector<files::Key> keys() const override { return files::keys_of(kKeys); }

  std::unique_ptr<content::ProcedurePlan> read(files::JsonObject& object) const override {
    auto plan = std::make_unique<Plan>();
    plan->samples = object.integer(kKeys.samples);
    Gun& gun = plan->gun;
    gun.throw_length = object.number(kKeys.throw_length) * 1e-3;
    gun.notch = object.number(kKeys.notch, (gun.throw_length - Gun::kStyletPoint) * 1e3) * 1e-3;
    gun.bore = object.number(kKeys.bore) * 1e-3;
    if (gun.notch > gun.throw_length) object.problem(kKeys.notch, "is longer than throw_mm; shorten it");
    return plan;
  }

  std::unique_ptr<Procedure> begin(const content::Scene& scene) const override {
    return std::make_unique<Biopsy>(scene);
  }

  std::unique_ptr<ProcedureReplay> replay(const content::Scene& scene,
                                          std::span<const recording::EventRecord> events) const override {
    return std::make_unique<CoreReplay>(scene, events);
  }

  std::string_view approach_event() const override { return kFiredEvent; }
  std::span<const content::MetricRow> metrics() const override { return kMetrics; }
  std::optional<double> measure(std::string_view metric, std::span<const recording::EventRecord> events,
                                const content::Scene& scene) const override {
    if (metric == kThrowBeyond) return throw_beyond(events);
    const bool planned = scene.exercise.plan && scene.exercise.plan->kind == kName;
    return tumour_content(events, planned ? plan_of(scene.exercise).samples : 1);
  }

  std::optional<DebriefEntry> describe_step(const recording::EventRecord& event) const override {
    if (event.name != kFiredEvent) return std::nullopt;
    const std::string_view number = event.version_1_text();
    return DebriefEntry{
        "Biopsy fired",
        "core " + (number.empty() ? std::to_string(static_cast<int>(event.number("number").value_or(1)))
                                  : std::string(number))};
  }
  std::optional<DebriefEntry> describe_result(const recording::EventRecord& event) const override {
    return event.name == kCoreEvent ? std::optional(DebriefEntry{"Core", in_words(event)}) : std::nullopt;
  }
  std::optional<sound::Cue> cue_of(const recording::EventRecord& event) const override {
    if (event.name != kFiredEvent) return std::nullopt;
    return sound::Cue{.time_s = event.time_s, .sound = sound::Sound::shot};
  }
  std::optional<Still> still(std::span<const recording::EventRecord> events, double, double to_s) const override {
    std::optional<Still> last;
    for (const recording::EventRecord& event : events) {
      if (event.time_s <= to_s && event.name == kFiredEvent)
        last = {std::min(event.time_s + kNotchSeen, to_s), "when the last core was taken"};
    }
    return last;
  }
};

}  // namespace

const Kind& kind() {
  static const BiopsyKind kKind;
  return kKind;
}

}  // namespace stylet::procedures::biopsy
