// A session as it happens: device, loops, recording, force, frames, in threads or in lockstep.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/force_recorder.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/newest_needle.h"
#include "engine/session/recorder.h"
#include "engine/session/recording_writer.h"
#include "engine/session/run_statistics.h"
#include "engine/session/step_hash.h"
#include "engine/session/threaded_run.h"
#include "haptic/device.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::session {

struct LiveSettings {
  physics::Coupling coupling = physics::Coupling::stylet;
  double duration_s = 0;  ///< infinity: until stop()
  bool lockstep = false;
  std::filesystem::path recording{};       ///< file to write
  std::string build{};                     ///< for its header
  HeldProbe* probe = nullptr;              ///< moves the probe of a threaded session; null: the scene does
  std::vector<StepListener*> listeners{};  ///< told of every step after the session's own; they outlive it
};

/// Use: construct (loads the loops), then either run_lockstep() or start() ... stop().
class LiveSession {
public:
  /// @param scene, device  outlive the session
  LiveSession(const content::Scene& scene, haptic::Device& device, const LiveSettings& settings);

  /// @param progress  every simulation step, and with 1 at the end, when the recording can still take events
  RunStatistics run_in_lockstep(const RunProgress& progress = {});

  /// Starts the threads.
  void start();
  bool finished() const { return threads_->finished(); }
  /// Returns when the duration has passed.
  void wait() const { threads_->wait(); }
  double time_s() const { return threads_->time_s(); }
  /// Between start() and stop(): the loops stand, session time stands, the force fades to zero, and engages anew
  /// afterwards. Replays as if the pause had not been. One thread calls both, a second call of either does nothing.
  /// In lockstep, where nobody waits, they do nothing.
  void pause() {
    if (threads_) threads_->pause();
  }
  void resume() {
    if (threads_) threads_->resume();
  }
  bool paused() const { return threads_ && threads_->paused(); }
  /// Puts something on record that no loop knows of: what the user did. One thread, before stop() or the end of
  /// run_in_lockstep(); texts as in EventRecord.
  void add_event(double time_s, std::uint64_t haptic_step, std::string_view name, std::string_view detail = {}) {
    writer_.session().add_event(time_s, haptic_step, name, detail);
  }
  /// What the pictures show; any thread.
  const state::StateBuffer& frames() const { return frames_.buffer(); }
  /// The needle as it is now, newer than any of frames(); one thread.
  NewestNeedle& newest_needle() { return needle_; }
  /// Stops the threads and completes the recording.
  RunStatistics stop();

  // After the run.
  const ForceTrace& force() const { return force_.trace(); }
  std::uint64_t state_hash() const { return hash_.state(); }
  double closest_target_distance() const { return frames_.closest_target_distance(); }
  /// Not set where the probe is held in the air.
  std::optional<ProbeSummary> probe() const {
    return scene_.probe.presses >= 0 ? std::optional(frames_.probe()) : std::nullopt;
  }

private:
  std::vector<StepListener*> listeners();
  void finish();

  const content::Scene& scene_;
  haptic::Device& device_;
  LiveSettings settings_;
  physics::StylusPose start_;
  physics::NeedleBase base_;
  RecordingWriter writer_;
  StepHash hash_;
  Recorder recorder_;
  ForceRecorder force_;
  FramePublisher frames_;
  NewestNeedle needle_;
  CoupledLoops loops_;
  std::optional<ThreadedRun> threads_;
};

}  // namespace stylet::session
