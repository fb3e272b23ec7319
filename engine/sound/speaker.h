// Plays what it is told, on a thread of its own; without a device it is silent and says so once.
#pragma once

#include "engine/recording/recording_writer.h"
#include "engine/sound/cue.h"

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>

namespace stylet::sound {

/// The thread that makes it is the one that uses it, and never waits for the device: cues go through a lock-free
/// ring.
class Speaker {
public:
  /// @param muted  the device is not opened before this changes
  explicit Speaker(bool muted = false);
  ~Speaker();
  Speaker(const Speaker&) = delete;
  Speaker& operator=(const Speaker&) = delete;

  /// Begins as soon as it is heard: what the device has queued is some 50 ms long.
  void play(const Cue& cue);
  void mute(bool muted);
  bool muted() const { return muted_.load(std::memory_order_relaxed); }
  /// What its user should know since the last call, a line; none: nothing.
  std::optional<std::string> news();

  enum class State : std::uint8_t { closed, plays, silent, lost };
  State state() const { return state_.load(std::memory_order_acquire); }

private:
  void begin();
  void run(const std::stop_token& stop);

  recording::ByteRing cues_;
  std::atomic<bool> muted_;
  std::atomic<State> state_{State::closed};
  State told_ = State::closed;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace stylet::sound
