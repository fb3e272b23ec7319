#include "engine/desktop/author_panel.h"

#include "engine/desktop/framing.h"
#include "engine/panels/parts.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::desktop {
namespace {

using panels::em;

constexpr float kPanelWidth = 24;  // ems
constexpr std::array kTools{"Target (1)", "Entry (2)", "Probe (3)", "Forbidden organs (4)"};
constexpr std::array kHelp{
    "Click an organ: the target lies in its middle. Shift and click: the target is that organ. A click into the "
    "ultrasound image puts it there. Wheel: deeper; + and -: larger, smaller.",
    "Click the skin where the needle goes in.", "Drag over the skin: the image follows.",
    "Click an organ that the needle must not enter; once more takes it off the list."};
const ImVec4 kWarning{0.93F, 0.52F, 0.06F, 1};

void draw_mark(const AuthorMark& mark, const content::Camera& camera, int width, int height,
               const content::Texts& texts) {
  double depth = 0;
  const Eigen::Vector2d at = projected(camera, mark.at, width, height, &depth);
  if (depth < 0.02) return;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const ImVec2 p(static_cast<float>(at.x()), static_cast<float>(at.y()));
  const ImU32 colour = mark.problem ? IM_COL32(240, 140, 20, 255) : IM_COL32(80, 230, 255, 255);
  const double focal = height / 2.0 / std::tan(camera.vertical_fov / 2);
  const float r = std::max(static_cast<float>(focal * mark.radius / depth), 0.35F * em());
  list->AddCircle(p, r, IM_COL32(0, 0, 0, 200), 0, 0.30F * em());
  list->AddCircle(p, r, colour, 0, 0.15F * em());
  const std::string text = texts.of(mark.text);
  const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, 18 * em());
  const ImVec2 corner(std::min(p.x + r + 0.4F * em(), static_cast<float>(width) - size.x - em()), p.y - 0.5F * em());
  list->AddRectFilled({corner.x - 0.2F * em(), corner.y - 0.1F * em()},
                      {corner.x + size.x + 0.2F * em(), corner.y + size.y + 0.1F * em()}, IM_COL32(0, 0, 0, 170),
                      0.2F * em());
  list->AddText(nullptr, ImGui::GetFontSize(), corner, colour, text.c_str(), nullptr, 18 * em());
}

}  // namespace

AuthorWish author_keys(const view::Input& input, bool leaving, AuthorTool& tool) {
  using view::Key;
  AuthorWish wish = input.close ? AuthorWish::closed : AuthorWish::nothing;
  for (const view::Stroke& stroke : input.strokes) {
    if (stroke.key == Key::equal || stroke.key == Key::pad_plus) wish = AuthorWish::larger;
    if (stroke.key == Key::minus || stroke.key == Key::pad_minus) wish = AuthorWish::smaller;
    if (stroke.repeated) continue;
    for (int i = 0; i < static_cast<int>(kTools.size()); ++i) {
      if (stroke.key == Key::digit_1 + i) tool = static_cast<AuthorTool>(i);
    }
    // As everywhere: with Ctrl held, undo, redo and save; without it a letter is a command of this window.
    if (stroke.control && stroke.key == Key::z) wish = stroke.shift ? AuthorWish::redo : AuthorWish::undo;
    if (stroke.key == Key::s) wish = AuthorWish::save;
    if (stroke.control) continue;
    if (stroke.key == Key::tab) wish = AuthorWish::next_target;
    if (stroke.key == Key::c) wish = AuthorWish::camera;
    if (stroke.key == Key::q) wish = AuthorWish::leave;
    if (stroke.key == Key::d && leaving) wish = AuthorWish::discard;
  }
  return wish;
}

AuthorChoice draw_author(const AuthorFacts& facts, const content::Camera& camera, int width, int height,
                         const content::Texts& texts) {
  AuthorChoice choice{.tool = facts.tool, .target = facts.target};
  for (const AuthorMark& mark : facts.marks) draw_mark(mark, camera, width, height, texts);
  const float wide = std::min(kPanelWidth * em(), 0.4F * static_cast<float>(width));
  ImGui::SetNextWindowPos({0.5F * em(), 0.5F * em()}, ImGuiCond_Always);
  ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, static_cast<float>(height) - em()});
  ImGui::SetNextWindowSize({wide, 0});
  const auto button = [&](const char* label, AuthorWish asked, bool can) {
    ImGui::BeginDisabled(!can);
    if (ImGui::Button(texts.of(label).c_str())) choice.wish = asked;
    ImGui::EndDisabled();
  };
  if (ImGui::Begin((facts.title + (facts.changed ? " *" : "") + "###author").c_str(), nullptr,
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                       ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav)) {
    ImGui::PushTextWrapPos(0);
    for (std::size_t i = 0; i < kTools.size(); ++i) {
      const auto each = static_cast<AuthorTool>(i);
      if (ImGui::RadioButton(texts.of(kTools[i]).c_str(), facts.tool == each)) choice.tool = each;
    }
    ImGui::TextDisabled("%s", texts.of(kHelp[static_cast<std::size_t>(facts.tool)]).c_str());
    ImGui::TextDisabled("%s", texts.of("Right button: turn the view; Ctrl and wheel: nearer.").c_str());
    if (facts.tool == AuthorTool::target && facts.targets.size() > 1) {
      ImGui::TextUnformatted(texts.of("Target that is edited (Tab: the next)").c_str());
      for (std::size_t i = 0; i < facts.targets.size(); ++i) {
        const std::string label = fmt::format("{}. {}##target{}", i + 1, facts.targets[i], i);
        if (ImGui::RadioButton(label.c_str(), facts.target == i)) choice.target = i;
      }
    }
    if (!facts.forbidden.empty()) {
      std::string list;
      for (const std::string& organ : facts.forbidden) list += (list.empty() ? "" : ", ") + organ;
      ImGui::Text("%s: %s", texts.of("Forbidden").c_str(), list.c_str());
    }
    if (facts.tool == AuthorTool::forbidden &&
        ImGui::BeginChild("organs", {0, std::min(9.0F * em(), 0.3F * static_cast<float>(height))}, true)) {
      for (const std::string& organ : facts.organs) {
        bool on = std::ranges::find(facts.forbidden, organ) != facts.forbidden.end();
        if (ImGui::Checkbox(organ.c_str(), &on)) choice.toggled = organ;
      }
    }
    if (facts.tool == AuthorTool::forbidden) ImGui::EndChild();
    ImGui::Separator();
    button("Camera starts here (C)", AuthorWish::camera, true);
    button("Undo (Ctrl Z)", AuthorWish::undo, facts.can_undo);
    ImGui::SameLine();
    button("Redo (Ctrl Shift Z)", AuthorWish::redo, facts.can_redo);
    button("Save and check (S)", AuthorWish::save, true);
    ImGui::SameLine();
    button("Leave (Q)", AuthorWish::leave, true);
    if (facts.leaving) {
      ImGui::TextColored(kWarning, "%s", texts.of("Not saved yet. S saves, D leaves without, Q stays.").c_str());
      button("Leave without saving (D)", AuthorWish::discard, true);
    }
    if (!facts.said.empty()) ImGui::TextUnformatted(texts.of(facts.said).c_str());
    if (facts.checking) ImGui::TextUnformatted(texts.of("Checking all that the scenario names").c_str());
    for (const std::string& problem : facts.problems) {
      ImGui::TextColored(kWarning, "! %s", texts.of(problem).c_str());
    }
    ImGui::PopTextWrapPos();
  }
  ImGui::End();
  return choice;
}

}  // namespace stylet::desktop
