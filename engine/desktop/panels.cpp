#include "engine/desktop/panels.h"

#include "engine/panels/parts.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::desktop {
namespace {

// GLFW's codes of keys that are no characters.
constexpr int kTab = 258;
constexpr int kF1 = 290;

constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                                    ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;
constexpr ImGuiWindowFlags kFitted = kFixed | ImGuiWindowFlags_AlwaysAutoResize;
constexpr float kWidth = 21;  // ems of the panels on the left

using panels::em;

/// A knob in the units people read; writes the value back where it was moved. @return whether it was
bool knob(const char* label, double& value, const ultrasound::ControlLimits::Range& range, double unit,
          const char* format) {
  auto shown = static_cast<float>(value / unit);
  if (!ImGui::SliderFloat(label, &shown, static_cast<float>(range.min / unit), static_cast<float>(range.max / unit),
                          format)) {
    return false;
  }
  value = static_cast<double>(shown) * unit;
  return true;
}

void draw_scanner(scanner::ScannerConsole& console) {
  ultrasound::ScannerControls controls = console.controls();
  const ultrasound::ControlLimits limits = ultrasound::ControlLimits::of(console.probe());
  bool turned = false;
  ImGui::PushItemWidth(-7.5F * em());
  turned |= knob("depth", controls.depth, limits.depth, 1e-3, "%.0f mm");
  turned |= knob("gain", controls.gain_db, limits.gain_db, 1, "%.0f dB");
  turned |= knob("focus", controls.focus, limits.focus, 1e-3, "%.0f mm");
  turned |= knob("frequency", controls.frequency_hz, limits.frequency_hz, 1e6, "%.2f MHz");
  turned |= knob("range", controls.dynamic_range_db, limits.dynamic_range_db, 1, "%.0f dB");
  turned |= knob("persistence", controls.persistence, limits.persistence, 1, "%.2f");
  ImGui::PopItemWidth();
  ImGui::TextDisabled("TGC, nearest first");
  for (std::size_t i = 0; i < controls.tgc_db.size(); ++i) {
    if (i > 0) ImGui::SameLine(0, 0.3F * em());
    auto shown = static_cast<float>(controls.tgc_db[i]);
    ImGui::PushID(static_cast<int>(i));
    if (ImGui::VSliderFloat("##tgc", {1.5F * em(), 4.5F * em()}, &shown, static_cast<float>(limits.tgc_db.min),
                            static_cast<float>(limits.tgc_db.max), "%.0f")) {
      controls.tgc_db[i] = static_cast<double>(shown);
      turned = true;
    }
    ImGui::PopID();
  }
  if (turned) console.set_controls(controls);
  if (ImGui::Button(console.frozen() ? "live (Space)" : "freeze (Space)")) console.press(' ', false);
  ImGui::SameLine();
  const bool raw = console.preset() == ultrasound::Preset::raw;
  if (ImGui::Button(raw ? "clinical (P)" : "raw (P)")) console.press('P', false);
  ImGui::SameLine();
  if (ImGui::Button("reset (C)")) console.press('C', false);
}

/// The panel on the upper left. @return the choice whose button was pressed
std::optional<std::size_t> draw_procedure(const DesktopFacts& facts) {
  std::optional<std::size_t> chosen;
  panels::draw_course(facts.session, kWidth);
  for (std::size_t i = 0; i < facts.choices.size(); ++i) {
    const Choice& choice = facts.choices[i];
    if (i > 0) ImGui::SameLine();
    ImGui::BeginDisabled(!choice.why_not.empty());
    const std::string label = choice.key.empty() ? choice.label : fmt::format("{} ({})", choice.label, choice.key);
    if (ImGui::Button(label.c_str())) chosen = i;
    ImGui::EndDisabled();
    if (!choice.why_not.empty() && ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) {
      ImGui::SetTooltip("%s", choice.why_not.c_str());
    }
  }
  ImGui::PushTextWrapPos(kWidth * em());
  ImGui::TextDisabled("needle: %s   H: keys", facts.device.c_str());
  ImGui::PopTextWrapPos();
  return chosen;
}

}  // namespace

bool Panels::press(int key) {
  switch (key) {
    case kTab:
      hidden_ = !hidden_;
      return true;
    case kF1 + 1:
      force_ = !force_;
      return true;
    case kF1 + 2:
      scanner_ = !scanner_;
      return true;
    case kF1 + 3:
      instructor_ = !instructor_;
      return true;
    case kF1 + 4:
      patient_view_ = static_cast<PatientView>((static_cast<int>(patient_view_) + 1) % 3);
      return true;
    default:
      return false;
  }
}

const std::vector<std::string>& Panels::help_lines() {
  static const std::vector<std::string> lines{
      "Panels",
      "Tab  all of them     F2  force     F3  scanner's knobs",
      "F4  instructor     F5  patient closed, opened, transparent",
      "Session: Enter  start, finish     T  fire or heat     X  pause     Backspace  try again",
  };
  return lines;
}

void Panels::draw_instructor(const panels::SessionFacts& facts) {
  panels::draw_place(facts);
  panels::draw_readings(facts);
  int view = static_cast<int>(patient_view_);
  ImGui::RadioButton("closed", &view, 0);
  ImGui::SameLine();
  ImGui::RadioButton("opened", &view, 1);
  ImGui::SameLine();
  ImGui::RadioButton("transparent (F5)", &view, 2);
  patient_view_ = static_cast<PatientView>(view);
  panels::draw_warnings(facts);
}

void Panels::draw_help(const DesktopFacts& facts, int width, int height) {
  ImGui::SetNextWindowPos({static_cast<float>(width) / 2, static_cast<float>(height) / 2}, ImGuiCond_Always,
                          {0.5F, 0.5F});
  if (ImGui::Begin("Keys (H closes)", nullptr, kFitted)) {
    for (const auto& lines : {facts.needle_help, help_lines(), scanner::ScannerConsole::help_lines()}) {
      for (const std::string& line : lines) ImGui::TextUnformatted(line.c_str());
      ImGui::Separator();
    }
  }
  ImGui::End();
}

void Panels::draw_briefing(const panels::SessionFacts& facts, int width, int height) {
  ImGui::SetNextWindowPos({static_cast<float>(width) / 2, static_cast<float>(height) / 2}, ImGuiCond_Always,
                          {0.5F, 0.5F});
  if (ImGui::Begin("Briefing", nullptr, kFitted)) {
    panels::draw_briefing(facts, 34);
  }
  ImGui::End();
}

std::optional<std::size_t> Panels::draw(const DesktopFacts& facts, scanner::ScannerConsole& console, int width,
                                        int height, const picture::Pane& ultrasound) {
  if (console.help()) draw_help(facts, width, height);
  if (hidden_) return std::nullopt;
  const panels::SessionFacts& session = facts.session;
  if (!session.briefing.empty() && !console.help()) draw_briefing(session, width, height);
  const auto margin = static_cast<float>(height) / 60;
  std::optional<std::size_t> chosen;
  ImGui::SetNextWindowPos({margin, margin});
  if (ImGui::Begin(session.title.c_str(), nullptr, kFitted)) chosen = draw_procedure(facts);
  ImGui::End();

  if (force_) {
    ImGui::SetNextWindowPos({margin, static_cast<float>(height) - margin}, ImGuiCond_Always, {0, 1});
    if (ImGui::Begin("Force (N) against depth (mm)", nullptr, kFitted)) panels::draw_force(session, kWidth, 12.3F);
    ImGui::End();
  }
  if (scanner_) {
    ImGui::SetNextWindowPos(
        {static_cast<float>(ultrasound.x), static_cast<float>(ultrasound.y + ultrasound.height) + margin});
    ImGui::SetNextWindowSize({static_cast<float>(ultrasound.width), 0});
    if (ImGui::Begin("Scanner", nullptr, kFixed)) draw_scanner(console);
    ImGui::End();
  }
  if (instructor_) {
    ImGui::SetNextWindowPos({static_cast<float>(width) - margin, static_cast<float>(height) - margin},
                            ImGuiCond_Always, {1, 1});
    if (ImGui::Begin("Instructor", nullptr, kFitted)) draw_instructor(session);
    ImGui::End();
  }
  return chosen;
}

}  // namespace stylet::desktop
