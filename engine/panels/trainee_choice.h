// Who trains, before the briefing: a list of names, and a PIN where one has any. Drawn with Dear ImGui, on a desktop
// and on the monitor in the room; knows no window, no GPU and no records.
#pragma once

#include "engine/content/texts.h"
#include "engine/view/input.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace stylet::panels {

struct TraineeEntry {
  std::string pseudonym{};
  std::string name{};  ///< for people
  bool has_pin = false;
};

struct PinAnswer {
  bool right = false;
  bool looked_at = true;    ///< false: the wait was not over
  std::int64_t wait_s = 0;  ///< until the next try is looked at
};

enum class TraineeWish : std::uint8_t { nothing, chosen, back };

class TraineeChoice {
public:
  using TryPin = std::function<PinAnswer(const std::string& pseudonym, const std::string& pin)>;

  /// Nobody, who is always there, is chosen at first.
  /// @param most_digits  of a PIN
  TraineeChoice(std::vector<TraineeEntry> entries, std::size_t most_digits, TryPin try_pin);

  /// Up, Down, Page Up, Page Down and the first letter choose, Tab does round and round, Enter goes on, Backspace
  /// goes back; digits are those of the PIN. Who has no digits goes to those of the pad by arrows and Tab, and
  /// presses them by Space, which of a name goes on. @return what the keys asked for
  TraineeWish handle(const view::Input& input);
  /// Draws it in the middle of a frame of that size.
  /// @param keys  the buttons name the keys that do the same
  /// @return what its buttons asked for
  TraineeWish draw(int width, int height, const content::Texts& texts, bool keys = true);

  /// Who is chosen; empty: nobody, the session is kept nowhere.
  const std::string& pseudonym() const;
  /// Somebody that is not there is nobody.
  void choose(const std::string& pseudonym);
  bool asks_for_pin() const { return asks_; }

private:
  TraineeWish go_on();
  TraineeWish go_back();
  void add_digit(char digit);
  TraineeWish press_pad();
  TraineeWish handle_name(const view::Stroke& stroke);
  TraineeWish handle_pin(const view::Stroke& stroke);
  TraineeWish draw_list(float height, const content::Texts& texts, bool keys);
  TraineeWish draw_pin(float height, const content::Texts& texts, bool keys);

  std::vector<TraineeEntry> entries_;  ///< the first is nobody
  std::size_t most_digits_;
  TryPin try_pin_;
  std::size_t chosen_ = 0;
  bool scroll_ = true;  ///< to who is chosen
  bool asks_ = false;
  std::size_t at_ = 0;  ///< on the pad
  std::string pin_;
  std::string problem_;  ///< English
};

}  // namespace stylet::panels
