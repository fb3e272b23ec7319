#include "engine/app/replay_check.h"

#include "engine/app/debrief_recording.h"
#include "engine/app/expert_choice.h"
#include "engine/session/replay.h"

#include <utility>

namespace stylet::app {

CheckedReplay check_replay(const content::Scene& scene, const recording::Recording& recording,
                           std::uint64_t state_hash, Observer& observer) {
  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash}, settings.base);
  const session::ReplayResult result =
      session::replay(recording, loops, hash, [&](double share) { show_progress(observer, "Replaying", share); });
  return {.identical = result.identical() && hash.state() == state_hash, .hashes = result.compared};
}

/// What the thread's work tells, where the window finds it.
class BackgroundCheck::Reporter final : public Observer {
public:
  explicit Reporter(BackgroundCheck& check) : check_(check) {}
  void progress(const std::string& task, double share) override {
    const std::lock_guard lock(check_.mutex_);
    check_.doing_ = {task, share};
  }
  bool stop_requested() override { return check_.stopped_; }

private:
  BackgroundCheck& check_;
};

BackgroundCheck::BackgroundCheck(const content::Scene& scene, const recording::Recording& recording,
                                 Settings settings)
    : settings_(std::move(settings)), doing_{"Replaying", 0}, thread_([this, &scene, &recording] {
        try {
          work(scene, recording);
        } catch (const Stopped&) {
        } catch (const std::exception& error) {
          const std::lock_guard lock(mutex_);
          problem_ = error.what();
        }
        const std::lock_guard lock(mutex_);
        doing_ = {};
      }) {}

BackgroundCheck::~BackgroundCheck() {
  stopped_ = true;
  thread_.join();
}

void BackgroundCheck::work(const content::Scene& scene, const recording::Recording& recording) {
  Reporter reporter(*this);
  auto expert = chosen_expert(settings_.expert, settings_.own_hand, scene, reporter);
  {
    const std::lock_guard lock(mutex_);
    expert_ = std::move(expert);
  }
  const CheckedReplay checked = check_replay(scene, recording, settings_.state_hash, reporter);
  {
    const std::lock_guard lock(mutex_);
    replay_ = checked;
  }
  for (const std::filesystem::path& folder : settings_.attempts) {
    debrief_recording({.recording = folder.string(), .expert = settings_.expert, .out = folder, .gpu = settings_.gpu},
                      reporter);
  }
}

std::optional<debrief::Expert> BackgroundCheck::take_expert() {
  const std::lock_guard lock(mutex_);
  return std::exchange(expert_, std::nullopt);
}

std::optional<CheckedReplay> BackgroundCheck::take_replay() {
  const std::lock_guard lock(mutex_);
  return std::exchange(replay_, std::nullopt);
}

std::string BackgroundCheck::take_problem() {
  const std::lock_guard lock(mutex_);
  return std::exchange(problem_, {});
}

BackgroundCheck::Doing BackgroundCheck::doing() const {
  const std::lock_guard lock(mutex_);
  return doing_;
}

}  // namespace stylet::app
