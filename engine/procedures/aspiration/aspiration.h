// An aspiration under way: fluid flows while the opening lies in it, the cyst shrinks, the trainee is told.
#pragma once

#include "engine/procedures/aspiration/flow.h"
#include "engine/procedures/aspiration/outcome.h"
#include "engine/procedures/aspiration/plan.h"
#include "engine/procedures/interface/procedure.h"

#include <atomic>
#include <vector>

namespace stylet::procedures::aspiration {

inline constexpr Action kDraw{"aspiration_start", "Draw"};
inline constexpr Action kStop{"aspiration_stop", "Stop drawing"};

class Aspiration final : public Procedure {
public:
  /// Of a cavity's volume at rest: what is left between its walls when they meet around the needle. Below 0.23 its
  /// tetrahedra turn inside out.
  static constexpr double kResidue = 0.25;
  static constexpr double kDry = 1.0;  ///< s without flow, after which one who is not there stops drawing

  /// @param scene  of this kind; outlives this
  explicit Aspiration(const content::Scene& scene);

  std::unique_ptr<Observation> make_observation() const override;
  void observe(const Step& step, Observation* seen) override;
  void fill_cavities(std::span<double> shares) override;

  std::span<const Action> actions() const override;
  Action trigger() const override { return drawing_ ? kStop : kDraw; }
  std::string reason_against(Action action, const Situation& now) const override;
  void act(Action action, const Situation& now, Events& events) override;
  bool only_stops(Action action) const override { return action == kStop; }
  void pass(double elapsed_s) override;
  void go_on(const Situation& now, Events& events) override;
  void finish(const Situation& now, Events& events) override;
  void catch_up(const Situation& now, Events& events) override;

  int samples() const override { return stops_; }
  std::string prompt(const PromptInput& input) const override;
  std::string result_in_words() const override;
  void show(state::FrameState& frame) const override;

  /// As the last step left it.
  const Outcome& outcome() const { return outcome_; }

private:
  struct Seen;
  /// Cavity that a point of the tissue at rest is in; -1: it is in none.
  int cavity_at(const content::TissuePlace& place) const;
  void stop(const Situation& now, Events& events);
  const Seen* seen(const Situation& now) const;

  const content::Scene& scene_;
  const Plan& plan_;
  Bore bore_;
  std::vector<bool> blood_;               // [Scene::tissues]
  std::vector<Eigen::Vector3d> centers_;  // [cavities] at rest
  double volume_ = 0;                     // of all cavities at rest
  bool drawing_ = false;
  int stops_ = 0;
  double dry_s_ = 0;  // for how long nothing has come
  double flow_ = 0;
  Outcome outcome_;
  std::vector<float> shares_;  // [cavities] that are left
  state::SyringeState syringe_shown_;
  std::atomic<bool> pulls_{false};
  // Simulation thread's:
  DrawState syringe_;
  std::vector<double> left_;  // [cavities] m^3
  double last_s_ = -1;
  bool inside_ = false;
  Outcome so_far_;
};

}  // namespace stylet::procedures::aspiration
