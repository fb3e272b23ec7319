#include "engine/desktop/panels.h"

#include "engine/desktop/key_table.h"
#include "engine/panels/parts.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace stylet::desktop {
namespace {

constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                                    ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;
constexpr ImGuiWindowFlags kFitted = kFixed | ImGuiWindowFlags_AlwaysAutoResize;

using panels::em;

using Commands = std::vector<scanner::Command>;

/// How a panel fills its place: all of it, or as high as what it says, at the top, in the middle or at the bottom.
enum class Fill : std::uint8_t { all, top, middle, bottom };

/// Begins a panel in its place; what does not fit scrolls. ImGui::End() ends it in any case. @return it is seen
bool panel(const char* title, const picture::Pane& place, Fill fill) {
  const ImVec2 at(static_cast<float>(place.x), static_cast<float>(place.y));
  const ImVec2 size(static_cast<float>(place.width), static_cast<float>(place.height));
  const float share = fill == Fill::bottom ? 1.0F : fill == Fill::middle ? 0.5F : 0.0F;
  ImGui::SetNextWindowPos({at.x, at.y + share * size.y}, ImGuiCond_Always, {0, share});
  if (fill == Fill::all) {
    ImGui::SetNextWindowSize(size);
  } else {
    ImGui::SetNextWindowSizeConstraints({size.x, 0}, size);
    ImGui::SetNextWindowSize({size.x, 0});  // as high as it needs
  }
  return ImGui::Begin(title, nullptr, title[0] == '#' ? kFixed | ImGuiWindowFlags_NoTitleBar : kFixed);
}

/// Ems from the left edge of what a panel says to its right edge.
float inner_width() {
  return ImGui::GetContentRegionAvail().x / em();
}

/// A knob in the units people read. @return the value that it was moved to
std::optional<double> moved_knob(const char* label, double value, const ultrasound::ControlLimits::Range& range,
                                 double unit, const char* format) {
  auto shown = static_cast<float>(value / unit);
  if (!ImGui::SliderFloat(label, &shown, static_cast<float>(range.min / unit), static_cast<float>(range.max / unit),
                          format)) {
    return std::nullopt;
  }
  return static_cast<double>(shown) * unit;
}

void draw_knobs(const ultrasound::ScannerControls& at, const ultrasound::ControlLimits& limits, Commands& commands) {
  using namespace scanner;
  if (const auto m = moved_knob("depth", at.depth, limits.depth, 1e-3, "%.0f mm")) commands.push_back(SetDepth{*m});
  if (const auto db = moved_knob("gain", at.gain_db, limits.gain_db, 1, "%.0f dB")) commands.push_back(SetGain{*db});
  if (const auto m = moved_knob("focus", at.focus, limits.focus, 1e-3, "%.0f mm")) commands.push_back(SetFocus{*m});
  if (const auto hz = moved_knob("frequency", at.frequency_hz, limits.frequency_hz, 1e6, "%.2f MHz")) {
    commands.push_back(SetFrequency{*hz});
  }
  if (const auto db = moved_knob("range", at.dynamic_range_db, limits.dynamic_range_db, 1, "%.0f dB")) {
    commands.push_back(SetDynamicRange{*db});
  }
  if (const auto share = moved_knob("persistence", at.persistence, limits.persistence, 1, "%.2f")) {
    commands.push_back(SetPersistence{*share});
  }
}

void draw_tgc(const ultrasound::ScannerControls& at, const ultrasound::ControlLimits& limits, Commands& commands) {
  ImGui::TextDisabled("TGC, nearest first");
  for (int i = 0; i < ultrasound::kTgcSliders; ++i) {
    if (i > 0) ImGui::SameLine(0, 0.3F * em());
    auto shown = static_cast<float>(at.tgc_db[i]);
    ImGui::PushID(i);
    if (ImGui::VSliderFloat("##tgc", {1.5F * em(), 4.5F * em()}, &shown, static_cast<float>(limits.tgc_db.min),
                            static_cast<float>(limits.tgc_db.max), "%.0f")) {
      commands.push_back(scanner::SetTgc{.slider = i, .db = static_cast<double>(shown)});
    }
    ImGui::PopID();
  }
}

void draw_scanner(const scanner::ScannerConsole& console, Commands& commands) {
  const ultrasound::ControlLimits limits = ultrasound::ControlLimits::of(console.probe());
  ImGui::PushItemWidth(-7.5F * em());
  draw_knobs(console.controls(), limits, commands);
  ImGui::PopItemWidth();
  draw_tgc(console.controls(), limits, commands);
  if (ImGui::Button(console.frozen() ? "live (Space)" : "freeze (Space)")) commands.push_back(scanner::Freeze{});
  ImGui::SameLine();
  const bool raw = console.preset() == ultrasound::Preset::raw;
  if (ImGui::Button(raw ? "clinical (P)" : "raw (P)")) commands.push_back(scanner::SetPreset{});
  ImGui::SameLine();
  if (ImGui::Button("reset (C)")) commands.push_back(scanner::Reset{});
  ImGui::SameLine();
  if (ImGui::Button("save (F12)")) commands.push_back(scanner::SaveImage{});
}

/// A row of buttons that goes on in the next line where it is full. @return the choice whose button was pressed
std::optional<std::size_t> draw_choices(const std::vector<Choice>& choices) {
  std::optional<std::size_t> chosen;
  const ImGuiStyle& style = ImGui::GetStyle();
  const float right = ImGui::GetCursorScreenPos().x + ImGui::GetContentRegionAvail().x;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const Choice& choice = choices[i];
    const std::string label = choice.key.empty() ? choice.label : fmt::format("{} ({})", choice.label, choice.key);
    const float width = ImGui::CalcTextSize(label.c_str()).x + 2 * style.FramePadding.x;
    if (i > 0 && ImGui::GetItemRectMax().x + style.ItemSpacing.x + width <= right) ImGui::SameLine();
    ImGui::BeginDisabled(!choice.why_not.empty());
    if (ImGui::Button(label.c_str())) chosen = i;
    ImGui::EndDisabled();
    if (!choice.why_not.empty() && ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) {
      ImGui::SetTooltip("%s", choice.why_not.c_str());
    }
  }
  return chosen;
}

/// The panel on the upper left. @return the choice whose button was pressed
std::optional<std::size_t> draw_procedure(const DesktopFacts& facts) {
  panels::draw_course(facts.session, inner_width());
  const auto chosen = facts.ending == nullptr ? draw_choices(facts.choices) : std::nullopt;
  ImGui::PushTextWrapPos(0);
  ImGui::TextDisabled("needle: %s   H: keys", facts.device.c_str());
  if (!facts.sound.empty()) ImGui::TextDisabled("%s: %s", key_of_sound().c_str(), facts.sound.c_str());
  ImGui::PopTextWrapPos();
  return chosen;
}

/// At the lower edge, clear of the other panels.
void draw_figures(const DesktopFacts& facts, int width, int height) {
  ImGui::SetNextWindowPos({static_cast<float>(width) / 2, static_cast<float>(height)}, ImGuiCond_Always, {0.5F, 1});
  constexpr ImGuiWindowFlags kLine = kFitted | ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoInputs;
  if (ImGui::Begin("Pictures", nullptr, kLine)) ImGui::TextUnformatted(facts.pictures.c_str());
  ImGui::End();
}

/// What the session came to, and what to do now. @return the choice whose button was pressed
std::optional<std::size_t> draw_ending(const DesktopFacts& facts) {
  panels::draw_ending(*facts.ending, inner_width());
  return draw_choices(facts.choices);
}

}  // namespace

void Panels::apply(PanelCommand command) {
  switch (command) {
    case PanelCommand::toggle_all:
      hidden_ = !hidden_;
      break;
    case PanelCommand::toggle_force:
      force_ = !force_;
      break;
    case PanelCommand::toggle_scanner:
      scanner_ = !scanner_;
      break;
    case PanelCommand::toggle_instructor:
      instructor_ = !instructor_;
      break;
    case PanelCommand::toggle_help:
      help_ = !help_;
      break;
    case PanelCommand::next_patient_view:
      patient_view_ = static_cast<PatientView>((static_cast<int>(patient_view_) + 1) % 3);
      break;
    case PanelCommand::toggle_figures:
      figures_ = !figures_;
      break;
    case PanelCommand::other_hand:
      left_handed_ = !left_handed_;
      break;
  }
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
    for (const KeySection section : kKeySections) {
      if (section == KeySection::needle && !facts.led_by_keys) continue;
      for (const std::string& line : help_lines(section)) ImGui::TextUnformatted(line.c_str());
      ImGui::Separator();
    }
  }
  ImGui::End();
}

OpenPanels Panels::open(const DesktopFacts& facts) const {
  const bool ending = facts.ending != nullptr;
  if (hidden_) return {.force = false, .ending = ending, .left_handed = left_handed_};
  return {.force = force_,
          .scanner = scanner_,
          .instructor = instructor_,
          .briefing = !ending && !help_ && !facts.session.briefing.empty(),
          .ending = ending,
          .left_handed = left_handed_};
}

Layout Panels::layout(const DesktopFacts& facts, int width, int height) const {
  return layout_of(width, height, em(), open(facts));
}

PanelInput Panels::draw(const DesktopFacts& facts, const scanner::ScannerConsole& console, int width, int height) {
  PanelInput input;
  const OpenPanels open = this->open(facts);
  const Layout layout = this->layout(facts, width, height);
  const panels::SessionFacts& session = facts.session;
  const content::Texts english;
  const content::Texts& texts = facts.texts != nullptr ? *facts.texts : english;
  // A name of its own behind what people read: the same window in every language.
  const auto titled = [&](const char* title) { return fmt::format("{}###{}", texts.of(title), title); };
  if (help_) draw_help(facts, width, height);
  if (figures_ && !open.ending) draw_figures(facts, width, height);
  if (open.ending && panel("##ending", layout.middle, Fill::middle)) input.choice = draw_ending(facts);
  if (open.ending) ImGui::End();
  if (hidden_) return input;
  if (open.briefing) {
    if (panel(titled("Briefing").c_str(), layout.middle, Fill::middle)) panels::draw_briefing(session, inner_width());
    ImGui::End();
  }
  if (panel((session.title + "###course").c_str(), layout.course, Fill::top)) {
    const std::optional<std::size_t> chosen = draw_procedure(facts);
    if (chosen) input.choice = chosen;
  }
  ImGui::End();
  if (open.force) {
    if (panel(titled("Force (N) against depth (mm)").c_str(), layout.force, Fill::all)) {
      panels::draw_force(session, inner_width(), ImGui::GetContentRegionAvail().y / em());
    }
    ImGui::End();
  }
  if (open.scanner) {
    if (panel(titled("Scanner").c_str(), layout.scanner, Fill::top)) draw_scanner(console, input.scanner);
    ImGui::End();
  }
  if (open.instructor) {
    if (panel(titled("Instructor").c_str(), layout.instructor, Fill::bottom)) draw_instructor(session);
    ImGui::End();
  }
  return input;
}

}  // namespace stylet::desktop
