// What Stylet and its device host share: reports both ways and what the host is at, in memory of both processes.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace stylet::haptic::host {

/// One writer, one reader, in two processes. Each entry has a counter that tells which report it is and whether it is
/// whole; the reader of a writer that has overtaken it goes on with what there still is. Neither waits for the other.
class ReportRing {
public:
  static constexpr std::size_t kMost = 64;   ///< reports that it holds
  static constexpr std::size_t kBytes = 31;  ///< a report at most

  /// Writer. @return false: it is too long
  bool put(std::span<const std::uint8_t> report);
  /// Reader. @param next  of the reader: how many it has had; 0 at first
  /// @return bytes; 0: there is none
  std::size_t take(std::uint64_t& next, std::span<std::uint8_t> report) const;
  /// Reader: waits until there is another than the first `had`, at most so long. @return whether there is
  bool wait(std::uint64_t had, std::int64_t timeout_ns) const;
  std::uint64_t written() const { return written_.load(std::memory_order_acquire); }

private:
  struct Entry {
    std::atomic<std::uint64_t> count;  // 2 n + 1 while report n (from 1) is being written, 2 n + 2 once it is
    std::array<std::atomic<std::uint64_t>, 4> words;
  };
  std::atomic<std::uint64_t> written_;
  std::atomic<std::uint32_t> bell_;  // futex
  std::array<Entry, kMost> entries_;
};

inline constexpr double kMostForce = 16;  ///< N, an axis: the range of the reports; a device may give less

enum class HostState : std::uint32_t {
  kStarting,
  kNotInstalled,  ///< the vendor's library is not there
  kFailed,        ///< it is, but no device can be used
  kReady,
  kGone,  ///< the device was there
};

/// The memory itself: zeros at first.
struct Channel {
  static constexpr std::uint64_t kVersion = 2;
  static constexpr std::size_t kText = 256;

  std::atomic<std::uint64_t> version;             ///< by Stylet, before the host is started
  ReportRing poses;                               ///< input reports, to Stylet
  ReportRing orders;                              ///< output reports, to the host
  std::atomic<std::int64_t> alive_ns;             ///< by the host, each turn, CLOCK_MONOTONIC
  std::atomic<std::uint32_t> quit;                ///< by Stylet
  std::atomic<std::uint32_t> tells;               ///< by the host: the device says what its motors give
  std::array<std::atomic<double>, 3> told_force;  ///< that, axes of the reports, N; may be of two turns
  std::atomic<HostState> state;                   ///< by the host, after what it says below
  std::array<char, kText> name;                   ///< of the device
  std::array<char, kText> serial;                 ///< of the device
  std::array<char, kText> message;                ///< why not, and what to do; or what the device needs

  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
};

void put_text(std::array<char, Channel::kText>& where, const std::string& text);
std::string text_of(const std::array<char, Channel::kText>& where);

/// A channel in a file descriptor that a child may inherit; unmapped and closed at the end.
class SharedChannel {
public:
  /// A new one. @throws std::runtime_error
  SharedChannel();
  /// That of another process. @throws std::runtime_error
  explicit SharedChannel(int file);
  ~SharedChannel();
  SharedChannel(const SharedChannel&) = delete;
  SharedChannel& operator=(const SharedChannel&) = delete;

  int file() const { return file_; }
  Channel* operator->() const { return channel_; }
  Channel& operator*() const { return *channel_; }

private:
  void map();

  int file_ = -1;
  Channel* channel_ = nullptr;
};

}  // namespace stylet::haptic::host
