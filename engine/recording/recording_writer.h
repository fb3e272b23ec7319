// Writes a recording while the loops run: real-time threads put records into rings, another thread moves them to
// disk.
#pragma once

#include "engine/recording/recording.h"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <span>
#include <string_view>
#include <thread>
#include <vector>

namespace stylet::recording {

/// Bytes from one producer thread to one consumer thread, whole messages only. Capacity fixed at construction.
class ByteRing {
public:
  /// @param capacity  bytes, rounded up to a power of two
  explicit ByteRing(std::size_t capacity);

  /// Producer: all of `message` or nothing. @return false when there is no room
  /// @realtime no allocation, no lock, never waits
  bool push(std::span<const std::uint8_t> message);
  /// Consumer: appends everything present to `out`.
  void drain(std::vector<std::uint8_t>& out);

private:
  std::vector<std::uint8_t> bytes_;
  alignas(64) std::atomic<std::uint64_t> head_{0};  // written so far (producer's)
  alignas(64) std::atomic<std::uint64_t> tail_{0};  // read so far (consumer's)
};

/// One thread's way into the recording. All add() functions are for that thread alone.
/// @realtime no allocation, no lock, no file; a record that finds the ring full is dropped and counted
class RecordingChannel {
public:
  explicit RecordingChannel(std::size_t ring_bytes) : ring_(ring_bytes) {}

  void add(const HapticStepRecord& record);
  void add(const SimulationStepRecord& record);
  void add(const HashRecord& record);
  /// Texts longer than kMaxEventText bytes are cut, fields that do not fit are left out.
  void add(const EventRecord& event);
  /// The same for threads that take no memory.
  void add_event(double time_s, std::uint64_t step, std::string_view name,
                 std::initializer_list<FieldView> fields = {});

private:
  friend class RecordingWriter;
  void push(std::span<const std::uint8_t> record);

  ByteRing ring_;
  std::atomic<std::uint64_t> lost_{0};
};

/// The file. One channel for the thread of each loop and one for the session's own; drain() hands what they hold to
/// the system, a thread of its own takes it from there to the disk, which may be slow. A process that is killed has
/// written what was drained; a power cut takes what came after the last sync that
/// was done: with a disk that is not busy less than a second.
class RecordingWriter {
public:
  static constexpr std::chrono::milliseconds kSyncPeriod{800};

  /// Creates the file and writes the header; both are on the disk when it returns.
  /// @param ring_bytes  of each loop's channel; 4 MiB hold about 40 s of haptic steps at 1 kHz
  /// @throws files::ContentError  when the file cannot be made or written
  RecordingWriter(const std::filesystem::path& path, const RecordingHeader& header,
                  std::size_t ring_bytes = std::size_t{4} << 20);
  /// Stops the background thread. Without finish() the file stays without its end record: readable, not complete.
  ~RecordingWriter();
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  RecordingChannel& haptic() { return haptic_; }          ///< for the haptic thread
  RecordingChannel& simulation() { return simulation_; }  ///< for the simulation thread
  RecordingChannel& session() { return session_; }        ///< for the thread that runs the session: its events

  /// Drains every 20 ms from a thread of its own until finish(). Threaded sessions; in lockstep call drain() instead.
  void start_background();
  /// Moves everything present to the file. Not for the loops' own threads in a real-time session (file, lock). A
  /// write error is kept and thrown by finish().
  void drain();
  /// Drains, writes the end record and closes the file. The loops must have stopped. Call once.
  /// @throws files::ContentError  when something could not be written
  void finish();

private:
  struct File;
  void write(std::span<const std::uint8_t> bytes);
  void flush();
  void sync();

  std::filesystem::path path_;
  std::unique_ptr<File> file_;
  RecordingChannel haptic_;
  RecordingChannel simulation_;
  RecordingChannel session_;
  std::mutex drain_mutex_;  // drain() may be called from the background and from finish()
  std::vector<std::uint8_t> drained_;
  std::uint64_t haptic_steps_ = 0;
  std::uint64_t simulation_steps_ = 0;
  std::atomic<bool> write_failed_ = false;
  std::atomic<bool> unsynced_ = false;
  std::jthread to_disk_;
  std::jthread background_;
};

}  // namespace stylet::recording
