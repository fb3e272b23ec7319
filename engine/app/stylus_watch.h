// What whoever holds the stylus of a running session should know of it.
#pragma once

#include "engine/app/observer.h"
#include "haptic/device.h"

#include <string>

namespace stylet::app {

/// Notes when the stylus goes, when it is back, that it is awaited, and what it needs.
class StylusWatch {
public:
  /// @param led  what it leads, for people
  StylusWatch(const haptic::Device& stylus, Observer& observer, const char* led = "needle")
      : stylus_(stylus), observer_(observer), led_(led) {}
  void look();

private:
  const haptic::Device& stylus_;
  Observer& observer_;
  const char* led_;
  bool connected_ = true;
  bool awaited_ = false;
  std::string needs_;
};

}  // namespace stylet::app
