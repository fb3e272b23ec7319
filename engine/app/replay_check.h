// What follows a session and takes its time, beside the window that goes on: the expert to compare with, and whether
// the recording gives the same bits again; then the debriefs of the attempts before.
#pragma once

#include "engine/app/observer.h"
#include "engine/content/scene.h"
#include "engine/debrief/expert.h"
#include "engine/recording/recording.h"

#include <atomic>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace stylet::app {

struct CheckedReplay {
  bool identical = false;
  std::uint64_t hashes = 0;
};

/// Runs the recording again. @param state_hash  of the session
/// @throws files::ContentError, Stopped
CheckedReplay check_replay(const content::Scene& scene, const recording::Recording& recording,
                           std::uint64_t state_hash, Observer& observer);

/// The expert first, then the replay, then the pages of the attempts before, on a thread of its own, which the
/// destructor stops. All else: one other thread.
class BackgroundCheck {
public:
  struct Settings {
    std::string expert{};                           ///< as of chosen_expert()
    bool own_hand = false;                          ///< as of chosen_expert()
    std::uint64_t state_hash = 0;                   ///< of the session
    std::vector<std::filesystem::path> attempts{};  ///< before it, which have no page yet
    std::string gpu{};                              ///< to draw their pictures: by its name or number
  };
  /// Keeps references to scene and recording.
  BackgroundCheck(const content::Scene& scene, const recording::Recording& recording, Settings settings);
  ~BackgroundCheck();
  BackgroundCheck(const BackgroundCheck&) = delete;
  BackgroundCheck& operator=(const BackgroundCheck&) = delete;

  /// Once, when it is known; nobody to compare with is never known.
  std::optional<debrief::Expert> take_expert();
  /// Once, when it is known.
  std::optional<CheckedReplay> take_replay();
  /// What failed, in one line, once.
  std::string take_problem();
  struct Doing {
    std::string task{};  ///< empty: it is done
    double share = 0;
  };
  Doing doing() const;

private:
  class Reporter;
  void work(const content::Scene& scene, const recording::Recording& recording);

  Settings settings_;
  std::atomic<bool> stopped_{false};
  mutable std::mutex mutex_;
  Doing doing_;
  std::optional<debrief::Expert> expert_;
  std::optional<CheckedReplay> replay_;
  std::string problem_;
  std::thread thread_;
};

}  // namespace stylet::app
