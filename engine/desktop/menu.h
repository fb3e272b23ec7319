// What a user chooses before a session: the scenario, what leads the needle, where it is seen. Drawn with Dear ImGui;
// knows no window and no GPU.
#pragma once

#include "engine/content/texts.h"
#include "engine/view/input.h"

#include <cstdint>
#include <string>
#include <vector>

namespace stylet::desktop {

struct MenuItem {
  std::string name{};   ///< as whoever runs the session wants it
  std::string title{};  ///< for people
  std::string about{};  ///< one line more; may be empty
};

enum class MenuWish : std::uint8_t { nothing, start, leave };

/// One of each list is chosen.
class Menu {
public:
  /// Each list has an entry at least.
  Menu(std::vector<MenuItem> scenarios, std::vector<MenuItem> styluses, std::vector<MenuItem> views,
       std::vector<MenuItem> languages);

  /// Up and Down choose a scenario, Enter starts, Q leaves. @return what the keys asked for
  MenuWish handle(const view::Input& input);
  /// Draws it in the middle of a frame of that size, in the language of `texts`. @return what its buttons asked for
  MenuWish draw(int width, int height, const content::Texts& texts);
  /// Shown under the lists: why the last start came to nothing.
  void say(std::string problem) { problem_ = std::move(problem); }

  const std::string& scenario() const { return scenarios_[scenario_].name; }
  const std::string& stylus() const { return styluses_[stylus_].name; }
  const std::string& language() const { return languages_[language_].name; }
  void set_language(const std::string& name);
  const std::string& view() const { return views_[view_].name; }
  bool left_handed() const { return left_handed_; }

private:
  std::vector<MenuItem> scenarios_, styluses_, views_, languages_;
  std::size_t scenario_ = 0, stylus_ = 0, view_ = 0, language_ = 0;
  bool left_handed_ = false;
  std::string problem_;
};

}  // namespace stylet::desktop
