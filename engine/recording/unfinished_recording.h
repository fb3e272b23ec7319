// The recording of a session under way, where its user finds it after a crash: OUT/unfinished-TIME-PROCESS.rec.
#pragma once

#include "engine/files/output_directory.h"

#include <filesystem>
#include <vector>

namespace stylet::recording {

/// Its place beside the results of earlier sessions; it has a name of its own until the session's results come.
class UnfinishedRecording {
public:
  /// Makes the folder where it is not there. @throws files::ContentError  it cannot be written to
  explicit UnfinishedRecording(std::filesystem::path folder);
  /// Removes the file, and the folder where the constructor made it; not after keep().
  ~UnfinishedRecording();
  UnfinishedRecording(const UnfinishedRecording&) = delete;
  UnfinishedRecording& operator=(const UnfinishedRecording&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// From now on only finish() takes the file away: whatever fails, what was recorded stays.
  void keep() { kept_ = true; }
  /// The user throws it away: it goes with this.
  void discard() { kept_ = false; }
  /// Commits `out` with the recording as session.rec among its results, then takes the unfinished one away.
  /// @throws files::ContentError  and the unfinished one stays, if kept
  void finish(files::OutputDirectory& out, const std::filesystem::path& last);

private:
  std::filesystem::path folder_;
  std::filesystem::path path_;
  bool made_folder_ = false;
  bool kept_ = false;
};

/// Recordings in a folder whose process ended before its session did, newest first.
std::vector<std::filesystem::path> cut_off_recordings(const std::filesystem::path& folder);

/// What a user means by a recording: a file; of a folder its session.rec, or where there is none the newest that was
/// cut off. A file that is not there is returned as it is.
/// @throws files::ContentError  a folder without one; a session.rec that is not there, with what is instead
std::filesystem::path find_recording(const std::filesystem::path& named);

}  // namespace stylet::recording
