#include "engine/files/key_tables.h"

#include "engine/files/error.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>

namespace stylet::files {
namespace {

using Json = nlohmann::ordered_json;

constexpr Range kAny{};

/// Whole numbers without a point.
Json plain(double number) {
  if (number == std::floor(number) && std::abs(number) < 1e15) return static_cast<std::int64_t>(number);
  return number;
}

/// What it is where it is absent, as a file would say it; empty: nothing that could be said so.
std::string fallback(const Key& key) {
  if (key.type == KeyType::boolean && key.number_count > 0) return key.numbers[0] != 0 ? "true" : "false";
  if (key.number_count == 1) return fmt::format("{:.4g}", key.numbers[0]);
  if (key.number_count > 1) {
    return fmt::format(
        "[{:g}]", fmt::join(key.numbers.begin(), key.numbers.begin() + static_cast<int>(key.number_count), ", "));
  }
  return std::string(key.words);
}

// ---- JSON schema

Json object_schema(const KeyTable& table);

void limit_items(Json& out, Count count) {
  if (count.min > 0) out["minItems"] = count.min;
  if (count.max >= 0) out["maxItems"] = count.max;
}

Json number_schema(const char* type, Range range) {
  Json out;
  out["type"] = type;
  if (range.min != kAny.min) out["minimum"] = plain(range.min);
  if (range.max != kAny.max) out["maximum"] = plain(range.max);
  return out;
}

Json list_schema(Count count, Json items) {
  Json out;
  out["type"] = "array";
  limit_items(out, count);
  out["items"] = std::move(items);
  return out;
}

Json value_schema(const Key& key) {
  switch (key.type) {
    case KeyType::number:
      return number_schema("number", key.range);
    case KeyType::integer:
      return number_schema("integer", key.range);
    case KeyType::boolean:
      return {{"type", "boolean"}};
    case KeyType::choice:
      return {{"enum", key.choices()}};
    case KeyType::numbers:
    case KeyType::vector:
    case KeyType::quaternion:
      return list_schema(key.items, number_schema("number", key.range));
    case KeyType::texts:
      return list_schema(key.items, {{"type", "string"}});
    case KeyType::object:
      return object_schema(key.table());
    case KeyType::objects:
      return list_schema(key.items, object_schema(key.table()));
    case KeyType::entries:
      return {{"type", "object"}, {"additionalProperties", object_schema(key.table())}};
    case KeyType::rows:
      return list_schema(key.items, list_schema(key.row, number_schema("number", key.range)));
    case KeyType::text:
    case KeyType::file:
    case KeyType::note:
      break;
  }
  return {{"type", "string"}};
}

std::string description(const Key& key, std::string_view variant) {
  std::string text = variant.empty() ? std::string(key.help) : fmt::format("{}: {}", variant, key.help);
  if (!key.unit.empty()) text += fmt::format("; {}", key.unit);
  if (const std::string value = fallback(key); !value.empty()) text += fmt::format("; default {}", value);
  return text;
}

Json key_schema(const Key& key, std::string_view variant) {
  Json out{{"description", description(key, variant)}};
  out.update(value_schema(key));
  if (!key.also.empty()) out.merge_patch(Json::parse(key.also));
  return out;
}

Json object_schema(const KeyTable& table) {
  Json properties = Json::object();
  Json required = Json::array();
  Json alternatives = Json::array();
  table.each([&](const Key& key, std::string_view variant) {
    properties[std::string(key.name)] = key_schema(key, variant);
    if (key.required && variant.empty()) required.push_back(key.name);
    if (key.alternative) alternatives.push_back({{"required", {key.name}}});
  });
  Json out{{"type", "object"}, {"properties", properties}, {"required", required}, {"additionalProperties", false}};
  if (!alternatives.empty()) out["oneOf"] = alternatives;
  return out;
}

// ---- tables for people

std::string counted(Count count, std::string_view what) {
  if (count.max >= 0 && count.min == count.max) return fmt::format("{} {}", count.min, what);
  if (count.max >= 0) return fmt::format("{} to {} {}", count.min, count.max, what);
  if (count.min > 0) return fmt::format("{} or more {}", count.min, what);
  return std::string(what);
}

/// " 20 to 400 mm"
std::string range_and_unit(const Key& key) {
  std::string text;
  if (key.range.min != kAny.min && key.range.max != kAny.max) {
    text = fmt::format(" {:.10g} to {:.10g}", key.range.min, key.range.max);
  } else if (key.range.min != kAny.min) {
    text = fmt::format(" {:.10g} or more", key.range.min);
  } else if (key.range.max != kAny.max) {
    text = fmt::format(" {:.10g} or less", key.range.max);
  }
  if (!key.unit.empty()) text += fmt::format(" {}", key.unit);
  return text;
}

std::string type_text(const Key& key) {
  switch (key.type) {
    case KeyType::number:
      return "number" + range_and_unit(key);
    case KeyType::integer:
      return "whole number" + range_and_unit(key);
    case KeyType::boolean:
      return "true or false";
    case KeyType::choice: {
      Names names = key.choices();
      std::erase(names, "");
      return fmt::format("{}", fmt::join(names, ", "));
    }
    case KeyType::numbers:
      return counted(key.items, "numbers") + range_and_unit(key);
    case KeyType::vector:
      return "[x, y, z]" + range_and_unit(key);
    case KeyType::quaternion:
      return "[w, x, y, z]";
    case KeyType::texts:
      return "list of " + counted(key.items, "texts");
    case KeyType::object:
      return "object";
    case KeyType::objects:
      return "list of " + counted(key.items, "objects");
    case KeyType::entries:
      return "objects by name";
    case KeyType::rows:
      return "list of " + counted(key.items, "rows");
    case KeyType::file:
      return "file";
    case KeyType::note:
      return "not read";
    case KeyType::text:
      break;
  }
  return "text";
}

std::string value_text(const Key& key) {
  std::string text = type_text(key);
  if (key.alternative) return text + "; alternative";
  if (key.required) return text;
  const std::string value = fallback(key);
  return text + (value.empty() ? "; optional" : "; default " + value);
}

std::string meaning(const Key& key, std::string_view variant) {
  std::string text = variant.empty() ? std::string(key.help) : fmt::format("{}: {}", variant, key.help);
  if (!key.alias.empty()) text += fmt::format("; also {}", key.alias);
  return text;
}

/// What stands between a key of objects and the keys of these.
const char* step(KeyType type) {
  return type == KeyType::object ? "." : type == KeyType::objects ? "[]." : ".NAME.";
}

using Row = std::function<void(const std::string& path, int depth, const Key& key, std::string_view variant)>;

void walk(const KeyTable& table, const std::string& path, int depth, const Row& row) {
  table.each([&](const Key& key, std::string_view variant) {
    const std::string name = path + std::string(key.name);
    row(name, depth, key, variant);
    if (key.table != nullptr) walk(key.table(), name + step(key.type), depth + 1, row);
  });
}

std::string with_bars_escaped(const std::string& cell) {
  std::string out;
  for (const char c : cell) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

}  // namespace

std::string json_schema(const FileFormat& format) {
  Json out{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", format.title}};
  Json root = object_schema(format.table());
  Json properties{{"format", {{"const", format.id}}}, {"version", {{"const", format.version}}}};
  properties.update(root["properties"]);
  Json required{"format", "version"};
  required.insert(required.end(), root["required"].begin(), root["required"].end());
  root["properties"] = properties;
  root["required"] = required;
  out.update(root);
  return out.dump(2) + "\n";
}

std::string markdown_table(const std::vector<std::string>& header,
                           const std::vector<std::vector<std::string>>& rows) {
  std::string out = fmt::format("| {} |\n|", fmt::join(header, " | "));
  for (std::size_t i = 0; i < header.size(); ++i) out += "---|";
  out += "\n";
  for (std::vector<std::string> row : rows) {
    std::ranges::transform(row, row.begin(), with_bars_escaped);
    out += fmt::format("| {} |\n", fmt::join(row, " | "));
  }
  return out;
}

std::string markdown_table(const FileFormat& format) {
  std::vector<std::vector<std::string>> rows;
  walk(format.table(), "", 0, [&](const std::string& path, int, const Key& key, std::string_view variant) {
    rows.push_back({fmt::format("`{}`", path), value_text(key), meaning(key, variant)});
  });
  return markdown_table({"key", "value", "meaning"}, rows);
}

std::string plain_table(const FileFormat& format) {
  std::vector<std::vector<std::string>> rows{{"  format", format.id.data(), ""},
                                             {"  version", std::to_string(format.version), ""}};
  walk(format.table(), "", 0, [&](const std::string&, int depth, const Key& key, std::string_view variant) {
    rows.push_back({std::string(static_cast<std::size_t>(2 + 2 * depth), ' ') + std::string(key.name),
                    value_text(key), meaning(key, variant)});
  });
  return fmt::format("{} {}: {}\n\n{}", format.id, format.version, format.title, columns(rows));
}

std::string columns(const std::vector<std::vector<std::string>>& rows) {
  constexpr std::size_t kWidest = 44;  // a longer cell pushes the rest of its row
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::min(kWidest, std::max(widths[i], row[i].size()));
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}  ", row[i], widths[i]);
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

std::string with_generated(std::string page, std::string_view name, std::string_view text) {
  const std::string begin = fmt::format("<!-- stylet schema {} -->\n", name);
  const std::size_t from = page.find(begin);
  const std::size_t to = from == std::string::npos ? from : page.find("<!-- end -->", from);
  if (to == std::string::npos) {
    throw ContentError(fmt::format("the page has no lines {}and <!-- end -->; add them", begin));
  }
  return page.replace(from + begin.size(), to - from - begin.size(), text);
}

}  // namespace stylet::files
