#include "engine/immersive/trainee_panel.h"

#include <imgui.h>

#include <utility>

namespace stylet::immersive {

view::Input HandsOnChoice::keys(const headset::Hands& hands, double time_s) {
  view::Input input;
  const auto press = [&](view::Key key) { input.strokes.push_back({.key = key}); };
  const Eigen::Vector2f &needle = hands.needle().stick, &probe = hands.probe().stick;
  switch (thumb_.pushes(needle.norm() > probe.norm() ? needle : probe, time_s)) {
    case Push::none:
      break;
    case Push::up:
      press(view::Key::up);
      break;
    case Push::down:
      press(view::Key::down);
      break;
    case Push::right:
      press(view::Key::right);
      break;
    case Push::left:
      press(view::Key::left);
      break;
  }
  if (hands.panel_pressed) press(view::Key::tab);
  const bool trigger = hands.needle().trigger;
  if (trigger && !std::exchange(trigger_, trigger)) press(view::Key::space);
  trigger_ = trigger;
  if (hands.menu_pressed) press(view::Key::backspace);
  return input;
}

void TraineePanel::draw(panels::TraineeChoice& choice, const content::Texts& texts, double dt_s) {
  constexpr ImGuiWindowFlags kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                      ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoInputs |
                                      ImGuiWindowFlags_NoBackground;
  monitor_.begin(dt_s);
  // Over the lines that say which button does what.
  const float help = 2 * ImGui::GetTextLineHeightWithSpacing() + 2 * ImGui::GetStyle().WindowPadding.y;
  const float above = Monitor::kHeight - help;
  choice.draw(Monitor::kWidth, static_cast<int>(above), texts, false);
  ImGui::SetNextWindowPos({0, above});
  ImGui::SetNextWindowSize({Monitor::kWidth, help});
  ImGui::Begin("buttons", nullptr, kFlags);
  const auto line = [&](const char* words) { ImGui::TextDisabled("%s", texts.of(words).c_str()); };
  line(left_handed_ ? "left trigger: take   menu: back" : "right trigger: take   menu: back");
  line("stick: go there   A, X or pad: the next");  // headset::kPanelButton
  ImGui::End();
  monitor_.end();
}

}  // namespace stylet::immersive
