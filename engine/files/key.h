// The keys of an object in a file, each written once, next to where it is read: name, type, unit, range, default and
// meaning. The reader asks with them; schemas, the tables of content/README.md and `stylet schema` are made of them.
//
//   constexpr struct {
//     Key name = key::text("name", "shown to the user");
//     Key length = key::number("length_mm", "mm", {20, 400}, "hub to tip");
//     Key beams = key::integer("beams", {1, 64}, "beam elements from hub to tip").otherwise(8);
//   } kNeedle;
//
//   needle.length = root.number(kNeedle.length) * 1e-3;
//
// A struct of nothing but keys is a table (table_of<kNeedle>); a key that holds an object names the table of that.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <type_traits>
#include <vector>

namespace stylet::files {

/// Accepted values of a number, both ends included.
struct Range {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
};

struct KeyTable;
/// Tables and lists of names come from functions, for some are put together at run time.
using TableOf = const KeyTable& (*)();
using Names = std::vector<std::string_view>;
using NamesOf = Names (*)();

/// A text as an argument of a template.
template <std::size_t n>
struct Literal {
  char text[n];
  // NOLINTNEXTLINE(google-explicit-constructor): it is written as the text
  constexpr Literal(const char (&literal)[n]) { std::copy_n(literal, n, text); }
};

/// The choices that are written there: one_of<"convex", "linear">.
template <Literal... literals>
Names one_of() {
  return {std::string_view(literals.text)...};
}

enum class KeyType : std::uint8_t {
  number,
  integer,
  boolean,
  text,
  choice,   ///< a text out of a list
  file,     ///< a path relative to the file that names it
  numbers,  ///< as many as `items` says
  vector,   ///< [x, y, z]
  quaternion,
  texts,
  object,
  objects,  ///< a list of them
  entries,  ///< objects by free names
  rows,     ///< a list of short lists of numbers
  note,     ///< for people; not read
};

/// How many of something, both ends included; max below 0: any number.
struct Count {
  int min = 0;
  int max = -1;
};

struct Key {
  std::string_view name{};
  KeyType type = KeyType::note;
  std::string_view unit{};  ///< "mm", "N/m"; empty: none
  Range range{};            ///< of each number
  std::string_view help{};  ///< what it means; one line

  bool required = true;
  bool alternative = false;         ///< of the alternatives in a table exactly one is there
  std::array<double, 4> numbers{};  ///< default of numbers, in `unit`; true is 1
  std::size_t number_count = 0;     ///< 0: no default
  std::string_view words{};         ///< default of texts

  Count items{};             ///< of a list
  Count row{};               ///< numbers in a row
  NamesOf choices{};         ///< of a choice
  TableOf table{};           ///< of an object, of each object
  std::string_view alias{};  ///< another name that is read where this one is absent
  std::string_view also{};   ///< what the JSON schema says of it besides, as JSON

  /// It may be absent; `help` says what then.
  constexpr Key optional() const {
    Key key = *this;
    key.required = false;
    return key;
  }
  /// It may be absent and is this then.
  template <typename... T>
  requires(std::is_arithmetic_v<T>&&...) constexpr Key otherwise(T... values) const {
    Key key = optional();
    key.numbers = {static_cast<double>(values)...};
    key.number_count = sizeof...(T);
    return key;
  }
  constexpr Key otherwise(std::string_view text) const {
    Key key = optional();
    key.words = text;
    return key;
  }
  constexpr Key either() const {
    Key key = optional();
    key.alternative = true;
    return key;
  }
  constexpr Key count(Count count) const {
    Key key = *this;
    key.items = count;
    return key;
  }
  constexpr Key known_as(std::string_view other) const {
    Key key = *this;
    key.alias = other;
    return key;
  }
  constexpr Key schema(std::string_view json) const {
    Key key = *this;
    key.also = json;
    return key;
  }
};

/// The keys that an object has.
struct KeyTable {
  /// Further keys of an object whose choice `by` has a value; required means: with that value.
  struct Variant {
    std::string_view value;
    std::vector<Key> keys;
  };
  std::vector<Key> keys;
  std::string_view by{};
  std::vector<Variant> variants{};

  /// Every key, also of all variants, with the value of `by` that it belongs to (empty: to all).
  template <typename Each>
  void each(const Each& each) const {
    for (const Key& key : keys) each(key, std::string_view());
    for (const Variant& variant : variants) {
      for (const Key& key : variant.keys) each(key, variant.value);
    }
  }
};

/// A kind of file.
struct FileFormat {
  std::string_view name;   ///< "needle", of content/schemas/needle.schema.json
  std::string_view title;  ///< one line
  TableOf table;           ///< of the root object, without "format" and "version"
  std::string_view id;     ///< its "format": "stylet-needle"
  int version = 1;
};

/// The keys of a struct that has nothing else, in order.
template <typename Keys>
std::vector<Key> keys_of(const Keys& keys) {
  const auto all = std::bit_cast<std::array<Key, sizeof(Keys) / sizeof(Key)>>(keys);
  return {all.begin(), all.end()};
}

template <const auto& keys>
const KeyTable& table_of() {
  static const KeyTable table{.keys = keys_of(keys)};
  return table;
}

namespace key {

constexpr Key number(std::string_view name, std::string_view unit, Range range, std::string_view help) {
  return {.name = name, .type = KeyType::number, .unit = unit, .range = range, .help = help};
}
constexpr Key integer(std::string_view name, Range range, std::string_view help) {
  return {.name = name, .type = KeyType::integer, .range = range, .help = help};
}
constexpr Key boolean(std::string_view name, std::string_view help) {
  return Key{.name = name, .type = KeyType::boolean, .help = help}.optional();
}
constexpr Key text(std::string_view name, std::string_view help) {
  return {.name = name, .type = KeyType::text, .help = help};
}
constexpr Key choice(std::string_view name, NamesOf choices, std::string_view help) {
  return {.name = name, .type = KeyType::choice, .help = help, .choices = choices};
}
constexpr Key file(std::string_view name, std::string_view help) {
  return {.name = name, .type = KeyType::file, .help = help};
}
constexpr Key numbers(std::string_view name, int count, std::string_view unit, Range range, std::string_view help) {
  return {
      .name = name, .type = KeyType::numbers, .unit = unit, .range = range, .help = help, .items = {count, count}};
}
constexpr Key vector(std::string_view name, std::string_view unit, Range range, std::string_view help) {
  return {.name = name, .type = KeyType::vector, .unit = unit, .range = range, .help = help, .items = {3, 3}};
}
/// [w, x, y, z]
constexpr Key quaternion(std::string_view name, std::string_view help) {
  return {.name = name, .type = KeyType::quaternion, .range = {-1.001, 1.001}, .help = help, .items = {4, 4}};
}
constexpr Key texts(std::string_view name, std::string_view help) {
  return {.name = name, .type = KeyType::texts, .help = help};
}
constexpr Key object(std::string_view name, TableOf table, std::string_view help) {
  return {.name = name, .type = KeyType::object, .help = help, .table = table};
}
constexpr Key objects(std::string_view name, TableOf table, std::string_view help) {
  return {.name = name, .type = KeyType::objects, .help = help, .table = table};
}
constexpr Key entries(std::string_view name, TableOf table, std::string_view help) {
  return {.name = name, .type = KeyType::entries, .help = help, .table = table};
}
constexpr Key rows(std::string_view name, Count row, Range range, std::string_view help) {
  return {.name = name, .type = KeyType::rows, .range = range, .help = help, .row = row};
}
constexpr Key note(std::string_view name, std::string_view help) {
  return Key{.name = name, .type = KeyType::note, .help = help}.optional();
}

// Of most files.
inline constexpr Key kLicence = note("licence", "SPDX name of the licence");
inline constexpr Key kSource = note("source", "where the numbers come from");

}  // namespace key
}  // namespace stylet::files
