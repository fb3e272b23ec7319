// A session as it happens: device, loops, recording, force, frames, in threads or in lockstep.
#pragma once

#include "engine/content/scene.h"
#include "engine/recording/recording_writer.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/force_recorder.h"
#include "engine/session/force_scale.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/held_probe.h"
#include "engine/session/newest_needle.h"
#include "engine/session/recorder.h"
#include "engine/session/run_statistics.h"
#include "engine/session/schedule.h"
#include "engine/session/step_hash.h"
#include "haptic/device.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::session {

/// Session time that passes with a picture of a session in lockstep, s.
inline constexpr double kLockstepFrame = 1.0 / 60;

struct LiveSettings {
  physics::Coupling coupling = physics::Coupling::stylet;
  double duration_s = 0;  ///< infinity: until stop()
  bool lockstep = false;
  std::filesystem::path recording{};          ///< file to write
  std::string build{};                        ///< for its header
  HeldProbe* probe = nullptr;                 ///< moves the probe; null: the scene does
  std::optional<std::uint32_t> start_seed{};  ///< that needle and probe were placed by, for the recording
  std::vector<StepListener*> listeners{};     ///< told of every step after the session's own; they outlive it
};

/// Use: construct (loads the loops), start(), advance() with every frame until finished(), stop(). In threads time
/// passes by itself, in lockstep by advance() alone; whoever looks on need not know which.
class LiveSession {
public:
  /// @param scene, device  outlive the session
  LiveSession(const content::Scene& scene, haptic::Device& device, const LiveSettings& settings);

  /// The threads begin, or the schedule that advance() goes by.
  void start();
  /// In lockstep, makes the steps of so much more session time, s; in threads, nothing. The thread that start()ed.
  void advance(double by_s);
  bool lockstep() const { return settings_.lockstep; }
  bool finished() const { return schedule_->finished(); }
  double time_s() const { return schedule_->time_s(); }
  /// Session time when CLOCK_MONOTONIC read so, ns: s; negative: before the start, or in lockstep.
  double time_of(std::int64_t clock_ns) const { return schedule_->time_of(clock_ns); }
  /// Returns when the duration has passed.
  void wait();
  /// Between start() and stop(): the loops stand, session time stands, the force fades to zero, and engages anew
  /// afterwards. Replays as if the pause had not been. One thread calls both, a second call of either does nothing.
  void pause() { schedule_->pause(); }
  void resume() { schedule_->resume(); }
  bool paused() const { return schedule_->paused(); }
  /// Between start() and stop(): the hand is to feel that something was fired in it. Output only: no state and no
  /// record knows of it but by how the hand then moves. Any thread.
  void click() { schedule_->click(); }
  /// From start() to stop() in lockstep.
  /// @param progress  before every simulation step, and with 1 at the end, when the recording can still take events
  RunStatistics run_in_lockstep(const RunProgress& progress = {});
  /// Puts something on record that no loop knows of: what the user did. One thread, before stop() or the end
  /// of run_in_lockstep().
  void add_event(const recording::EventRecord& event) { writer_.session().add(event); }
  /// What the pictures show; any thread.
  const state::StateBuffer& frames() const { return frames_.buffer(); }
  /// The needle as it is now, newer than any of frames(); one thread.
  NewestNeedle& newest_needle() { return needle_; }
  /// Ends the run and completes the recording.
  RunStatistics stop();

  // After the run.
  const figures::ForceTrace& force() const { return force_.trace(); }
  const physics::PassivitySummary& passivity() const { return force_.passivity(); }
  std::uint64_t state_hash() const { return hash_.state(); }
  double closest_target_distance() const { return frames_.closest_target_distance(); }
  /// Not set for a device that renders no force. @param run  of stop()
  std::optional<ForceOutput> force_output(const RunStatistics& run) const;
  /// Not set where the probe is held in the air.
  std::optional<ProbeSummary> probe() const {
    return scene_.probe.presses >= 0 ? std::optional(frames_.probe()) : std::nullopt;
  }

private:
  std::vector<StepListener*> listeners();

  const content::Scene& scene_;
  haptic::Device& device_;
  LiveSettings settings_;
  physics::StylusPose start_;
  physics::NeedleBase base_;
  recording::RecordingWriter writer_;
  StepHash hash_;
  Recorder recorder_;
  ForceRecorder force_;
  FramePublisher frames_;
  NewestNeedle needle_;
  CoupledLoops loops_;
  std::unique_ptr<Schedule> schedule_;  // after start()
};

}  // namespace stylet::session
