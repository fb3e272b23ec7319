#include "engine/app/stylus_watch.h"

#include <fmt/format.h>

namespace stylet::app {

void StylusWatch::look() {
  const haptic::DeviceStatus status = stylus_.status();
  if (status.waits_for_rest && !awaited_) {
    awaited_ = true;
    observer_.note(Note::notice, stylus_.name() + ": hold it at its rest place to begin");
  }
  if (status.needs != needs_) {
    needs_ = status.needs;
    if (!needs_.empty()) observer_.note(Note::notice, stylus_.name() + ": " + needs_);
  }
  if (status.connected == connected_) return;
  connected_ = status.connected;
  observer_.note(Note::notice,
                 stylus_.name() + (connected_ ? fmt::format(": back; the {} is taken up where it is", led_)
                                              : fmt::format(": gone; force off, the {} stays where it is; plug it in "
                                                            "again",
                                                            led_)));
}

}  // namespace stylet::app
