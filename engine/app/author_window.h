// `stylet author`: a scenario edited in a window.
#pragma once

#include "engine/app/observer.h"

#include <string>

namespace stylet::app {

struct AuthorSettings {
  std::string scenario{};  ///< as a user names it
  std::string gpu{};       ///< as gpu::DeviceSettings
  std::string language{};  ///< empty: that of the environment
};

/// Shows the scenario until its user leaves, or the observer asks for the end: what is not saved then is kept beside
/// it, which is noted. Main thread.
/// @return false: it was saved, or left as it was, with problems, which are noted
/// @throws files::ContentError  it cannot be loaded; gpu::GpuError  there is no window
bool author_scenario(const AuthorSettings& settings, Observer& observer);

}  // namespace stylet::app
