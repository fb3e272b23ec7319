// A biopsy under way: the gun, its cores, what the trainee is told.
#pragma once

#include "engine/procedures/biopsy/core.h"
#include "engine/procedures/biopsy/plan.h"
#include "engine/procedures/interface/procedure.h"

#include <atomic>
#include <cstdint>
#include <limits>
#include <vector>

namespace stylet::procedures::biopsy {

inline constexpr Action kFire{"fire", "Fire"};

class Biopsy final : public Procedure {
public:
  static constexpr double kCocking = 1.0;  ///< s until the gun can be fired again

  /// @param scene  of this kind; outlives this
  explicit Biopsy(const content::Scene& scene);

  std::unique_ptr<Observation> make_observation() const override;
  void observe(const Step& step, Observation* seen) override;

  std::span<const Action> actions() const override { return {&kFire, 1}; }
  Action trigger() const override { return kFire; }
  std::string reason_against(Action action, const Situation& now) const override;
  void act(Action action, const Situation& now, Events& events) override;
  bool wants_more(const Situation& now) const override;
  void catch_up(const Situation& now, Events& events) override;

  int samples() const override { return fired_; }
  std::uint32_t recoils() const override { return static_cast<std::uint32_t>(fired_); }
  std::string prompt(const PromptInput& input) const override;
  std::string result_in_words() const override;
  void show(state::FrameState& frame) const override;

  /// Cores so far.
  const std::vector<Core>& cores() const { return cores_; }

private:
  struct Seen;

  const content::Scene& scene_;
  const Plan& plan_;
  std::vector<bool> target_tissue_;  // [Scene::tissues]
  int fired_ = 0;
  double fired_s_ = -std::numeric_limits<double>::infinity();  // when
  std::vector<Core> cores_;
  std::vector<state::CoreTrack> tracks_;  // [cores_]
  std::uint32_t taken_ = 0;               // cores, from the simulation thread
  std::atomic<std::uint32_t> wanted_{0};
  // Simulation thread's:
  std::uint32_t cut_ = 0;
  Core core_;  // the last one
  state::CoreTrack track_;
};

}  // namespace stylet::procedures::biopsy
