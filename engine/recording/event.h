// Something worth knowing at a time of a session: a name and typed fields. Text is made of it where people read it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace stylet::recording {

/// One thing that an event says: a quantity, a count or a word.
struct Field {
  std::string name;
  std::variant<double, std::int64_t, std::string> value;
  std::string unit{};  ///< of a quantity, SI: "N", "m^3", "s"; "1": a share
};

/// The same without memory of its own, for threads that take none.
struct FieldView {
  std::string_view name;
  std::variant<double, std::int64_t, std::string_view> value;
  std::string_view unit{};
};

/// Longest name, word or unit, bytes; what is longer is cut when it is written.
inline constexpr std::size_t kMaxEventText = 200;
inline constexpr std::size_t kMaxEventFields = 64;

struct EventRecord {
  double time_s = 0;
  std::uint64_t step = 0;  ///< haptic step
  std::string name;        ///< "puncture", "stage", "core"
  std::vector<Field> fields{};

  /// A quantity or a count; none: no such field, no number, not finite.
  std::optional<double> number(std::string_view field) const;
  /// A word; empty: no such field.
  std::string_view text(std::string_view field) const;
  /// Recordings of version 1 have one text in place of fields; who makes an event reads it.
  std::string_view version_1_text() const { return text(kVersion1Field); }

  static constexpr std::string_view kVersion1Field = "detail";
};

/// What the fields say, for a line of text: "force 0.81 N, into liver". Empty without fields.
std::string fields_in_words(const EventRecord& event);

}  // namespace stylet::recording
