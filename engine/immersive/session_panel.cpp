#include "engine/immersive/session_panel.h"

#include "engine/headset/headset_controllers.h"
#include "engine/panels/parts.h"

#include <imgui.h>

#include <algorithm>

namespace stylet::immersive {
namespace {

constexpr int kWidth = Monitor::kWidth, kHeight = Monitor::kHeight;
constexpr float kColumn = 17;  // ems

constexpr ImGuiWindowFlags kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoInputs |
                                    ImGuiWindowFlags_NoBackground;

/// Opens a window at a share of the width.
void begin(const char* name, float from, float to) {
  ImGui::SetNextWindowPos({from * kWidth, 0});
  ImGui::SetNextWindowSize({(to - from) * kWidth, kHeight});
  ImGui::Begin(name, nullptr, kFlags);
}

/// Which buttons there are to tell of.
struct Help {
  bool briefing = false;
  bool left_handed = false;
  bool asks = false;  ///< for the breath
  float lines() const { return asks ? 4 : 3; }
};

float padding() {
  return ImGui::GetStyle().WindowPadding.y;
}

float line() {
  return ImGui::GetTextLineHeightWithSpacing();
}

/// From where one is down to the help on the lowest lines of the window.
float height_left(const Help& help) {
  return kHeight - ImGui::GetCursorPosY() - help.lines() * line() - padding();
}

/// Which button does what.
void draw_help(const Help& help) {
  const char* needle = help.left_handed ? "left" : "right";
  ImGui::SetCursorPosY(kHeight - help.lines() * line() - padding());
  ImGui::TextDisabled("%s trigger: fire, heat   menu: %s", needle, help.briefing ? "begin" : "pause");
  ImGui::TextDisabled("%s trigger: freeze   stick: gain, depth", help.left_handed ? "right" : "left");
  if (help.asks) ImGui::TextDisabled("%s %s: hold the breath", needle, headset::kBreathButton);
  ImGui::TextDisabled("%s: panel, instructor, none", headset::kPanelButton);
}

/// In smaller letters where it is long.
void draw_briefing(const panels::SessionFacts& facts, const Help& help) {
  constexpr float kLeast = 0.6F;
  const float width = (2 * kColumn + 1) * panels::em(), left = height_left(help);
  float scale = 1;
  const auto height = [&] {
    float sum = 0;
    for (const std::string& paragraph : facts.briefing)
      sum += scale * ImGui::CalcTextSize(paragraph.c_str(), nullptr, false, width / scale).y +
             2 * ImGui::GetStyle().ItemSpacing.y;
    return sum;
  };
  while (scale > kLeast && height() > left) scale -= 0.05F;
  ImGui::SetWindowFontScale(scale);
  panels::draw_briefing(facts, width / panels::em());
  ImGui::SetWindowFontScale(1);
}

void draw_left(const panels::SessionFacts& facts, PanelLevel level, const Help& help) {
  ImGui::SetWindowFontScale(1.25F);
  ImGui::TextUnformatted(facts.title.c_str());
  ImGui::SetWindowFontScale(1);
  panels::draw_course(facts, facts.briefing.empty() ? kColumn : 2 * kColumn);
  ImGui::Spacing();
  if (!facts.briefing.empty()) return draw_briefing(facts, help);
  if (level == PanelLevel::instructor) panels::draw_place(facts);
  panels::draw_readings(facts);
}

void draw_right(const panels::SessionFacts& facts, PanelLevel level, const Help& help) {
  const bool instructor = level == PanelLevel::instructor;
  ImGui::TextDisabled("Force (N) against depth (mm)");
  const float below = instructor ? line() * static_cast<float>(facts.warnings.size()) : 0;
  panels::draw_force(facts, kColumn, std::max((height_left(help) - below - padding()) / panels::em(), 5.0F));
  if (instructor) panels::draw_warnings(facts);
}

}  // namespace

PanelLevel next(PanelLevel level) {
  return static_cast<PanelLevel>((static_cast<int>(level) + 1) % 3);
}

render::SeeThrough see_through(PanelLevel level) {
  return level == PanelLevel::instructor ? render::SeeThrough::glass : render::SeeThrough::window;
}

void SessionPanel::draw(const panels::SessionFacts& facts, PanelLevel level, double now_s) {
  const bool due = level != level_ || now_s >= drawn_s_ + kPeriod || now_s < drawn_s_;
  level_ = level;
  if (!due || level == PanelLevel::hidden) return;
  drawn_s_ = now_s;
  monitor_.begin(kPeriod);
  const bool briefing = !facts.briefing.empty();
  const Help help{.briefing = briefing, .left_handed = left_handed_, .asks = asks_};
  begin("course", 0, briefing ? 1.0F : 0.5F);
  draw_left(facts, level, help);
  if (briefing) draw_help(help);
  ImGui::End();
  if (!briefing) {
    begin("needle", 0.5F, 1);
    draw_right(facts, level, help);
    draw_help(help);
    ImGui::End();
  }
  monitor_.end();
}

}  // namespace stylet::immersive
