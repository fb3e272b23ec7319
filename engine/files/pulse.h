// Long work that asks often whether it is still wanted.
#pragma once

#include <concepts>
#include <cstddef>
#include <functional>
#include <utility>

namespace stylet::files {

/// Handed down to whatever goes through many elements: triangles, voxels, lines, comparisons of a sort. Each counts
/// itself; every kOften of them asks, and the answer may be an exception. Thread: one.
class Pulse {
public:
  /// Elements between two questions: some milliseconds of the slowest.
  static constexpr std::size_t kOften = std::size_t{1} << 15;
  /// What a distance to a surface counts as.
  static constexpr std::size_t kDistance = 8;

  /// Always wanted.
  Pulse() = default;
  /// @param ask  may throw to end the work
  template <std::invocable Ask>
  Pulse(Ask ask) : ask_(std::move(ask)) {}  // NOLINT(google-explicit-constructor): it is what is asked

  /// So many elements more are done. @throws what `ask` throws
  void operator()(std::size_t elements = 1) const {
    if ((elements_ += elements) >= kOften) now();
  }
  /// Asks at once.
  void now() const {
    elements_ = 0;
    if (ask_) ask_();
  }

private:
  std::function<void()> ask_{};
  mutable std::size_t elements_ = 0;
};

}  // namespace stylet::files
