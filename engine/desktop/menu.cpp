#include "engine/desktop/menu.h"

#include "engine/panels/parts.h"

#include <imgui.h>

#include <algorithm>
#include <utility>

namespace stylet::desktop {
namespace {

using panels::em;

constexpr float kMenuWidth = 46;  // ems at most

void choose(const char* heading, const std::vector<MenuItem>& items, std::size_t& chosen,
            const content::Texts& texts) {
  ImGui::Spacing();
  ImGui::TextDisabled("%s", texts.of(heading).c_str());
  for (std::size_t i = 0; i < items.size(); ++i) {
    ImGui::PushID(items[i].name.c_str());
    if (ImGui::RadioButton(texts.of(items[i].title).c_str(), chosen == i)) chosen = i;
    if (!items[i].about.empty()) {
      ImGui::Indent(1.9F * em());
      ImGui::PushTextWrapPos(0);
      ImGui::TextDisabled("%s", texts.of(items[i].about).c_str());
      ImGui::PopTextWrapPos();
      ImGui::Unindent(1.9F * em());
    }
    ImGui::PopID();
  }
}

}  // namespace

Menu::Menu(std::vector<MenuItem> scenarios, std::vector<MenuItem> styluses, std::vector<MenuItem> views,
           std::vector<MenuItem> languages)
    : scenarios_(std::move(scenarios)),
      styluses_(std::move(styluses)),
      views_(std::move(views)),
      languages_(std::move(languages)) {}

MenuWish Menu::handle(const view::Input& input) {
  MenuWish wish = input.close ? MenuWish::leave : MenuWish::nothing;
  for (const view::Stroke& stroke : input.strokes) {
    if (stroke.key == view::Key::down) scenario_ = std::min(scenario_ + 1, scenarios_.size() - 1);
    if (stroke.key == view::Key::up && scenario_ > 0) --scenario_;
    if (stroke.repeated) continue;
    if (stroke.key == view::Key::enter) wish = MenuWish::start;
    if (stroke.key == view::Key::q) wish = MenuWish::leave;
  }
  return wish;
}

void Menu::set_language(const std::string& name) {
  const auto at = std::ranges::find(languages_, name, &MenuItem::name);
  if (at != languages_.end()) language_ = static_cast<std::size_t>(at - languages_.begin());
}

MenuWish Menu::draw(int width, int height, const content::Texts& texts) {
  MenuWish wish = MenuWish::nothing;
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float wide = std::min(kMenuWidth * em(), 0.96F * w);
  ImGui::SetNextWindowPos({w / 2, h / 2}, ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, 0.96F * h});
  ImGui::SetNextWindowSize({wide, 0});
  if (ImGui::Begin((texts.of("Stylet: training of needle procedures") + "###menu").c_str(), nullptr,
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                       ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav)) {
    choose("Scenario (Up, Down)", scenarios_, scenario_, texts);
    choose("What leads the needle", styluses_, stylus_, texts);
    choose("Where it is seen", views_, view_, texts);
    if (languages_.size() > 1) choose("Language", languages_, language_, texts);
    ImGui::Spacing();
    ImGui::Checkbox((texts.of("Left-handed") + "###left-handed").c_str(), &left_handed_);
    if (!problem_.empty()) {
      ImGui::PushTextWrapPos(0);
      ImGui::TextColored({0.93F, 0.52F, 0.06F, 1}, "%s", problem_.c_str());
      ImGui::PopTextWrapPos();
    }
    ImGui::Spacing();
    if (ImGui::Button((texts.of("Start") + " (Enter)").c_str())) wish = MenuWish::start;
    ImGui::SameLine();
    if (ImGui::Button((texts.of("Leave") + " (Q)").c_str())) wish = MenuWish::leave;
  }
  ImGui::End();
  return wish;
}

}  // namespace stylet::desktop
