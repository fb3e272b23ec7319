#include "physics/tissue/companion.h"

#include <immintrin.h>
#include <sched.h>
#include <sys/resource.h>

namespace stylet::physics {
namespace {

// A thirtieth of a core that others want. At 10 it is a tenth, and a step waits; at 19 a hundredth, and beside two
// busy programs no factor came in 16 s.
constexpr int kBackgroundNice = 15;
constexpr int kSpins = 2000;  // some ten microseconds: the helper's last part is about to end

// The loop in work: its number, how many parts it has, and the next of them. Of tasks: the number of their run, the
// end of those left, and the first of them.
constexpr int kPartBits = 20;
constexpr int kPartsCounted = (1 << kPartBits) - 1;

std::uint64_t beginning(std::uint32_t loop, int parts) {
  return std::uint64_t{loop} << 2 * kPartBits | static_cast<std::uint64_t>(parts) << kPartBits;
}
int parts_of(std::uint64_t next) {
  return static_cast<int>(next >> kPartBits & kPartsCounted);
}
int part_in(std::uint64_t next) {
  return static_cast<int>(next & kPartsCounted);
}
bool is_of(std::uint64_t next, std::uint32_t loop) {
  return next >> 2 * kPartBits == beginning(loop, 0) >> 2 * kPartBits;
}

}  // namespace

Companion::Companion(bool thread, bool background) {
  if (!thread) return;
  if (sched_getaffinity(0, sizeof allowed_, &allowed_) != 0) CPU_ZERO(&allowed_);
  served_ = true;
  helpers_ = std::make_unique<Companion>(false);
  helpers_->served_ = true;
  thread_ = std::thread([this, background] { serve(background); });
}

Companion::~Companion() {
  stop_.store(true, std::memory_order_relaxed);
  posted_.fetch_add(1, std::memory_order_release);
  posted_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void Companion::run(int parts, Function function, const void* context) {
  if (!served_ || parts < 2 || parts > kPartsCounted) {
    for (int part = 0; part < parts; ++part) function(context, part);
    return;
  }
  if (thread_.joinable()) stay_beside(sched_getcpu());
  const std::uint32_t loop = posted_.load(std::memory_order_relaxed) + 1;
  function_.store(function, std::memory_order_relaxed);
  context_.store(context, std::memory_order_relaxed);
  floating_point_.store(_mm_getcsr(), std::memory_order_relaxed);
  done_.store(0, std::memory_order_relaxed);
  next_.store(beginning(loop, parts), std::memory_order_release);
  posted_.store(loop, std::memory_order_release);
  posted_.notify_one();
  take(loop);
  for (int spin = 0; spin < kSpins && done_.load(std::memory_order_acquire) != parts; ++spin) _mm_pause();
  for (int done = done_.load(std::memory_order_acquire); done != parts;
       done = done_.load(std::memory_order_acquire)) {
    done_.wait(done, std::memory_order_acquire);
  }
}

void Companion::run_tasks(int tasks, TaskFunction function, const void* context) {
  if (!thread_.joinable() || tasks < 2 || tasks > kPartsCounted) {
    for (int task = 0; task < tasks; ++task) function(context, task, 0);
    return;
  }
  stay_beside(sched_getcpu());
  const std::uint32_t posted = posted_.load(std::memory_order_relaxed) + 1;
  task_function_.store(function, std::memory_order_relaxed);
  task_context_.store(context, std::memory_order_relaxed);
  floating_point_.store(_mm_getcsr(), std::memory_order_relaxed);
  tasks_done_.store(0, std::memory_order_relaxed);
  tasks_.store(beginning(posted, tasks), std::memory_order_release);
  posted_.store(posted, std::memory_order_release);
  posted_.notify_one();
  for (int task = take_task(true); task >= 0; task = take_task(true)) {
    function(context, task, 0);
    tasks_done_.fetch_add(1, std::memory_order_acq_rel);
  }
  help_helper(tasks);
}

int Companion::take_task(bool first) {
  std::uint64_t left = tasks_.load(std::memory_order_acquire);
  for (;;) {
    const int begin = part_in(left), end = parts_of(left);
    if (begin == end) return -1;
    const std::uint64_t then = first ? left + 1 : left - (std::uint64_t{1} << kPartBits);
    if (tasks_.compare_exchange_weak(left, then, std::memory_order_acq_rel)) return first ? begin : end - 1;
  }
}

void Companion::help_with_tasks() {
  for (int task = take_task(false); task >= 0; task = take_task(false)) {
    // All three are of this task's run: none of the next one's begins before it is done.
    _mm_setcsr(floating_point_.load(std::memory_order_relaxed));
    task_function_.load(std::memory_order_relaxed)(task_context_.load(std::memory_order_relaxed), task, 1);
    tasks_done_.fetch_add(1, std::memory_order_acq_rel);
    helpers_->posted_.fetch_add(1, std::memory_order_release);  // that the caller looks
    helpers_->posted_.notify_one();
  }
}

void Companion::help_helper(int tasks) {
  for (;;) {
    const std::uint32_t seen = helpers_->posted_.load(std::memory_order_acquire);
    helpers_->take(seen);
    if (tasks_done_.load(std::memory_order_acquire) == tasks) return;
    for (int spin = 0; spin < kSpins && helpers_->posted_.load(std::memory_order_acquire) == seen; ++spin)
      _mm_pause();
    helpers_->posted_.wait(seen, std::memory_order_acquire);
  }
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
    if (!is_of(next, loop) || part_in(next) == parts_of(next)) return;
    // A loop ends when its last part is done, so none of the next one's can be read here if the exchange succeeds.
    const Function function = function_.load(std::memory_order_relaxed);
    const void* const context = context_.load(std::memory_order_relaxed);
    if (!next_.compare_exchange_weak(next, next + 1, std::memory_order_acq_rel)) continue;
    function(context, part_in(next));
    if (done_.fetch_add(1, std::memory_order_acq_rel) + 1 == parts_of(next)) done_.notify_one();
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
    help_with_tasks();
    take(seen);
    _mm_setcsr(own);
  }
}

}  // namespace stylet::physics
