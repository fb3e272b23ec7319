// An author at the window: does the next thing every few frames.
#pragma once

#include "engine/app/run_session.h"
#include "tests/support/x_keyboard.h"

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace stylet::support {

class AuthorHands final : public app::SessionObserver {
public:
  using Deed = std::function<bool(XKeyboard&)>;
  void click(int x, int y) {
    for (const bool down : {true, false}) {
      deeds.emplace_back([=](XKeyboard& x11) { return x11.move(x, y); });
      deeds.emplace_back([=](XKeyboard& x11) { return x11.button(x, y, down); });
    }
  }
  /// @param held  XKeyboard::kShift, kControl
  void key(const std::string& name, unsigned int held = 0) {
    deeds.emplace_back([=](XKeyboard& x11) { return x11.press(name, held); });
  }
  bool stop_requested() override {
    if (deeds.empty()) return false;
    if (++frames_ > 4000) return true;
    if (frames_ % 6 == 0 && done_ < deeds.size() && deeds[done_](x11_)) ++done_;
    return stops && done_ == deeds.size();
  }
  void note(app::Note, const std::string& text) override { notes.push_back(text); }
  bool given_up() const { return frames_ > 4000; }

  std::vector<Deed> deeds;
  std::vector<std::string> notes;
  bool stops = false;  ///< asks for the end after the last

private:
  XKeyboard x11_;
  std::size_t done_ = 0;
  int frames_ = 0;
};

}  // namespace stylet::support
