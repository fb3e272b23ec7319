#include "engine/desktop/replay_keys.h"

namespace stylet::desktop {

std::optional<debrief::PlaybackCommand> playback_command_of(const view::Stroke& stroke) {
  using view::Key;
  const double step_s = stroke.shift ? 0.1 : 1;
  switch (stroke.key) {
    case Key::space:
      if (stroke.repeated) return std::nullopt;
      return debrief::Pause{};
    case Key::right:
      return debrief::Seek{step_s};
    case Key::left:
      return debrief::Seek{-step_s};
    case Key::home:
      return debrief::SeekStart{};
    case Key::end:
      return debrief::SeekEnd{};
    case Key::equal:
    case Key::pad_plus:
      return debrief::ChangeSpeed{2};
    case Key::minus:
    case Key::pad_minus:
      return debrief::ChangeSpeed{0.5};
    default:
      return std::nullopt;
  }
}

}  // namespace stylet::desktop
