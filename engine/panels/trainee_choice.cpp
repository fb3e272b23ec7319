#include "engine/panels/trainee_choice.h"

#include "engine/panels/parts.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

namespace stylet::panels {
namespace {

constexpr float kChoiceWidth = 30;  // ems at most
constexpr std::size_t kPage = 10;
constexpr ImGuiWindowFlags kStill = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                                    ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_NoNav;

// The pad: three to a row, then 0 and Delete; beside it Go on over Other name.
constexpr std::array<char, 10> kDigits{'7', '8', '9', '4', '5', '6', '1', '2', '3', '0'};
constexpr std::size_t kDelete = 10, kGoOn = 11, kOtherName = 12, kPadKeys = 13;
constexpr float kPadSide = 3.2F;  // ems at most
constexpr std::size_t kPadRows = 4;

/// The key beside one, as an arrow goes; at the edges the same.
std::size_t beside(std::size_t at, view::Key arrow) {
  if (at >= kGoOn) {
    switch (arrow) {
      case view::Key::up:
        return kGoOn;
      case view::Key::down:
        return kOtherName;
      case view::Key::left:
        return at == kGoOn ? 5 : kDelete;
      default:
        return at;
    }
  }
  const std::size_t row = at / 3, column = at % 3;
  switch (arrow) {
    case view::Key::right:
      if (at == kDelete) return kOtherName;
      return column == 2 ? kGoOn : at + 1;
    case view::Key::left:
      return column > 0 ? at - 1 : at;
    case view::Key::down:
      return row + 1 < kPadRows ? std::min(at + 3, kDelete) : at;
    case view::Key::up:
      return row > 0 ? at - 3 : at;
    default:
      return at;
  }
}

std::string first_letter(const TraineeEntry& entry) {
  return entry.name.empty()
             ? std::string()
             : std::string(1, static_cast<char>(std::tolower(static_cast<unsigned char>(entry.name[0]))));
}

}  // namespace

TraineeChoice::TraineeChoice(std::vector<TraineeEntry> entries, std::size_t most_digits, TryPin try_pin)
    : entries_(std::move(entries)), most_digits_(most_digits), try_pin_(std::move(try_pin)) {
  std::ranges::sort(entries_, {}, &TraineeEntry::name);
  entries_.insert(entries_.begin(), TraineeEntry{});
}

const std::string& TraineeChoice::pseudonym() const {
  return entries_[chosen_].pseudonym;
}

void TraineeChoice::choose(const std::string& pseudonym) {
  const auto found = std::ranges::find(entries_, pseudonym, &TraineeEntry::pseudonym);
  chosen_ = found != entries_.end() ? static_cast<std::size_t>(found - entries_.begin()) : 0;
  scroll_ = true;
}

TraineeWish TraineeChoice::go_on() {
  if (!entries_[chosen_].has_pin) return TraineeWish::chosen;
  if (!std::exchange(asks_, true)) {
    at_ = 0;
    return TraineeWish::nothing;
  }
  if (pin_.empty()) return TraineeWish::nothing;
  const PinAnswer answer = try_pin_(pseudonym(), std::exchange(pin_, {}));
  if (answer.right) {
    asks_ = false;
    problem_.clear();
    return TraineeWish::chosen;
  }
  problem_ = answer.looked_at
                 ? fmt::format("The PIN is wrong; the next try in {} s", answer.wait_s)
                 : fmt::format("Too early, the PIN was not looked at; the next try in {} s", answer.wait_s);
  return TraineeWish::nothing;
}

TraineeWish TraineeChoice::go_back() {
  if (!asks_) return TraineeWish::back;
  asks_ = false;
  pin_.clear();
  problem_.clear();
  return TraineeWish::nothing;
}

void TraineeChoice::add_digit(char digit) {
  if (pin_.size() < most_digits_) pin_ += digit;
}

TraineeWish TraineeChoice::press_pad() {
  if (at_ < kDigits.size()) {
    add_digit(kDigits[at_]);
  } else if (at_ == kDelete) {
    if (!pin_.empty()) pin_.pop_back();
  } else {
    return at_ == kGoOn ? go_on() : go_back();
  }
  return TraineeWish::nothing;
}

TraineeWish TraineeChoice::handle_name(const view::Stroke& stroke) {
  using view::Key;
  const std::size_t before = chosen_;
  if (stroke.key == Key::up || stroke.key == Key::page_up) {
    chosen_ -= std::min(chosen_, stroke.key == Key::up ? std::size_t{1} : kPage);
  } else if (stroke.key == Key::down || stroke.key == Key::page_down) {
    chosen_ = std::min(chosen_ + (stroke.key == Key::down ? 1 : kPage), entries_.size() - 1);
  } else if (stroke.key == Key::tab) {
    chosen_ = (chosen_ + (stroke.shift ? entries_.size() - 1 : 1)) % entries_.size();
  } else if (stroke.key >= Key::a && stroke.key <= Key::z) {
    // The next of that letter, from the beginning again after the last.
    const std::string letter(1, static_cast<char>('a' + (static_cast<int>(stroke.key) - static_cast<int>(Key::a))));
    for (std::size_t k = 1; k <= entries_.size(); ++k) {
      const std::size_t at = (before + k) % entries_.size();
      if (first_letter(entries_[at]) != letter) continue;
      chosen_ = at;
      break;
    }
  } else if (stroke.key == Key::backspace && !stroke.repeated) {
    return go_back();
  } else if (stroke.key == Key::space && !stroke.repeated) {
    return go_on();
  }
  scroll_ = scroll_ || chosen_ != before;
  return TraineeWish::nothing;
}

TraineeWish TraineeChoice::handle_pin(const view::Stroke& stroke) {
  using view::Key;
  if (stroke.key >= Key::digit_0 && stroke.key <= Key::digit_9) {
    add_digit(static_cast<char>('0' + (static_cast<int>(stroke.key) - static_cast<int>(Key::digit_0))));
  } else if (stroke.key == Key::backspace && !pin_.empty()) {
    pin_.pop_back();
  } else if (stroke.key == Key::backspace && !stroke.repeated) {
    return go_back();
  } else if (stroke.key == Key::tab) {
    at_ = (at_ + (stroke.shift ? kPadKeys - 1 : 1)) % kPadKeys;
  } else if (stroke.key >= Key::right && stroke.key <= Key::up) {
    at_ = beside(at_, stroke.key);
  } else if (stroke.key == Key::space && !stroke.repeated) {
    return press_pad();
  }
  return TraineeWish::nothing;
}

TraineeWish TraineeChoice::handle(const view::Input& input) {
  if (input.close) return TraineeWish::back;
  for (const view::Stroke& stroke : input.strokes) {
    TraineeWish wish = asks_ ? handle_pin(stroke) : handle_name(stroke);
    if (stroke.key == view::Key::enter && !stroke.repeated) wish = go_on();
    if (wish != TraineeWish::nothing) return wish;
  }
  return TraineeWish::nothing;
}

TraineeWish TraineeChoice::draw_list(float height, const content::Texts& texts, bool keys) {
  const float row = ImGui::GetFrameHeightWithSpacing();
  const float rows = static_cast<float>(entries_.size()) * row + 2 * ImGui::GetStyle().WindowPadding.y;
  ImGui::BeginChild("names", {0, std::min(rows, height)}, true);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    const std::string label = i == 0 ? texts.of("Without a name: nothing is kept") : entries_[i].name;
    // What the pointer is over is less than what is chosen.
    const bool other = chosen_ != i;
    if (other) ImGui::PushStyleColor(ImGuiCol_HeaderHovered, ImGui::GetStyleColorVec4(ImGuiCol_FrameBg));
    if (ImGui::Selectable("##name", chosen_ == i, 0, {0, ImGui::GetFrameHeight()})) chosen_ = i;
    if (other) ImGui::PopStyleColor();
    if (chosen_ == i && scroll_) ImGui::SetScrollHereY();
    // A label would end at "##", which a name may have in it.
    ImGui::SameLine(em());
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(label.c_str());
    ImGui::PopID();
  }
  scroll_ = false;
  ImGui::EndChild();
  TraineeWish wish = TraineeWish::nothing;
  if (ImGui::Button((texts.of("Go on") + (keys ? " (Enter)" : "") + "###go").c_str())) wish = go_on();
  if (!keys) return wish;  // who cannot press it
  ImGui::SameLine();
  if (ImGui::Button((texts.of("Back") + " (Backspace)###back").c_str())) wish = go_back();
  return wish;
}

TraineeWish TraineeChoice::draw_pin(float height, const content::Texts& texts, bool keys) {
  const ImVec2 gap = ImGui::GetStyle().ItemSpacing;
  const float side = std::min(kPadSide * em(), height / kPadRows - gap.y);
  TraineeWish wish = TraineeWish::nothing;
  const auto key = [&](std::size_t at, const std::string& label, const ImVec2& size) {
    const bool here = at == at_;
    if (here) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
    const bool pressed = ImGui::Button(label.c_str(), size);
    if (here) ImGui::PopStyleColor();
    if (!pressed) return;
    at_ = at;
    wish = press_pad();
  };
  ImGui::BeginGroup();
  for (std::size_t i = 0; i < kDigits.size(); ++i) {
    if (i % 3 != 0) ImGui::SameLine();
    key(i, std::string(1, kDigits[i]), {side, side});
  }
  ImGui::SameLine();
  key(kDelete, texts.of("Delete") + "###delete", {2 * side + gap.x, side});
  ImGui::EndGroup();
  ImGui::SameLine(0, em());
  ImGui::BeginGroup();
  ImGui::TextWrapped("%s", entries_[chosen_].name.c_str());
  ImGui::Text("%s %s", texts.of("PIN:").c_str(), std::string(pin_.size(), '*').c_str());
  key(kGoOn, texts.of("Go on") + (keys ? " (Enter)" : "") + "###go", {0, 0});
  key(kOtherName, texts.of("Other name") + "###back", {0, 0});
  ImGui::PushTextWrapPos(0);
  ImGui::TextColored({0.93F, 0.52F, 0.06F, 1}, "%s", problem_.empty() ? " " : texts.of(problem_).c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndGroup();
  return wish;
}

TraineeWish TraineeChoice::draw(int width, int height, const content::Texts& texts, bool keys) {
  TraineeWish wish = TraineeWish::nothing;
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float wide = std::min(kChoiceWidth * em(), 0.96F * w);
  ImGui::SetNextWindowPos({w / 2, h / 2}, ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, 0.96F * h});
  ImGui::SetNextWindowSize({wide, 0});
  if (ImGui::Begin((texts.of("Who trains?") + "###trainee").c_str(), nullptr, kStill)) {
    const float left = 0.96F * h - ImGui::GetCursorPosY() - ImGui::GetStyle().WindowPadding.y;
    wish =
        asks_ ? draw_pin(left, texts, keys) : draw_list(left - 2 * ImGui::GetFrameHeightWithSpacing(), texts, keys);
  }
  ImGui::End();
  return wish;
}

}  // namespace stylet::panels
