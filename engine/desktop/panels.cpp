#include "engine/desktop/panels.h"

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

// Linear, as the overlay's colours are.
const ImVec4 kAxial{0.15F, 0.57F, 0.71F, 1};
const ImVec4 kLateral{0.80F, 0.40F, 0.10F, 1};
const ImVec4 kHint{0.93F, 0.80F, 0.32F, 1};
const ImVec4 kFaint{0.25F, 0.30F, 0.33F, 1};

ImVec4 colour_of(Concern concern) {
  switch (concern) {
    case Concern::danger:
      return {0.95F, 0.12F, 0.08F, 1};
    case Concern::caution:
      return {0.93F, 0.52F, 0.06F, 1};
    case Concern::note:
      break;
  }
  return {0.55F, 0.62F, 0.66F, 1};
}

float em() {
  return ImGui::GetFontSize();
}

/// A round step that divides `range` into 2 to 5.
double round_step(double range) {
  const double power = std::pow(10.0, std::floor(std::log10(range / 2)));
  for (const double step : {5.0, 2.0}) {
    if (range / (step * power) >= 2) return step * power;
  }
  return power;
}

/// Force against depth, both axes from 0 or below, with a dot where the needle is.
void draw_force_curve(std::span<const session::ForceSample> samples, const ImVec2& size) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::Dummy(size);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  double deepest = 0.04, most = 1, least = 0;
  for (const session::ForceSample& sample : samples) {
    deepest = std::max(deepest, sample.depth);
    most = std::max({most, sample.axial, sample.lateral});
    least = std::min(least, sample.axial);
  }
  const ImVec2 from(corner.x + 2.2F * em(), corner.y + 0.4F * em());
  const ImVec2 to(corner.x + size.x - 0.6F * em(), corner.y + size.y - 1.4F * em());
  const auto at = [&](double depth, double force) {
    return ImVec2(from.x + static_cast<float>(depth / deepest) * (to.x - from.x),
                  to.y - static_cast<float>((force - least) / (most - least)) * (to.y - from.y));
  };
  const ImU32 faint = ImGui::GetColorU32(kFaint), text = ImGui::GetColorU32(ImGuiCol_Text);
  const double force_step = round_step(most - least), depth_step = round_step(deepest);
  for (double force = std::ceil(least / force_step) * force_step; force <= most; force += force_step) {
    list.AddLine(at(0, force), at(deepest, force), faint);
    const std::string label = fmt::format("{:g}", std::abs(force) < 1e-9 ? 0 : force);
    const float width = ImGui::CalcTextSize(label.c_str()).x;
    list.AddText({from.x - width - 0.4F * em(), at(0, force).y - em() / 2}, text, label.c_str());
  }
  for (double depth = 0; depth <= deepest; depth += depth_step) {
    const std::string label = fmt::format("{:g}", depth * 1e3);
    list.AddText({at(depth, 0).x - 0.3F * em(), to.y + 0.2F * em()}, text, label.c_str());
  }
  const std::size_t stride = std::max<std::size_t>(samples.size() / 1500, 1);
  std::vector<ImVec2> line;
  const auto curve = [&](double session::ForceSample::*value, const ImVec4& colour) {
    line.clear();
    for (std::size_t i = 0; i < samples.size(); i += stride) line.push_back(at(samples[i].depth, samples[i].*value));
    if (line.empty()) return;
    list.AddPolyline(line.data(), static_cast<int>(line.size()), ImGui::GetColorU32(colour), 0, 0.12F * em());
    list.AddCircleFilled(line.back(), 0.25F * em(), ImGui::GetColorU32(colour));
  };
  curve(&session::ForceSample::lateral, kLateral);
  curve(&session::ForceSample::axial, kAxial);
}

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

void draw_scanner(session::ScannerConsole& console) {
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

std::string clock(double time_s) {
  const int seconds = static_cast<int>(time_s);
  return fmt::format("{}:{:02}", seconds / 60, seconds % 60);
}

/// The panel on the upper left. @return the choice whose button was pressed
std::optional<std::size_t> draw_procedure(const SessionFacts& facts) {
  std::optional<std::size_t> chosen;
  ImGui::TextColored(kAxial, "%s", facts.stage.c_str());
  ImGui::SameLine();
  ImGui::TextDisabled("%s%s", clock(facts.time_s).c_str(), facts.paused ? "  paused: no force" : "");
  ImGui::PushTextWrapPos(21 * em());
  ImGui::TextUnformatted(facts.prompt.c_str());
  if (!facts.hint.empty()) ImGui::TextColored(kHint, "%s", facts.hint.c_str());
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

void Panels::draw_instructor(const SessionFacts& facts) {
  if (facts.target_distance) ImGui::Text("tip to target   %5.1f mm", *facts.target_distance * 1e3);
  if (facts.out_of_plane) ImGui::Text("tip from plane  %5.1f mm", *facts.out_of_plane * 1e3);
  ImGui::Text("depth           %5.1f mm", facts.insertion_depth * 1e3);
  ImGui::Text("force on hand   %5.2f N", facts.force);
  ImGui::Text("probe on skin   %5.1f N", facts.probe_force);
  if (!facts.tissue.empty()) ImGui::Text("tip in          %s", facts.tissue.c_str());
  int view = static_cast<int>(patient_view_);
  ImGui::RadioButton("closed", &view, 0);
  ImGui::SameLine();
  ImGui::RadioButton("opened", &view, 1);
  ImGui::SameLine();
  ImGui::RadioButton("transparent (F5)", &view, 2);
  patient_view_ = static_cast<PatientView>(view);
  for (const Warning& warning : facts.warnings) {
    ImGui::TextColored(colour_of(warning.concern), "%s", warning.text.c_str());
  }
}

void Panels::draw_help(const SessionFacts& facts, int width, int height) {
  ImGui::SetNextWindowPos({static_cast<float>(width) / 2, static_cast<float>(height) / 2}, ImGuiCond_Always,
                          {0.5F, 0.5F});
  if (ImGui::Begin("Keys (H closes)", nullptr, kFitted)) {
    for (const auto& lines : {facts.needle_help, help_lines(), session::ScannerConsole::help_lines()}) {
      for (const std::string& line : lines) ImGui::TextUnformatted(line.c_str());
      ImGui::Separator();
    }
  }
  ImGui::End();
}

void Panels::draw_briefing(const SessionFacts& facts, int width, int height) {
  ImGui::SetNextWindowPos({static_cast<float>(width) / 2, static_cast<float>(height) / 2}, ImGuiCond_Always,
                          {0.5F, 0.5F});
  if (ImGui::Begin("Briefing", nullptr, kFitted)) {
    ImGui::PushTextWrapPos(34 * em());
    for (const std::string& paragraph : facts.briefing) {
      ImGui::TextUnformatted(paragraph.c_str());
      ImGui::Spacing();
    }
    ImGui::PopTextWrapPos();
  }
  ImGui::End();
}

std::optional<std::size_t> Panels::draw(const SessionFacts& facts, session::ScannerConsole& console, int width,
                                        int height, const view::Pane& ultrasound) {
  if (console.help()) draw_help(facts, width, height);
  if (hidden_) return std::nullopt;
  if (!facts.briefing.empty() && !console.help()) draw_briefing(facts, width, height);
  const auto margin = static_cast<float>(height) / 60;
  std::optional<std::size_t> chosen;
  ImGui::SetNextWindowPos({margin, margin});
  if (ImGui::Begin(facts.title.c_str(), nullptr, kFitted)) chosen = draw_procedure(facts);
  ImGui::End();

  if (force_) {
    ImGui::SetNextWindowPos({margin, static_cast<float>(height) - margin}, ImGuiCond_Always, {0, 1});
    if (ImGui::Begin("Force (N) against depth (mm)", nullptr, kFitted)) {
      draw_force_curve(facts.force_curve, {21 * em(), 11 * em()});
      ImGui::TextColored(kAxial, "axial");
      ImGui::SameLine();
      ImGui::TextColored(kLateral, "lateral");
      ImGui::SameLine();
      ImGui::TextDisabled("%.2f N at %.0f mm", facts.force, facts.insertion_depth * 1e3);
    }
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
    if (ImGui::Begin("Instructor", nullptr, kFitted)) draw_instructor(facts);
    ImGui::End();
  }
  return chosen;
}

}  // namespace stylet::desktop
