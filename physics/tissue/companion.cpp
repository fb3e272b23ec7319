#include "physics/tissue/companion.h"

#include <immintrin.h>
#include <sched.h>
#include <sys/resource.h>

#include <chrono>

namespace stylet::physics {
namespace {

constexpr int kBackgroundNice = 10;
constexpr int kSpins = 2000;  // some ten microseconds: the helper's last part is about to end

constexpr std::chrono::microseconds kNap{20};

std::uint64_t place(std::uint32_t loop, std::uint32_t part) {
  return std::uint64_t{loop} << 32 | part;
}

}  // namespace

Companion::Companion(bool thread, bool background) {
  if (!thread) return;
  if (sched_getaffinity(0, sizeof allowed_, &allowed_) != 0) CPU_ZERO(&allowed_);
  thread_ = std::thread([this, background] { serve(background); });
}

Companion::~Companion() {
  stop_.store(true, std::memory_order_relaxed);
  posted_.fetch_add(1, std::memory_order_release);
  posted_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void Companion::run(int parts, Function function, const void* context) {
  if (!thread_.joinable() || parts < 2) {
    for (int part = 0; part < parts; ++part) function(context, part);
    return;
  }
  stay_beside(sched_getcpu());
  const std::uint32_t loop = posted_.load(std::memory_order_relaxed) + 1;
  function_.store(function, std::memory_order_relaxed);
  context_.store(context, std::memory_order_relaxed);
  floating_point_.store(_mm_getcsr(), std::memory_order_relaxed);
  parts_.store(parts, std::memory_order_relaxed);
  done_.store(0, std::memory_order_relaxed);
  next_.store(place(loop, 0), std::memory_order_release);
  posted_.store(loop, std::memory_order_release);
  posted_.notify_one();
  take(loop);
  for (int spin = 0; spin < kSpins && done_.load(std::memory_order_acquire) != parts; ++spin) _mm_pause();
  // No wait for a notice: one that was lost left both threads asleep, in a test, on a busy machine.
  while (done_.load(std::memory_order_acquire) != parts) std::this_thread::sleep_for(kNap);
}

void Companion::stay_beside(int core) {
  if (core == callers_core_ || core < 0) return;
  callers_core_ = core;
  cpu_set_t others = allowed_;
  CPU_CLR(static_cast<std::size_t>(core), &others);
  if (CPU_COUNT(&others) > 0) pthread_setaffinity_np(thread_.native_handle(), sizeof others, &others);
}

void Companion::take(std::uint32_t loop) {
  std::uint64_t next = next_.load(std::memory_order_acquire);
  for (;;) {
    // A part can only be taken while its loop is in work, and that ends when all parts are done: what is read here
    // is of this loop if the exchange succeeds.
    const int parts = parts_.load(std::memory_order_relaxed);
    const Function function = function_.load(std::memory_order_relaxed);
    const void* const context = context_.load(std::memory_order_relaxed);
    const auto part = static_cast<std::uint32_t>(next);
    if (next >> 32 != loop || static_cast<int>(part) >= parts) return;
    if (!next_.compare_exchange_weak(next, place(loop, part + 1), std::memory_order_acq_rel)) continue;
    function(context, static_cast<int>(part));
    done_.fetch_add(1, std::memory_order_acq_rel);
    next = next_.load(std::memory_order_acquire);
  }
}

void Companion::serve(bool background) {
  // Of this thread alone on Linux. Where it is refused the loops' own priority is what keeps them on time.
  if (background) setpriority(PRIO_PROCESS, 0, kBackgroundNice);
  const std::uint32_t own = _mm_getcsr();
  std::uint32_t seen = 0;
  for (;;) {
    posted_.wait(seen, std::memory_order_acquire);
    seen = posted_.load(std::memory_order_acquire);
    if (stop_.load(std::memory_order_relaxed)) break;
    _mm_setcsr(floating_point_.load(std::memory_order_relaxed));
    take(seen);
    _mm_setcsr(own);
  }
}

}  // namespace stylet::physics
