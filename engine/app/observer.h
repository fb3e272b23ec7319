// Long work and whoever asked for it: how far it is, what they should know, whether they still want it.
#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <utility>

namespace stylet::app {

enum class Note : std::uint8_t {
  info,     ///< what was asked for
  notice,   ///< went otherwise than asked for; the work goes on
  warning,  ///< something in a file is odd
};

/// Its functions are called by the thread that does the work, which they should not hold up.
class Observer {
public:
  virtual ~Observer() = default;
  /// A task goes on; a new text is a new task.
  /// @param share  done so far, [0, 1]
  virtual void progress(const std::string& /*task*/, double /*share*/) {}
  /// The task in progress has ended.
  virtual void task_done() {}
  /// One line, without a line break at its end.
  virtual void note(Note /*kind*/, const std::string& /*text*/) {}
  /// Whether the work should end. Asked often.
  virtual bool stop_requested() { return false; }
  /// A session has ended early because it was asked to. What is left goes on until another request.
  virtual void stop_answered() {}
};

/// The work ended because the observer asked for it; it has left nothing half done behind.
class Stopped final : public std::exception {
public:
  Stopped() = default;
  /// @param what  one line that says what stays
  explicit Stopped(std::string what) : what_(std::move(what)) {}
  const char* what() const noexcept override { return what_.c_str(); }

private:
  std::string what_ = "interrupted; what was not finished was removed";
};

/// @throws Stopped  it is not wanted any more
inline void throw_if_stopped(Observer& observer) {
  if (observer.stop_requested()) throw Stopped();
}

/// Shows a task's progress. @throws Stopped  it is not wanted any more
inline void show_progress(Observer& observer, const std::string& task, double share) {
  throw_if_stopped(observer);
  observer.progress(task, share);
}

}  // namespace stylet::app
