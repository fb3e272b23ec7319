// What mouse and keyboard did at a window, whichever library the window is made with.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace stylet::view {

/// Keys by what is printed on them on an English keyboard; letters and digits without a gap.
// clang-format off
enum class Key : std::uint8_t {
  none,  ///< one that means nothing anywhere
  digit_0, digit_1, digit_2, digit_3, digit_4, digit_5, digit_6, digit_7, digit_8, digit_9,
  a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z,
  f1, f2, f3, f4, f5, f6, f7, f8, f9, f10, f11, f12,
  right, left, down, up, page_up, page_down, home, end,
  space, enter, tab, backspace, minus, equal, pad_minus, pad_plus,
};
// clang-format on
inline constexpr int kKeys = static_cast<int>(Key::pad_plus) + 1;

/// `count` keys further: the letter or digit.
constexpr Key operator+(Key key, int count) {
  return static_cast<Key>(static_cast<int>(key) + count);
}
/// As people call it: "Page Up".
std::string key_name(Key key);

/// A key pressed, or repeated while it is held.
struct Stroke {
  Key key = Key::none;
  bool shift = false;
  bool repeated = false;
  bool control = false;
};

/// The left button goes down or up: a click that is over before the next poll is one too.
struct Press {
  bool down = false;
  double x = 0, y = 0;  ///< pixels of the frame from its upper left corner
};

/// What happened since the last poll. Distances are fractions of the window's height, so they do not depend on its
/// size.
struct Input {
  bool close = false;
  double drag_x = 0, drag_y = 0;        ///< left button held: right, down
  double orbit_x = 0, orbit_y = 0;      ///< right button held
  double advance = 0;                   ///< wheel notches away from the user
  double zoom = 0;                      ///< the same with Ctrl held
  double slide_x = 0, slide_y = 0;      ///< middle button held
  double turn_x = 0, turn_y = 0;        ///< the same with Shift held
  double pointer_x = 0, pointer_y = 0;  ///< pixels of the frame from its upper left corner
  bool left = false, right = false;     ///< buttons held, or pressed since the last poll, for panels
  bool shift = false;                   ///< held
  double wheel = 0;                     ///< notches, whatever is held
  std::vector<Stroke> strokes{};        ///< in order
  std::vector<Press> presses{};         ///< in order
};

/// `input` without what the pointer did: it belongs to a panel.
Input without_pointer(Input input);

}  // namespace stylet::view
