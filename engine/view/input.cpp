#include "engine/view/input.h"

namespace stylet::view {

std::string key_name(Key key) {
  const auto offset = [key](Key first) { return static_cast<int>(key) - static_cast<int>(first); };
  if (key >= Key::digit_0 && key <= Key::digit_9) return {static_cast<char>('0' + offset(Key::digit_0))};
  if (key >= Key::a && key <= Key::z) return {static_cast<char>('A' + offset(Key::a))};
  if (key >= Key::f1 && key <= Key::f12) return std::to_string(offset(Key::f1) + 1).insert(0, 1, 'F');
  switch (key) {
    case Key::right:
      return "Right";
    case Key::left:
      return "Left";
    case Key::down:
      return "Down";
    case Key::up:
      return "Up";
    case Key::page_up:
      return "Page Up";
    case Key::page_down:
      return "Page Down";
    case Key::home:
      return "Home";
    case Key::end:
      return "End";
    case Key::space:
      return "Space";
    case Key::enter:
      return "Enter";
    case Key::tab:
      return "Tab";
    case Key::backspace:
      return "Backspace";
    case Key::minus:
    case Key::pad_minus:
      return "-";
    case Key::equal:
    case Key::pad_plus:
      return "+";
    default:
      return "";
  }
}

Input without_pointer(Input input) {
  input.drag_x = input.drag_y = input.orbit_x = input.orbit_y = input.advance = input.zoom = 0;
  input.slide_x = input.slide_y = input.turn_x = input.turn_y = 0;
  input.presses.clear();
  return input;
}

}  // namespace stylet::view
