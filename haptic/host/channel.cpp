#include "haptic/host/channel.h"

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <limits>
#include <stdexcept>

namespace stylet::haptic::host {
namespace {

constexpr std::size_t kWord = sizeof(std::uint64_t);

static_assert(sizeof(std::atomic<std::uint32_t>) == 4);

std::uint32_t* futex_word(std::atomic<std::uint32_t>& bell) {
  return reinterpret_cast<std::uint32_t*>(&bell);
}

}  // namespace

bool ReportRing::put(std::span<const std::uint8_t> report) {
  if (report.size() > kBytes) return false;
  const std::uint64_t number = written_.load(std::memory_order_relaxed) + 1;
  Entry& entry = entries_[number % kMost];
  std::array<std::uint8_t, kBytes + 1> bytes{static_cast<std::uint8_t>(report.size())};
  std::ranges::copy(report, bytes.begin() + 1);
  entry.count.store(2 * number + 1, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_release);
  for (std::size_t k = 0; k < entry.words.size(); ++k) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + k * kWord, kWord);
    entry.words[k].store(word, std::memory_order_relaxed);
  }
  entry.count.store(2 * number + 2, std::memory_order_release);
  written_.store(number, std::memory_order_release);
  bell_.fetch_add(1, std::memory_order_release);
  syscall(SYS_futex, futex_word(bell_), FUTEX_WAKE, std::numeric_limits<int>::max(), nullptr, nullptr, 0);
  return true;
}

std::size_t ReportRing::take(std::uint64_t& next, std::span<std::uint8_t> report) const {
  while (true) {
    const std::uint64_t written = written_.load(std::memory_order_acquire);
    if (next > written) next = written;  // a writer that begins anew
    if (next == written) return 0;
    // The oldest may be written over just now.
    if (written - next > kMost - 1) next = written - (kMost - 1);
    const std::uint64_t number = ++next;
    const Entry& entry = entries_[number % kMost];
    if (entry.count.load(std::memory_order_acquire) != 2 * number + 2) continue;
    std::array<std::uint8_t, kBytes + 1> bytes{};
    for (std::size_t k = 0; k < entry.words.size(); ++k) {
      const std::uint64_t word = entry.words[k].load(std::memory_order_relaxed);
      std::memcpy(bytes.data() + k * kWord, &word, kWord);
    }
    std::atomic_thread_fence(std::memory_order_acquire);
    if (entry.count.load(std::memory_order_relaxed) != 2 * number + 2) continue;  // torn
    const std::size_t size = bytes[0];
    if (size == 0 || size > kBytes || size > report.size()) continue;
    std::copy_n(bytes.begin() + 1, size, report.begin());
    return size;
  }
}

bool ReportRing::wait(std::uint64_t had, std::int64_t timeout_ns) const {
  auto& bell = const_cast<std::atomic<std::uint32_t>&>(bell_);
  const std::uint32_t rung = bell.load(std::memory_order_acquire);
  if (written() > had) return true;
  if (timeout_ns > 0) {
    const timespec timeout{.tv_sec = timeout_ns / 1'000'000'000, .tv_nsec = timeout_ns % 1'000'000'000};
    syscall(SYS_futex, futex_word(bell), FUTEX_WAIT, rung, &timeout, nullptr, 0);
  }
  return written() > had;
}

void put_text(std::array<char, Channel::kText>& where, const std::string& text) {
  const std::size_t size = std::min(text.size(), where.size() - 1);
  std::copy_n(text.begin(), size, where.begin());
  where[size] = 0;
}

std::string text_of(const std::array<char, Channel::kText>& where) {
  return {where.data(), strnlen(where.data(), where.size())};
}

SharedChannel::SharedChannel() : file_(memfd_create("stylet device", MFD_CLOEXEC)) {
  if (file_ < 0 || ftruncate(file_, sizeof(Channel)) != 0) {
    throw std::runtime_error(std::string("no shared memory: ") + std::strerror(errno));
  }
  map();
  channel_->version.store(Channel::kVersion);
}

SharedChannel::SharedChannel(int file) : file_(file) {
  struct stat what {};
  if (fstat(file, &what) != 0 || what.st_size != static_cast<off_t>(sizeof(Channel))) {
    throw std::runtime_error("the shared memory is not of this version");
  }
  map();
  if (channel_->version.load() != Channel::kVersion) {
    throw std::runtime_error("the shared memory is not of this version");
  }
}

void SharedChannel::map() {
  void* memory = mmap(nullptr, sizeof(Channel), PROT_READ | PROT_WRITE, MAP_SHARED, file_, 0);
  if (memory == MAP_FAILED) throw std::runtime_error(std::string("no shared memory: ") + std::strerror(errno));
  channel_ = static_cast<Channel*>(memory);
}

SharedChannel::~SharedChannel() {
  if (channel_ != nullptr) munmap(channel_, sizeof(Channel));
  if (file_ >= 0) close(file_);
}

}  // namespace stylet::haptic::host
