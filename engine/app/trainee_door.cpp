#include "engine/app/trainee_door.h"

#include "engine/app/build_name.h"
#include "engine/files/error.h"
#include "engine/lab/server/logins.h"

#include <algorithm>
#include <cstdint>
#include <system_error>
#include <utility>

namespace stylet::app {

bool is_pin(std::string_view text) {
  return text.size() >= kShortestPin && text.size() <= kLongestPin &&
         std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

std::unique_ptr<TraineeDoor> TraineeDoor::at(std::filesystem::path folder) {
  std::error_code error;
  if (folder.empty()) {
    try {
      folder = lab::store::default_lab_folder();
    } catch (const files::ContentError&) {  // no place for records: there are none
      return nullptr;
    }
  }
  if (!std::filesystem::exists(folder / "lab.db", error)) return nullptr;
  std::unique_ptr<TraineeDoor> door(
      new TraineeDoor(lab::store::open_station({.folder = std::move(folder), .build = build_name()})));
  lab::store::Lab& lab = door->station_.lab();
  for (const lab::store::Person& person : lab.everybody()) {
    door->entries_.push_back({.pseudonym = person.pseudonym,
                              .name = person.name.empty() ? person.pseudonym : person.name,
                              .has_pin = lab.pin(person.id).has_value()});
  }
  return door->entries_.empty() ? nullptr : std::move(door);
}

panels::TraineeChoice TraineeDoor::choice() {
  return {entries_, kLongestPin,
          [this](const std::string& pseudonym, const std::string& pin) { return try_pin(pseudonym, pin); }};
}

panels::PinAnswer TraineeDoor::try_pin(const std::string& pseudonym, const std::string& pin) {
  const auto seconds = [](std::int64_t ms) { return (ms + 999) / 1000; };
  lab::store::Lab& lab = station_.lab();
  const auto person = lab.find(pseudonym);
  if (!person) return {};
  const auto held = lab.pin(person->id);
  if (!held) return {.right = true};
  if (held->wait_ms > 0) return {.looked_at = false, .wait_s = seconds(held->wait_ms)};
  const bool right = lab::server::is_password(held->hash, pin);
  lab.pin_tried(person->id, right);
  const auto after = lab.pin(person->id);
  return {.right = right, .wait_s = right || !after ? 0 : seconds(after->wait_ms)};
}

}  // namespace stylet::app
