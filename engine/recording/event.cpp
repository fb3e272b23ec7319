#include "engine/recording/event.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace stylet::recording {
namespace {

const Field* find(const EventRecord& event, std::string_view name) {
  const auto found = std::ranges::find(event.fields, name, &Field::name);
  return found == event.fields.end() ? nullptr : &*found;
}

}  // namespace

std::optional<double> EventRecord::number(std::string_view field) const {
  const Field* found = find(*this, field);
  if (found == nullptr) return std::nullopt;
  if (const auto* count = std::get_if<std::int64_t>(&found->value)) return static_cast<double>(*count);
  const auto* number = std::get_if<double>(&found->value);
  return number != nullptr && std::isfinite(*number) ? std::optional(*number) : std::nullopt;
}

std::string_view EventRecord::text(std::string_view field) const {
  const Field* found = find(*this, field);
  const auto* word = found != nullptr ? std::get_if<std::string>(&found->value) : nullptr;
  return word != nullptr ? std::string_view(*word) : std::string_view();
}

std::string fields_in_words(const EventRecord& event) {
  std::string words;
  for (const Field& field : event.fields) {
    if (!words.empty()) words += ", ";
    if (field.name != EventRecord::kVersion1Field) words += field.name + ' ';
    if (const auto* number = std::get_if<double>(&field.value)) {
      words += field.unit == "1" ? fmt::format("{:.4g} %", 100 * *number)
                                 : fmt::format("{:.4g}{}{}", *number, field.unit.empty() ? "" : " ", field.unit);
    } else if (const auto* count = std::get_if<std::int64_t>(&field.value)) {
      words += std::to_string(*count);
    } else {
      words += std::get<std::string>(field.value);
    }
  }
  return words;
}

}  // namespace stylet::recording
