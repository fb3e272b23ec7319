#include "engine/procedures/aspiration/kind.h"

#include "engine/procedures/aspiration/aspiration.h"
#include "engine/procedures/aspiration/draining_replay.h"

#include <algorithm>
#include <array>

namespace stylet::procedures::aspiration {
namespace {

namespace key = files::key;
using files::Key;

constexpr Syringe kSyringe;
constexpr Fluid kFluid;
constexpr struct {
  Key capacity =
      key::number("syringe_ml", "ml", {1, 100}, "what the syringe holds").otherwise(kSyringe.capacity * 1e6);
  Key vacuum =
      key::number("vacuum_kpa", "kPa", {1, 100}, "most that the hand holds").otherwise(kSyringe.vacuum * 1e-3);
  Key plunger = key::number("plunger_ml_per_s", "ml/s", {0.1, 100}, "how fast the hand pulls at most")
                    .otherwise(kSyringe.plunger_rate * 1e6);
  Key viscosity = key::number("viscosity_mpa_s", "mPa s", {0.5, 1000}, "of the fluid in the cyst")
                      .otherwise(kFluid.viscosity * 1e3);
} kKeys;

constexpr std::array kMetrics{
    content::MetricRow{"aspirated_volume", "fluid drawn", "ml", "fluid of the cyst in the syringe", "Stylet"},
    content::MetricRow{"cyst_residue", "cyst left", "%", "share of the cyst's volume that is left", "Stylet"},
    content::MetricRow{"wall_punctures", "cyst wall punctured", "",
                       "times that the needle's opening came into the cyst", "Stylet"},
    content::MetricRow{"blood_drawn", "blood drawn", "ml", "blood of vessels in the syringe", "Stylet"}};

class AspirationKind final : public Kind {
public:
  std::string_view name() const override { return kName; }
  std::vector<files::Key> keys() const override { return files::keys_of(kKeys); }

  std::unique_ptr<content::ProcedurePlan> read(files::JsonObject& object) const override {
    auto plan = std::make_unique<Plan>();
    Syringe& syringe = plan->syringe;
    syringe.capacity = object.number(kKeys.capacity) * 1e-6;
    syringe.vacuum = object.number(kKeys.vacuum) * 1e3;
    syringe.plunger_rate = object.number(kKeys.plunger) * 1e-6;
    plan->fluid.viscosity = object.number(kKeys.viscosity) * 1e-3;
    return plan;
  }

  std::unique_ptr<Procedure> begin(const content::Scene& scene) const override {
    return std::make_unique<Aspiration>(scene);
  }

  std::unique_ptr<ProcedureReplay> replay(const content::Scene& scene,
                                          std::span<const recording::EventRecord>) const override {
    return std::make_unique<DrainingReplay>(scene);
  }

  std::string_view approach_event() const override { return kStartedEvent; }
  std::span<const content::MetricRow> metrics() const override { return kMetrics; }
  /// Of all that was drawn until then: the last time tells.
  std::optional<double> measure(std::string_view metric, std::span<const recording::EventRecord> events,
                                const content::Scene&) const override {
    std::optional<Outcome> last;
    for (const recording::EventRecord& event : events) {
      if (auto outcome = outcome_of(event)) last = outcome;
    }
    if (!last) return std::nullopt;
    if (metric == "aspirated_volume") return 1e6 * last->drawn;
    if (metric == "cyst_residue") return 100 * last->left_share;
    if (metric == "wall_punctures") return static_cast<double>(last->entries);
    return 1e6 * last->wrong;
  }

  std::string_view sampling_title() const override { return "Aspiration"; }
  std::optional<DebriefEntry> describe_step(const recording::EventRecord& event) const override {
    if (event.name == kStartedEvent) return DebriefEntry{"Aspiration started"};
    return event.name == kStoppedEvent ? std::optional(DebriefEntry{"Aspiration stopped"}) : std::nullopt;
  }
  std::optional<DebriefEntry> describe_result(const recording::EventRecord& event) const override {
    const auto outcome = outcome_of(event);
    return outcome ? std::optional(DebriefEntry{"Aspirated", in_words(*outcome)}) : std::nullopt;
  }
  std::optional<Still> still(std::span<const recording::EventRecord> events, double, double to_s) const override {
    constexpr std::string_view kWords = "when the cyst was emptied";
    std::optional<Still> last;
    bool drawing = false;
    for (const recording::EventRecord& event : events) {
      if (event.time_s > to_s) continue;
      if (event.name == kStartedEvent) drawing = true;
      if (event.name != kStoppedEvent) continue;
      drawing = false;
      last = {event.time_s, kWords};
    }
    if (drawing) last = {to_s, kWords};
    return last;
  }
};

}  // namespace

const Kind& kind() {
  static const AspirationKind kKind;
  return kKind;
}

}  // namespace stylet::procedures::aspiration
