#include "engine/training/training_session.h"

#include "engine/procedures/kinds.h"

#include <array>
#include <cstdint>
#include <utility>

namespace stylet::training {
namespace {

std::unique_ptr<procedures::Procedure> begin(const content::Scene& scene) {
  const procedures::Kind* kind = procedures::kind_of(scene.exercise);
  return kind != nullptr ? kind->begin(scene) : nullptr;
}

}  // namespace

TrainingSession::TrainingSession(const content::Scene& scene, const TrainingSettings& settings)
    : procedure_(begin(scene)),
      watch_(scene, procedure_.get()),
      flow_(scene.exercise, scene.targets.size(), settings.automatic, procedure_.get(), settings.controls),
      begun_(settings.begun) {}

const Events& TrainingSession::step(std::span<const Action> actions) {
  const Watched& seen = watch_.latest();
  tip_tissue_ = seen.tip_tissue;
  happened_ = flow_.step(seen.now, actions);
  if (procedure_) {
    procedure_->catch_up(seen.now, happened_);
    shown_.add(seen.now.time_s, *procedure_);
  }
  if (begun_ && flow_.state().stage != Stage::briefing) std::exchange(begun_, nullptr)();
  return happened_;
}

const FlowState& TrainingSession::poll(session::LiveSession& live, std::span<const Action> actions) {
  for (const recording::EventRecord& event : step(actions)) live.add_event(event);
  if (const std::uint32_t recoils = procedure_ ? procedure_->recoils() : 0; recoils != recoils_) {
    recoils_ = recoils;
    live.click();
  }
  if (flow_.state().paused != live.paused()) flow_.state().paused ? live.pause() : live.resume();
  return flow_.state();
}

void TrainingSession::end(session::LiveSession& live) {
  constexpr std::array kFinish{Action::finish};
  const Stage stage = flow_.state().stage;
  if (stage == Stage::procedure || stage == Stage::sampling) {
    poll(live, kFinish);
  } else {
    poll(live);
  }
}

}  // namespace stylet::training
