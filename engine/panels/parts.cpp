#include "engine/panels/parts.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace stylet::panels {
namespace {

// Linear, as the overlay's colours are.
const ImVec4 kAxial{0.15F, 0.57F, 0.71F, 1};
const ImVec4 kLateral{0.80F, 0.40F, 0.10F, 1};
const ImVec4 kHint{0.93F, 0.80F, 0.32F, 1};
const ImVec4 kPassed{0.18F, 0.65F, 0.25F, 1};
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

/// A round step that divides `range` into 2 to 5.
double round_step(double range) {
  const double power = std::pow(10.0, std::floor(std::log10(range / 2)));
  for (const double step : {5.0, 2.0}) {
    if (range / (step * power) >= 2) return step * power;
  }
  return power;
}

/// Force against depth, both axes from 0 or below, with a dot where the needle is.
void draw_force_curve(std::span<const figures::ForceSample> samples, const ImVec2& size) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::Dummy(size);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  double deepest = 0.04, most = 1, least = 0;
  for (const figures::ForceSample& sample : samples) {
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
  const auto curve = [&](double figures::ForceSample::*value, const ImVec4& colour) {
    line.clear();
    for (std::size_t i = 0; i < samples.size(); i += stride) line.push_back(at(samples[i].depth, samples[i].*value));
    if (line.empty()) return;
    list.AddPolyline(line.data(), static_cast<int>(line.size()), ImGui::GetColorU32(colour), 0, 0.12F * em());
    list.AddCircleFilled(line.back(), 0.25F * em(), ImGui::GetColorU32(colour));
  };
  curve(&figures::ForceSample::lateral, kLateral);
  curve(&figures::ForceSample::axial, kAxial);
}

/// What was measured, and the points it got.
void draw_points(const std::vector<EndingLine>& lines) {
  if (lines.empty() || !ImGui::BeginTable("points", 3, ImGuiTableFlags_SizingStretchProp)) return;
  ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch);
  ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed);
  ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed);
  for (const EndingLine& line : lines) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(line.title.c_str());
    ImGui::TableNextColumn();
    ImGui::TextDisabled("%s", line.value.c_str());
    ImGui::TableNextColumn();
    const bool low = line.failed || line.points < line.most / 2;
    ImGui::TextColored(low ? colour_of(Concern::caution) : kPassed, "%.0f / %.0f", line.points, line.most);
  }
  ImGui::EndTable();
}

std::string clock(double time_s) {
  const int seconds = static_cast<int>(time_s);
  return fmt::format("{}:{:02}", seconds / 60, seconds % 60);
}

}  // namespace

float em() {
  return ImGui::GetFontSize();
}

void draw_course(const SessionFacts& facts, float width) {
  ImGui::TextColored(kAxial, "%s", facts.stage.c_str());
  ImGui::SameLine();
  ImGui::TextDisabled("%s%s", clock(facts.time_s).c_str(), facts.paused ? "  paused: no force" : "");
  ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width * em());
  ImGui::TextUnformatted(facts.prompt.c_str());
  if (!facts.breath.empty()) ImGui::TextColored(kAxial, "%s", facts.breath.c_str());
  if (!facts.hint.empty()) ImGui::TextColored(kHint, "%s", facts.hint.c_str());
  ImGui::PopTextWrapPos();
}

void draw_briefing(const SessionFacts& facts, float width) {
  ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width * em());
  for (const std::string& paragraph : facts.briefing) {
    ImGui::TextUnformatted(paragraph.c_str());
    ImGui::Spacing();
  }
  ImGui::PopTextWrapPos();
}

void draw_ending(const Ending& ending, float width) {
  ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width * em());
  if (ending.score) {
    const ImVec4 verdict = ending.passed ? kPassed : colour_of(Concern::danger);
    ImGui::SetWindowFontScale(2);
    ImGui::TextColored(verdict, "%.0f", *ending.score);
    ImGui::SetWindowFontScale(1);
    ImGui::SameLine();
    ImGui::BeginGroup();
    ImGui::TextColored(verdict, "%s", ending.verdict.c_str());
    ImGui::TextDisabled("%s", ending.wanted.c_str());
    ImGui::EndGroup();
  } else {
    ImGui::TextColored(kAxial, "%s", ending.verdict.c_str());
  }
  for (const std::string& line : ending.result) ImGui::TextUnformatted(line.c_str());
  if (!ending.advice.empty()) {
    ImGui::Spacing();
    ImGui::TextColored(kHint, "%s", ending.advice.c_str());
  }
  ImGui::PopTextWrapPos();
  draw_points(ending.lines);
  ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width * em());
  if (!ending.doing.empty()) {
    ImGui::ProgressBar(static_cast<float>(ending.share), {-1, 0}, ending.doing.c_str());
  }
  if (!ending.note.empty()) ImGui::TextDisabled("%s", ending.note.c_str());
  ImGui::PopTextWrapPos();
  ImGui::Spacing();
}

void draw_force(const SessionFacts& facts, float width, float height) {
  draw_force_curve(facts.force_curve, {width * em(), height * em() - ImGui::GetTextLineHeightWithSpacing()});
  ImGui::TextColored(kAxial, "axial");
  ImGui::SameLine();
  ImGui::TextColored(kLateral, "lateral");
  ImGui::SameLine();
  ImGui::TextDisabled("%.2f N at %.0f mm", facts.force, facts.insertion_depth * 1e3);
}

void draw_readings(const SessionFacts& facts) {
  ImGui::Text("depth           %5.1f mm", facts.insertion_depth * 1e3);
  ImGui::Text("force on hand   %5.2f N", facts.force);
  if (facts.force_scale < 1) {
    ImGui::SameLine();
    ImGui::TextDisabled("felt at %.0f %%", 100 * facts.force_scale);
  }
  ImGui::Text("probe on skin   %5.1f N", facts.probe_force);
}

void draw_place(const SessionFacts& facts) {
  if (facts.target_distance) ImGui::Text("tip to target   %5.1f mm", *facts.target_distance * 1e3);
  if (facts.out_of_plane) ImGui::Text("tip from plane  %5.1f mm", *facts.out_of_plane * 1e3);
  if (!facts.tissue.empty()) ImGui::Text("tip in          %s", facts.tissue.c_str());
}

void draw_warnings(const SessionFacts& facts) {
  for (const Warning& warning : facts.warnings) {
    ImGui::TextColored(colour_of(warning.concern), "%s", warning.text.c_str());
  }
}

}  // namespace stylet::panels
