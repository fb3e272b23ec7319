// An ablation under way: the electrode is started and stopped, the zone grows, the trainee is told.
#pragma once

#include "engine/procedures/ablation/ablation.h"
#include "engine/procedures/ablation/outcome.h"
#include "engine/procedures/ablation/plan.h"
#include "engine/procedures/interface/procedure.h"

#include <memory>
#include <optional>

namespace stylet::procedures::ablation {

inline constexpr Action kStart{"ablation_start", "Heat"};
inline constexpr Action kStop{"ablation_stop", "Stop heating"};

/// An electrode in the patient.
struct PlacedElectrode {
  Electrode electrode;  ///< at rest
  int body = -1;        ///< deformable body that its tip is in
};
PlacedElectrode placed_electrode(const Step& step, const content::Scene& scene);

class Heating final : public Procedure {
public:
  /// @param scene  of this kind; outlives this
  explicit Heating(const content::Scene& scene);

  std::unique_ptr<Observation> make_observation() const override;
  void observe(const Step& step, Observation* seen) override;

  std::span<const Action> actions() const override;
  Action trigger() const override { return heating_ ? kStop : kStart; }
  std::string reason_against(Action action, const Situation& now) const override;
  void act(Action action, const Situation& now, Events& events) override;
  bool only_stops(Action action) const override { return action == kStop; }
  void pass(double elapsed_s) override;
  void go_on(const Situation& now, Events& events) override;
  void finish(const Situation& now, Events& events) override;
  void catch_up(const Situation& now, Events& events) override;

  std::string prompt(const PromptInput& input) const override;
  std::string result_in_words() const override;
  void show(state::FrameState& frame) const override;

  bool heating() const { return heating_; }
  double heated_s() const { return heated_s_; }  ///< by the tissue's clock: session time times Plan::time_factor
  /// What was told last; none: nothing was heated and stopped.
  const std::optional<Outcome>& outcome() const { return outcome_; }
  /// The zone, once there is one.
  const Ablation* ablation() const { return ablation_ ? &*ablation_ : nullptr; }
  /// Deformable body that it is in.
  int ablated_body() const { return body_; }

private:
  struct Seen;
  void stop(const Situation& now, Events& events);

  const content::Scene& scene_;
  const Plan& plan_;
  bool heating_ = false;
  double heated_s_ = 0;
  double stopped_s_ = 0;  // session time of the last stop
  bool told_ = false;     // the outcome, since the last catch_up()
  std::optional<Ablation> ablation_;
  int body_ = -1;
  std::optional<Outcome> outcome_;
  std::shared_ptr<const content::HeatedZone> zone_;
};

}  // namespace stylet::procedures::ablation
