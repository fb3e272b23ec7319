// The zone of a recorded session at any time: grown again from the recording's events and the replayed needle.
#pragma once

#include "engine/content/heated_zone.h"
#include "engine/procedures/ablation/ablation.h"
#include "engine/procedures/interface/procedure.h"
#include "engine/recording/recording.h"

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

namespace stylet::procedures::ablation {

/// Remembers of a replay where the electrode was when it began to heat. zone_at() then does what the session did: the
/// same Ablation, heated for the same seconds.
class ZoneReplay final : public ProcedureReplay {
public:
  /// @param scene   of this kind; outlives this
  /// @param events  of the recording
  ZoneReplay(const content::Scene& scene, std::span<const recording::EventRecord> events);

  void observe(const Step& step, const Situation& now) override;
  void show_at(double time_s, state::FrameState& frame) override;

  /// Null: nothing was heated until then. Threads as show_at().
  std::shared_ptr<const content::HeatedZone> zone_at(double time_s);
  /// The zone last asked for; null: none.
  const Ablation* ablation() const { return ablation_ ? &*ablation_ : nullptr; }

private:
  static constexpr double kSameTime = 1e-6;  // s
  /// From the start of heating to its end.
  struct Heating {
    double begin_s = 0;
    double end_s = 0;     ///< infinite: the recording ends before
    double heated_s = 0;  ///< by the tissue's clock, until end_s since the first start
    std::uint64_t haptic_step = 0;
    std::optional<Electrode> electrode{};
    int body = -1;
    int target = -1;
  };
  std::optional<Heating> heating(std::size_t i) const;
  /// More than any session heats, since Flow stops at the plan's duration: a hostile recording may tell of years.
  double most_heated_s() const;

  const content::Scene& scene_;
  mutable std::mutex mutex_;  // of heatings_
  std::vector<Heating> heatings_;
  std::optional<Ablation> ablation_;
  std::size_t done_ = 0;  // heatings that ablation_ has begun
  int body_ = -1;
  double shown_s_ = 0;
  std::shared_ptr<const content::HeatedZone> zone_;
};

}  // namespace stylet::procedures::ablation
