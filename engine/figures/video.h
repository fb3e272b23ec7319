// H.264 video, with sound where there is any, through the ffmpeg command.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

namespace stylet::figures {

struct VideoSettings {
  int width = 0;   ///< pixels, even
  int height = 0;  ///< pixels, even
  int frames_per_second = 30;
  std::span<const float> sound{};  ///< samples in [-1, 1] of one channel, from the first frame on; empty: none
  int samples_per_second = 0;      ///< of it
  int quality = 20;                ///< constant rate factor of x264: lower is better and larger
  std::string encoder = "ffmpeg";  ///< command, looked for in PATH
};

/// An mp4 in the making: H.264, yuv420p, AAC, plays everywhere. Frames go to an ffmpeg process through a socket; the
/// file appears under its name when finish() succeeds, and not before.
class VideoWriter {
public:
  /// @throws files::ContentError  one line when sizes are odd or the command cannot be started
  VideoWriter(const std::filesystem::path& path, const VideoSettings& settings);
  /// Without finish(): ends the process and removes what it wrote.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// @param rgba  [4 * width * height], rows from the top; the opacity is ignored
  /// @throws files::ContentError  with the last line ffmpeg printed, when it has ended
  void add_frame(std::span<const std::uint8_t> rgba);
  /// Waits for ffmpeg and gives the file its name. Call once.
  /// @throws files::ContentError  with the last line ffmpeg printed, when it failed
  void finish();

  int frames() const { return frames_; }

private:
  struct Process;
  void remove_parts();
  [[noreturn]] void fail(const std::string& what);

  std::filesystem::path path_;
  std::filesystem::path part_;   // what ffmpeg writes
  std::filesystem::path sound_;  // what it reads beside the frames; empty: nothing
  VideoSettings settings_;
  std::unique_ptr<Process> process_;
  int frames_ = 0;
};

}  // namespace stylet::figures
