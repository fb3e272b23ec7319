#include "engine/recording/recording_writer.h"

#include "engine/files/error.h"
#include "engine/files/json_scan.h"
#include "engine/recording/recording_format.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <stop_token>

namespace stylet::recording {

using files::ContentError;
using format::RecordBytes;
using format::RecordType;

namespace {

constexpr std::size_t kSessionRingBytes = std::size_t{64} << 10;  // events only, a few a second at most

}  // namespace

ByteRing::ByteRing(std::size_t capacity) : bytes_(std::bit_ceil(std::max<std::size_t>(capacity, 64))) {}

bool ByteRing::push(std::span<const std::uint8_t> message) {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  const std::uint64_t used = head - tail_.load(std::memory_order_acquire);
  if (message.size() > bytes_.size() - used) return false;
  const std::size_t at = head & (bytes_.size() - 1);
  const std::size_t first = std::min(message.size(), bytes_.size() - at);
  std::memcpy(bytes_.data() + at, message.data(), first);
  std::memcpy(bytes_.data(), message.data() + first, message.size() - first);
  head_.store(head + message.size(), std::memory_order_release);
  return true;
}

void ByteRing::drain(std::vector<std::uint8_t>& out) {
  const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  const std::uint64_t head = head_.load(std::memory_order_acquire);
  const std::size_t count = head - tail;
  const std::size_t at = tail & (bytes_.size() - 1);
  const std::size_t first = std::min(count, bytes_.size() - at);
  const auto from = bytes_.begin();
  out.insert(out.end(), from + static_cast<std::ptrdiff_t>(at), from + static_cast<std::ptrdiff_t>(at + first));
  out.insert(out.end(), from, from + static_cast<std::ptrdiff_t>(count - first));
  tail_.store(head, std::memory_order_release);
}

void RecordingChannel::push(std::span<const std::uint8_t> record) {
  if (!ring_.push(record)) lost_.fetch_add(1, std::memory_order_relaxed);
}

void RecordingChannel::add(const HapticStepRecord& r) {
  RecordBytes bytes(RecordType::haptic_step);
  bytes.put(r.step), bytes.put(r.time_s), bytes.put(r.dt_s);
  bytes.put(r.pose.position), bytes.put(r.pose.orientation);
  bytes.put(r.buttons), bytes.put(r.valid), bytes.put(r.patch_epoch);
  push(bytes.finish());
}

void RecordingChannel::add(const SimulationStepRecord& r) {
  RecordBytes bytes(RecordType::simulation_step);
  bytes.put(r.step), bytes.put(r.time_s), bytes.put(r.needle_step);
  bytes.put(r.factor_taken), bytes.put(r.factor_requested), bytes.put(r.factor_epoch);
  bytes.put(r.probe.position), bytes.put(r.probe.orientation);
  for (const double share : r.cavity_shares) bytes.put(share);
  bytes.put(r.inspiration);
  push(bytes.finish());
}

void RecordingChannel::add(const HashRecord& r) {
  RecordBytes bytes(RecordType::hash);
  bytes.put(r.loop == LoopName::simulation), bytes.put(r.final), bytes.put(r.step), bytes.put(r.hash);
  push(bytes.finish());
}

void RecordingChannel::add(const EventRecord& event) {
  RecordBytes bytes(RecordType::event);
  bytes.put(event.time_s), bytes.put(event.step), bytes.put(std::string_view(event.name));
  bytes.put_fields(event.fields);
  push(bytes.finish());
}

void RecordingChannel::add_event(double time_s, std::uint64_t step, std::string_view name,
                                 std::initializer_list<FieldView> fields) {
  RecordBytes bytes(RecordType::event);
  bytes.put(time_s), bytes.put(step), bytes.put(name);
  bytes.put_fields(fields);
  push(bytes.finish());
}

namespace {

/// A new file outlives a power cut once its folder is on the disk.
void sync_folder_of(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

/// A thread that does it again and again, with a pause between.
template <typename Work>
std::jthread every(std::chrono::milliseconds pause, Work work) {
  return std::jthread([pause, work](const std::stop_token& stop) {
    std::mutex mutex;
    std::condition_variable_any paused;
    while (!stop.stop_requested()) {
      work();
      std::unique_lock lock(mutex);
      paused.wait_for(lock, stop, pause, [] { return false; });
    }
  });
}

}  // namespace

struct RecordingWriter::File {
  std::FILE* stream = nullptr;
  ~File() {
    if (stream != nullptr) std::fclose(stream);
  }
};

RecordingWriter::RecordingWriter(const std::filesystem::path& path, const RecordingHeader& header,
                                 std::size_t ring_bytes)
    : path_(path),
      file_(std::make_unique<File>()),
      haptic_(ring_bytes),
      simulation_(ring_bytes),
      session_(kSessionRingBytes) {
  const nlohmann::json settings = nlohmann::json::parse(header.settings_json, nullptr, /*allow_exceptions=*/false);
  if (!settings.is_object()) throw ContentError(path_.string() + ": the settings to record are not a JSON object");
  nlohmann::ordered_json json;
  json["format"] = "stylet-recording";
  json["version"] = kRecordingVersion;
  json["endianness"] = "little";
  json["build"] = header.build;
  json["scenario"] = header.scenario;
  if (!files::is_utf8(header.scenario)) {
    json["scenario_bytes"] = nlohmann::ordered_json::array();
    for (const char c : header.scenario) json["scenario_bytes"].push_back(static_cast<unsigned char>(c));
  }
  json["scenario_hash"] = fmt::format("{:016x}", header.scenario_hash);
  json["settings"] = settings;
  const std::string text = json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);

  file_->stream = std::fopen(path_.c_str(), "wbe");
  if (file_->stream == nullptr) {
    throw ContentError(fmt::format("{}: cannot be written ({}); check folder and permissions", path_.string(),
                                   std::strerror(errno)));
  }
  ::flock(::fileno(file_->stream),
          LOCK_EX | LOCK_NB);  // goes with the process: who finds it free finds a dead session's
  std::vector<std::uint8_t> bytes(format::kMagic.begin(), format::kMagic.end());
  const auto append_u32 = [&bytes](std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
  };
  append_u32(static_cast<std::uint32_t>(text.size()));
  bytes.insert(bytes.end(), text.begin(), text.end());
  append_u32(files::crc32c(bytes));
  write(bytes);
  flush();
  sync();
  unsynced_ = false;
  if (write_failed_) throw ContentError(path_.string() + ": the disk is full");
  sync_folder_of(path_);
  to_disk_ = every(kSyncPeriod, [this] {
    if (unsynced_.exchange(false)) sync();
  });
}

RecordingWriter::~RecordingWriter() = default;  // the threads are the last members: stopped and joined first

void RecordingWriter::write(std::span<const std::uint8_t> bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_->stream) != bytes.size()) write_failed_ = true;
}

void RecordingWriter::flush() {
  if (std::fflush(file_->stream) != 0) write_failed_ = true;
  unsynced_ = true;
}

/// What cannot be synced (a pipe, a device) is written all the same.
void RecordingWriter::sync() {
  if (::fdatasync(::fileno(file_->stream)) != 0 && errno != EINVAL && errno != EROFS) write_failed_ = true;
}

void RecordingWriter::start_background() {
  background_ = every(std::chrono::milliseconds(20), [this] { drain(); });
}

void RecordingWriter::drain() {
  const std::lock_guard lock(drain_mutex_);
  drained_.clear();
  haptic_.ring_.drain(drained_);
  simulation_.ring_.drain(drained_);
  session_.ring_.drain(drained_);
  // Whole records only are in the rings: count the steps by walking from record to record.
  for (std::size_t at = 0; at < drained_.size();) {
    const auto type = static_cast<RecordType>(drained_[at]);
    haptic_steps_ += type == RecordType::haptic_step ? 1 : 0;
    simulation_steps_ += type == RecordType::simulation_step ? 1 : 0;
    std::uint32_t length = 0;
    std::memcpy(&length, &drained_[at + 1], sizeof length);
    at += format::kFrontBytes + length + format::kChecksumBytes;
  }
  if (drained_.empty()) return;
  write(drained_);
  flush();
}

void RecordingWriter::finish() {
  background_ = {};
  to_disk_ = {};
  drain();
  RecordBytes end(RecordType::end);
  end.put(haptic_steps_), end.put(simulation_steps_);
  std::uint64_t lost = 0;
  for (const RecordingChannel* channel : {&haptic_, &simulation_, &session_}) {
    lost += channel->lost_.load(std::memory_order_relaxed);
  }
  end.put(lost);
  write(end.finish());
  flush();
  sync();
  const bool closed = std::fclose(file_->stream) == 0;
  file_->stream = nullptr;
  if (write_failed_ || !closed) {
    throw ContentError(path_.string() +
                       ": could not be written whole; check the space on the disk and `ulimit -f`; `stylet "
                       "debrief` shows what was recorded");
  }
}

}  // namespace stylet::recording
