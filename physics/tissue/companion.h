// A second thread for loops over what does not depend on each other, asleep while there is no such loop.
#pragma once

#include <sched.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <utility>

namespace stylet::physics {

/// Shares the parts of a loop between the calling thread and one helper. The caller never waits for the helper to
/// wake: it works on, and where no other core is free it does all parts itself. Which thread does a part must not
/// matter: parts that write apart from each other, and sums of parts taken in their order, give the same bits always.
class Companion {
public:
  /// @param thread      false: all parts are the caller's
  /// @param background  the helper makes way for every other thread (nice)
  explicit Companion(bool thread = true, bool background = false);
  ~Companion();
  Companion(const Companion&) = delete;
  Companion& operator=(const Companion&) = delete;

  /// work(part) for each part from 0 to parts - 1; returns when all are done. One caller at a time; `work` must not
  /// throw. More than a million parts are the caller's. Allocates nothing.
  template <typename Work>
  void run(int parts, const Work& work) {
    run(
        parts, [](const void* context, int part) { (*static_cast<const Work*>(context))(part); }, &work);
  }

  /// work(task, side) for each task from 0 to tasks - 1, each as a whole by one thread; returns when all are done.
  /// The caller (side 0) takes them from the first on, so that should be the longest; the helper (side 1) from the
  /// last on. Who finds none left takes part in the loops of the other's, which run by of(side).
  template <typename Work>
  void run_tasks(int tasks, const Work& work) {
    run_tasks(
        tasks, [](const void* context, int task, int side) { (*static_cast<const Work*>(context))(task, side); },
        &work);
  }
  /// Who shares the loops of a task.
  Companion& of(int side) { return side == 1 && helpers_ ? *helpers_ : *this; }
  static constexpr int kSides = 2;

private:
  using Function = void (*)(const void* context, int part);
  using TaskFunction = void (*)(const void* context, int task, int side);
  /// Keeps the helper off the caller's core. A scheduler that wakes it there, where it waits for the caller to sleep,
  /// does so in three of ten loops beside a busy worker: then no core is shared.
  void stay_beside(int core);
  void run(int parts, Function function, const void* context);
  void run_tasks(int tasks, TaskFunction function, const void* context);
  /// The first task that is left, or the last; -1: none.
  int take_task(bool first);
  /// Tasks until none is left to take.
  void help_with_tasks();
  /// Loops of the helper's tasks, until so many tasks are done.
  void help_helper(int tasks);
  /// Parts of a loop until none is left to take.
  void take(std::uint32_t loop);
  void serve(bool background);

  // The loop in work, how many parts it has and the next of them, taken together: a helper that comes late to a loop
  // takes nothing of the next one, whose function it may not have seen, and no part more of its own because the next
  // one has more.
  std::atomic<std::uint64_t> next_{0};
  std::atomic<Function> function_{nullptr};
  std::atomic<const void*> context_{nullptr};
  std::atomic<std::uint32_t> floating_point_{0};  // the caller's mode: the same bits
  std::atomic<int> done_{0};
  std::atomic<std::uint32_t> posted_{0};  // counts loops; what the helper sleeps on
  // The tasks in work: which run of them, and the first and the end of those that are left; one word, as above.
  std::atomic<std::uint64_t> tasks_{0};
  std::atomic<TaskFunction> task_function_{nullptr};
  std::atomic<const void*> task_context_{nullptr};
  std::atomic<int> tasks_done_{0};
  std::unique_ptr<Companion> helpers_;  // of the helper's tasks: without a thread, the caller serves it
  bool served_ = false;
  std::atomic<bool> stop_{false};
  cpu_set_t allowed_{};    // cores of the process
  int callers_core_ = -1;  // of the last loop
  std::thread thread_;
};

/// Parts of a loop over many small things: enough that two threads end together.
inline constexpr int kSharedParts = 8;
/// The first of `count` things in a part of kSharedParts, and the one after its last.
inline std::pair<std::size_t, std::size_t> part_of(std::size_t count, int part) {
  const auto run = static_cast<std::size_t>(part);
  return {run * count / kSharedParts, (run + 1) * count / kSharedParts};
}
/// Boxes of a tree over a surface; fewer are fitted before another thread wakes.
inline constexpr std::size_t kBoxesWorthSharing = 2000;

/// run() of a companion, or of the caller alone where there is none.
template <typename Work>
void in_parts(Companion* companion, int parts, const Work& work) {
  if (companion != nullptr) return companion->run(parts, work);
  for (int part = 0; part < parts; ++part) work(part);
}

}  // namespace stylet::physics
