#include "engine/figures/video.h"

#include "engine/files/child_process.h"
#include "engine/files/error.h"

#include <fmt/core.h>

#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

namespace stylet::figures {

using files::ContentError;

/// The running command and our ends of its input and messages.
struct VideoWriter::Process {
  std::optional<files::ChildProcess> child{};
  int frames = -1;    // socket to its standard input: unlike a pipe, one that can be written without SIGPIPE
  int messages = -1;  // memory file that is its standard error: unlike a pipe, it never fills

  ~Process() {
    close_input();
    child.reset();
    if (messages >= 0) close(messages);
  }
  void close_input() {
    if (frames >= 0) close(std::exchange(frames, -1));
  }
  std::string last_message() const {
    std::string text(4096, '\0');
    const off_t size = lseek(messages, 0, SEEK_END);
    const off_t from = std::max<off_t>(0, size - static_cast<off_t>(text.size()));
    const ssize_t got = pread(messages, text.data(), text.size(), from);
    text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    const std::size_t line = text.find_last_of("\r\n");
    return text.empty() ? "it gave no reason" : text.substr(line == std::string::npos ? 0 : line + 1);
  }
};

namespace {

/// Raw samples, 32-bit floating point. @throws ContentError
void write_samples(const std::filesystem::path& path, std::span<const float> samples) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(samples.data()), static_cast<std::streamsize>(samples.size_bytes()));
  if (file.flush()) return;
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  throw ContentError(path.string() + ": cannot be written; is the disk full?");
}

}  // namespace

VideoWriter::VideoWriter(const std::filesystem::path& path, const VideoSettings& settings)
    : path_(path), part_(path.string() + ".part"), settings_(settings), process_(std::make_unique<Process>()) {
  if (settings.width <= 0 || settings.height <= 0 || settings.width % 2 != 0 || settings.height % 2 != 0) {
    throw ContentError(fmt::format("{}: a video of {} x {} pixels cannot be made; width and height must be even",
                                   path.string(), settings.width, settings.height));
  }
  std::vector<std::string> words{settings.encoder, "-hide_banner", "-nostdin", "-loglevel", "error", "-y",
                                 // what comes in
                                 "-f", "rawvideo", "-pixel_format", "rgba", "-video_size",
                                 fmt::format("{}x{}", settings.width, settings.height), "-framerate",
                                 std::to_string(settings.frames_per_second), "-i", "pipe:0"};
  const auto add = [&](std::initializer_list<std::string> more) { words.insert(words.end(), more); };
  if (!settings.sound.empty()) {
    sound_ = path.string() + ".sound.part";
    write_samples(sound_, settings.sound);
    add({"-f", "f32le", "-ar", std::to_string(settings.samples_per_second), "-ac", "1", "-i", sound_.string(), "-c:a",
         "aac", "-b:a", "96k"});
  }
  add({"-c:v", "libx264", "-preset", "veryfast", "-crf", std::to_string(settings.quality), "-pix_fmt", "yuv420p",
       "-movflags", "+faststart", "-f", "mp4", part_.string()});
  int ends[2] = {-1, -1};
  process_->messages = memfd_create("ffmpeg messages", MFD_CLOEXEC);
  if (process_->messages < 0 || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    remove_parts();
    throw ContentError(fmt::format("{}: no video: {}", path.string(), std::strerror(errno)));
  }
  process_->frames = ends[0];
  int error = 0;
  try {
    process_->child.emplace(files::ChildSettings{.command = words, .input = ends[1], .messages = process_->messages});
  } catch (const std::system_error& problem) {
    error = problem.code().value();
  }
  close(ends[1]);
  if (error != 0) {
    remove_parts();
    throw ContentError(fmt::format("{}: no video: cannot start '{}' ({}); install ffmpeg", path.string(),
                                   settings.encoder, std::strerror(error)));
  }
}

VideoWriter::~VideoWriter() {
  if (process_ == nullptr) return;
  process_.reset();
  remove_parts();
}

void VideoWriter::remove_parts() {
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
  if (!sound_.empty()) std::filesystem::remove(sound_, ignored);
}

void VideoWriter::fail(const std::string& what) {
  const std::string reason = process_->last_message();
  process_.reset();
  remove_parts();
  throw ContentError(fmt::format("{}: no video: {}: {}", path_.string(), what, reason));
}

void VideoWriter::add_frame(std::span<const std::uint8_t> rgba) {
  const std::size_t expected =
      4 * static_cast<std::size_t>(settings_.width) * static_cast<std::size_t>(settings_.height);
  if (rgba.size() != expected) {
    throw ContentError(fmt::format("{}: a frame has {} bytes instead of {}", path_.string(), rgba.size(), expected));
  }
  if (process_ == nullptr) throw ContentError(path_.string() + ": no video: the encoder has ended");
  while (!rgba.empty()) {
    const ssize_t sent = send(process_->frames, rgba.data(), rgba.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) {
      process_->close_input();
      const int status = process_->child->wait();
      fail(fmt::format("'{}' ended early with status {}", settings_.encoder, status));
    }
    rgba = rgba.subspan(sent);
  }
  ++frames_;
}

void VideoWriter::finish() {
  if (process_ == nullptr) throw ContentError(path_.string() + ": no video: the encoder has ended");
  process_->close_input();
  if (const int status = process_->child->wait(); status != 0) {
    fail(fmt::format("'{}' ended with status {}", settings_.encoder, status));
  }
  process_.reset();
  std::error_code error;
  std::filesystem::rename(part_, path_, error);
  remove_parts();
  if (error) throw ContentError(fmt::format("{}: no video: {}", path_.string(), error.message()));
}

}  // namespace stylet::figures
