// The loudspeakers: a device of OpenAL (PipeWire, PulseAudio, ALSA, or what ALSOFT_DRIVERS says).
#pragma once

#include "engine/sound/mixer.h"

#include <memory>
#include <optional>
#include <string>

namespace stylet::sound {

/// A device that is open, one at a time. One thread.
class Output {
public:
  /// The default device; none: there is none that could be opened.
  static std::optional<Output> open();
  Output(Output&&) noexcept;
  Output& operator=(Output&&) noexcept;
  ~Output();

  /// Hands it what it has room for. @return false: the device has gone
  bool feed(Mixer& mixer);
  /// As its system calls it.
  const std::string& name() const;

private:
  struct Device;
  explicit Output(std::unique_ptr<Device> device);
  std::unique_ptr<Device> device_;
};

/// Before the first open(), while there is one thread: lets the libraries behind it print nothing; who opens says
/// what there is to say.
void quieten_libraries();

}  // namespace stylet::sound
