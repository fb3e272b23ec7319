// A tissue table that is edited while a session runs: its acoustics, read again whenever the file changes.
#pragma once

#include "engine/content/scene.h"

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace stylet::readers {

/// Polls a file; no thread of its own, so not for the loops.
class TissueWatch {
public:
  using Clock = std::chrono::steady_clock;

  /// Watches the table that `scene` was read from. A table that cannot be found is waited for.
  explicit TissueWatch(const content::Scene& scene);

  /// Looks at most once a second, and reads the table where it changed since.
  /// @return  whether tissues() or problem() did
  bool poll(Clock::time_point now = Clock::now());

  /// The scene's, with the acoustics of the tissues that the table has by the same name; mechanics as they were.
  const std::vector<content::Tissue>& tissues() const { return tissues_; }
  /// "file:place: what is wrong" of the table read last, and tissues() are those before it; empty: it was sound.
  const std::string& problem() const { return problem_; }

private:
  void read();

  std::filesystem::path table_;
  std::vector<content::Tissue> tissues_;
  std::string problem_;
  std::filesystem::file_time_type written_{};
  Clock::time_point next_{};
};

}  // namespace stylet::readers
