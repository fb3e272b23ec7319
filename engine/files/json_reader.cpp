#include "engine/files/json_reader.h"

#include "engine/files/json_scan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>

namespace stylet::files {
namespace {

using nlohmann::json;

/// A key as a token of a JSON pointer (RFC 6901).
std::string escaped(std::string_view key) {
  std::string out;
  for (const char c : key) {
    if (c == '~') {
      out += "~0";
    } else if (c == '/') {
      out += "~1";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += '?';  // a message is one line
    } else {
      out += c;
    }
  }
  return out;
}

const char* article(const json& value) {
  switch (value.type()) {
    case json::value_t::null:
      return "null";
    case json::value_t::object:
      return "an object";
    case json::value_t::array:
      return "an array";
    case json::value_t::string:
      return "a text";
    case json::value_t::boolean:
      return "a boolean";
    default:
      return "a number";
  }
}

/// Insertions, deletions, replacements and swaps of neighbours (optimal string alignment).
int edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = static_cast<int>(i + j);
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string nearest(const std::string& word, const std::set<std::string>& names) {
  std::string best;
  int best_distance = std::max(2, static_cast<int>(word.size()) / 3) + 1;
  for (const std::string& name : names) {
    if (name.size() > 64 || word.size() > 64) continue;
    // A unit forgotten ("cell" for "cell_mm") or one too many is a near miss however long it is.
    const bool prefix = word.size() > 2 && name.size() > 2 && (name.starts_with(word) || word.starts_with(name));
    const int distance = prefix ? 1 : edit_distance(word, name);
    if (distance < best_distance) {
      best_distance = distance;
      best = name;
    }
  }
  return best;
}

std::string read_file(const std::filesystem::path& path, std::size_t limit) {
  if (path.empty()) throw ContentError("the name of a file is empty; give its path");
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw ContentError(fmt::format("{}: there is no such file; check the path", path.string()));
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw ContentError(fmt::format("{}: this is not a regular file; name a file", path.string()));
  }
  const auto size = std::filesystem::file_size(path, error);
  if (error) throw ContentError(fmt::format("{}: cannot be read: {}", path.string(), error.message()));
  if (size > limit) {
    throw ContentError(fmt::format("{}: {} bytes, the limit is {}; make it smaller", path.string(), size, limit));
  }
  std::ifstream in(path, std::ios::binary);
  std::string text(static_cast<std::size_t>(size), '\0');
  if (!in.read(text.data(), static_cast<std::streamsize>(size))) {
    throw ContentError(fmt::format("{}: cannot be read; check its permissions", path.string()));
  }
  return text;
}

JsonFile::JsonFile(const std::filesystem::path& path, const JsonLimits& limits)
    : JsonFile(path, read_file(path, limits.bytes), limits) {}

JsonFile::JsonFile(std::filesystem::path path, std::string_view text, const JsonLimits& limits)
    : path_(std::move(path)), json_(std::make_unique<json>()) {
  if (text.size() > limits.bytes) {
    throw ContentError(
        fmt::format("{}: {} bytes, the limit is {}; make it smaller", path_.string(), text.size(), limits.bytes));
  }
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    throw ContentError(fmt::format("{}: is empty; copy or export it again", path_.string()));
  }
  if (const auto finding = scan_json(text, limits)) {
    throw ContentError(
        fmt::format("{}:{}: {}", path_.string(), line_and_column(text, finding->offset), finding->what));
  }
  try {
    *json_ = json::parse(text);
  } catch (const json::parse_error& error) {
    // nlohmann: "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error while ... - reason"
    const std::string what = error.what();
    const std::size_t colon = what.find(": ");
    throw ContentError(fmt::format("{}:{}: not valid JSON: {}; correct it there", path_.string(),
                                   line_and_column(text, error.byte == 0 ? 0 : error.byte - 1),
                                   printable(colon == std::string::npos ? what : what.substr(colon + 2), 200)));
  } catch (const json::exception&) {
    throw ContentError(fmt::format("{}: not valid JSON; a number or text in it cannot be held", path_.string()));
  }
}

JsonFile::~JsonFile() = default;

JsonObject JsonFile::object_at(const std::string& pointer) {
  const json& value = json_->at(json::json_pointer(pointer));
  return {*this, &value, pointer, pointer};
}

const json& JsonFile::tree() const {
  return *json_;
}

JsonObject JsonFile::root() {
  if (!json_->is_object()) {
    throw ContentError(
        fmt::format("{}:/: is {}, expected an object; wrap it in {{ }}", path_.string(), article(*json_)));
  }
  return {*this, json_.get(), "", ""};
}

std::string JsonFile::format() const {
  if (!json_->is_object()) return {};
  const auto found = json_->find("format");
  return found != json_->end() && found->is_string() ? found->get<std::string>() : std::string();
}

JsonObject JsonFile::root(const FileFormat& format) {
  JsonObject root = this->root(format.id, format.version);
  root.use(format.table);
  return root;
}

JsonObject JsonFile::root(std::string_view format, int version) {
  JsonObject root = this->root();
  const auto found = json_->find("format");
  if (found == json_->end() || !found->is_string() || found->get_ref<const std::string&>() != format) {
    throw ContentError(fmt::format("{}:/format: {}; a file of this kind has \"format\": \"{}\"", path_.string(),
                                   found == json_->end() ? std::string("is missing")
                                   : found->is_string()
                                       ? fmt::format("is \"{}\"", printable(found->get<std::string>()))
                                       : fmt::format("is {}", article(*found)),
                                   format));
  }
  const auto number = json_->find("version");
  if (number == json_->end() || !number->is_number_integer() || *number != version) {
    throw ContentError(fmt::format(
        "{}:/version: {}; this program reads version {} of {}", path_.string(),
        number == json_->end() ? std::string("is missing") : fmt::format("is {}", printable(number->dump())), version,
        format));
  }
  root.ignore("format");
  root.ignore("version");
  return root;
}

void JsonFile::add_problem(const std::string& pointer, const std::string& what) {
  problems_.push_back(line(pointer, what));
}

std::string JsonFile::line(const std::string& pointer, const std::string& what) const {
  return fmt::format("{}:{}: {}", path_.string(), pointer.empty() ? "/" : one_line(pointer), one_line(what));
}

void JsonFile::throw_problems() const {
  if (!problems_.empty()) throw ContentError(problems_.front());
}

JsonObject::JsonObject(JsonFile& file, const json* value, std::string pointer, std::string pattern)
    : file_(&file), value_(value), pointer_(std::move(pointer)), pattern_(std::move(pattern)) {
  file_->accepted_[pattern_];
}

void JsonObject::problem(const std::string& key, const std::string& what) {
  file_->add_problem(key.empty() ? pointer_ : pointer_ + "/" + escaped(key), what);
}

void JsonObject::ignore(const std::string& key) {
  asked_.insert(key);
  file_->accepted_[pattern_].insert(key);
}

void JsonObject::alias(const std::string& key, const std::string& alias) {
  aliases_[key] = alias;
}

const json* JsonObject::find(const std::string& key, bool required) {
  ignore(key);
  if (value_ == nullptr) return nullptr;
  auto found = value_->find(key);
  if (const auto other = aliases_.find(key); other != aliases_.end()) {
    asked_.insert(other->second);
    if (found == value_->end()) found = value_->find(other->second);
  }
  if (found != value_->end()) return &*found;
  if (required) problem(key, "is missing; add it");
  return nullptr;
}

bool JsonObject::has(std::string_view key) {
  if (value_ == nullptr) return false;
  if (value_->contains(key)) return true;
  const auto other = aliases_.find(std::string(key));
  return other != aliases_.end() && value_->contains(other->second);
}

std::optional<double> JsonObject::checked_number(const json& value, const std::string& key, Range range) {
  if (!value.is_number()) {
    problem(key, fmt::format("is {}, expected a number", article(value)));
    return std::nullopt;
  }
  const double number = value.get<double>();
  if (!std::isfinite(number)) {
    problem(key, "is not finite; write a finite number");
    return std::nullopt;
  }
  if (number < range.min || number > range.max) {
    const std::string accepted = range.max == Range{}.max   ? fmt::format("{:g} or more", range.min)
                                 : range.min == Range{}.min ? fmt::format("{:g} or less", range.max)
                                                            : fmt::format("{:g} to {:g}", range.min, range.max);
    problem(key, fmt::format("is {:g}, accepted is {}", number, accepted));
    return std::nullopt;
  }
  return number;
}

double JsonObject::number(const std::string& key, Range range) {
  const json* value = find(key, true);
  return value == nullptr ? range.min : checked_number(*value, key, range).value_or(range.min);
}

double JsonObject::number(const std::string& key, Range range, double fallback) {
  const json* value = find(key, false);
  return value == nullptr ? fallback : checked_number(*value, key, range).value_or(fallback);
}

int JsonObject::integer(const std::string& key, int min, int max) {
  const json* value = find(key, true);
  return value == nullptr ? min : integer(key, min, max, min);
}

int JsonObject::integer(const std::string& key, int min, int max, int fallback) {
  const json* value = find(key, false);
  if (value == nullptr) return fallback;
  const auto number = checked_number(*value, key, {static_cast<double>(min), static_cast<double>(max)});
  if (!number) return fallback;
  if (*number != std::floor(*number)) {
    problem(key, fmt::format("is {:g}, expected a whole number", *number));
    return fallback;
  }
  return static_cast<int>(*number);
}

bool JsonObject::boolean(const std::string& key, bool fallback) {
  const json* value = find(key, false);
  if (value == nullptr) return fallback;
  if (value->is_boolean()) return value->get<bool>();
  problem(key, fmt::format("is {}, expected true or false", article(*value)));
  return fallback;
}

std::string JsonObject::text(const std::string& key) {
  const json* value = find(key, true);
  return value == nullptr ? std::string() : text(key, std::string());
}

std::string JsonObject::text(const std::string& key, const std::string& fallback) {
  const json* value = find(key, false);
  if (value == nullptr) return fallback;
  if (value->is_string()) return value->get<std::string>();
  problem(key, fmt::format("is {}, expected a text", article(*value)));
  return fallback;
}

std::string JsonObject::choice(const std::string& key, const Names& choices, const std::string& fallback) {
  const std::size_t before = file_->problems().size();
  const std::string chosen = text(key, fallback);
  if (file_->problems().size() > before || chosen == fallback) return fallback;
  if (std::find(choices.begin(), choices.end(), chosen) != choices.end()) return chosen;
  problem(key, fmt::format("is \"{}\", accepted is one of: {}", printable(chosen), fmt::join(choices, ", ")));
  return fallback;
}

std::vector<std::string> JsonObject::texts(const std::string& key, std::vector<std::string> fallback) {
  const json* value = array(key, false);
  if (value == nullptr) return fallback;
  std::vector<std::string> out;
  for (std::size_t i = 0; i < value->size(); ++i) {
    if ((*value)[i].is_string()) {
      out.push_back((*value)[i].get<std::string>());
    } else {
      file_->add_problem(fmt::format("{}/{}/{}", pointer_, escaped(key), i),
                         fmt::format("is {}, expected a text", article((*value)[i])));
    }
  }
  return out;
}

std::vector<double> JsonObject::numbers(const std::string& key, std::size_t count, Range range,
                                        std::vector<double> fallback) {
  const json* value = find(key, false);
  if (value == nullptr) return fallback;
  if (!value->is_array() || value->size() != count) {
    problem(key,
            fmt::format("is {}, expected an array of {} numbers",
                        value->is_array() ? fmt::format("an array of {}", value->size()) : article(*value), count));
    return fallback;
  }
  std::vector<double> out;
  JsonObject place(*file_, value_, pointer_ + "/" + escaped(key), pattern_);  // for the pointer only
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = place.checked_number((*value)[i], std::to_string(i), range);
    if (number) out.push_back(*number);
  }
  return out.size() == count ? out : fallback;
}

Eigen::Vector3d JsonObject::vector3(const std::string& key, Range range, const Eigen::Vector3d& fallback) {
  const auto values = numbers(key, 3, range);
  return values.size() == 3 ? Eigen::Vector3d(values[0], values[1], values[2]) : fallback;
}

Eigen::Vector3d JsonObject::vector3(const std::string& key, Range range) {
  return find(key, true) == nullptr ? Eigen::Vector3d::Zero() : vector3(key, range, Eigen::Vector3d::Zero());
}

Eigen::Quaterniond JsonObject::quaternion(const std::string& key, const Eigen::Quaterniond& fallback) {
  const auto values = numbers(key, 4, {-1.001, 1.001});
  if (values.size() != 4) return fallback;
  const Eigen::Quaterniond q(values[0], values[1], values[2], values[3]);
  if (std::abs(q.norm() - 1) > 1e-3) {
    problem(key, fmt::format("has norm {:.4g}, expected a unit quaternion [w, x, y, z]", q.norm()));
    return fallback;
  }
  return q.normalized();
}

std::filesystem::path JsonObject::file(const std::string& key) {
  const std::size_t before = file_->problems().size();
  const std::string name = text(key);
  if (file_->problems().size() > before) return {};
  if (name.empty() || name.find('\0') != std::string::npos) {
    problem(key, "is not a file name; write a path relative to this file");
    return {};
  }
  const std::filesystem::path path = (file_->path().parent_path() / name).lexically_normal();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    problem(key, fmt::format("there is no file {}; correct the path, it is relative to this file", printable(name)));
    return {};
  }
  return path;
}

std::optional<JsonObject> JsonObject::object(const std::string& key, bool required) {
  const json* value = find(key, required);
  if (value == nullptr) return std::nullopt;
  if (!value->is_object()) {
    problem(key, fmt::format("is {}, expected an object", article(*value)));
    return std::nullopt;
  }
  return JsonObject(*file_, value, pointer_ + "/" + escaped(key), pattern_ + "/" + key);
}

const json* JsonObject::array(const std::string& key, bool required) {
  const json* value = find(key, required);
  if (value == nullptr || value->is_array()) return value;
  problem(key, fmt::format("is {}, expected an array", article(*value)));
  return nullptr;
}

std::vector<JsonObject> JsonObject::objects(const std::string& key, bool required) {
  std::vector<JsonObject> out;
  const json* value = array(key, required);
  if (value == nullptr) return out;
  for (std::size_t i = 0; i < value->size(); ++i) {
    const std::string pointer = fmt::format("{}/{}/{}", pointer_, escaped(key), i);
    if ((*value)[i].is_object()) {
      out.push_back(JsonObject(*file_, &(*value)[i], pointer, pattern_ + "/" + key + "/*"));
    } else {
      file_->add_problem(pointer, fmt::format("is {}, expected an object", article((*value)[i])));
    }
  }
  return out;
}

std::vector<std::pair<std::string, JsonObject>> JsonObject::entries() {
  std::vector<std::pair<std::string, JsonObject>> out;
  if (value_ == nullptr) return out;
  for (const auto& [key, value] : value_->items()) {
    asked_.insert(key);
    if (value.is_object()) {
      JsonObject entry(*file_, &value, pointer_ + "/" + escaped(key), pattern_ + "/*");
      entry.use(entry_table_);
      out.emplace_back(key, std::move(entry));
    } else {
      problem(key, fmt::format("is {}, expected an object", article(value)));
    }
  }
  return out;
}

void JsonObject::use(TableOf table, TableOf entry_table) {
  table_ = table;
  entry_table_ = entry_table;
  if (table == nullptr) return;
  table().each([this](const Key& key, std::string_view) {
    if (key.type == KeyType::note) ignore(std::string(key.name));
  });
}

std::string JsonObject::ask(const Key& key) {
  std::string name(key.name);
  if (!key.alias.empty()) alias(name, std::string(key.alias));
  return name;
}

bool JsonObject::has(const Key& key) {
  return has(ask(key));
}

double JsonObject::number(const Key& key) {
  if (key.required) return number(ask(key), key.range);
  return number(key, key.number_count > 0 ? key.numbers[0] : std::numeric_limits<double>::quiet_NaN());
}

double JsonObject::number(const Key& key, double fallback) {
  return number(ask(key), key.range, fallback);
}

int JsonObject::integer(const Key& key) {
  const auto min = static_cast<int>(key.range.min);
  if (key.required) return integer(ask(key), min, static_cast<int>(key.range.max));
  return integer(key, key.number_count > 0 ? static_cast<int>(key.numbers[0]) : min);
}

int JsonObject::integer(const Key& key, int fallback) {
  return integer(ask(key), static_cast<int>(key.range.min), static_cast<int>(key.range.max), fallback);
}

bool JsonObject::boolean(const Key& key) {
  return boolean(ask(key), key.numbers[0] != 0);
}

std::string JsonObject::text(const Key& key) {
  return key.required ? text(ask(key)) : text(key, std::string(key.words));
}

std::string JsonObject::text(const Key& key, const std::string& fallback) {
  return text(ask(key), fallback);
}

std::string JsonObject::choice(const Key& key) {
  return choice(ask(key), key.choices(), std::string(key.words));
}

std::vector<std::string> JsonObject::texts(const Key& key) {
  if (key.required) find(ask(key), true);
  return texts(ask(key));
}

std::vector<std::string> JsonObject::texts(const Key& key, std::vector<std::string> fallback) {
  return texts(ask(key), std::move(fallback));
}

Eigen::Vector3d JsonObject::vector3(const Key& key) {
  if (key.required) return vector3(ask(key), key.range);
  return vector3(key, {key.numbers[0], key.numbers[1], key.numbers[2]});
}

Eigen::Vector3d JsonObject::vector3(const Key& key, const Eigen::Vector3d& fallback) {
  return vector3(ask(key), key.range, fallback);
}

Eigen::Quaterniond JsonObject::quaternion(const Key& key) {
  const auto& q = key.numbers;
  return quaternion(key, {q[0], q[1], q[2], q[3]});
}

Eigen::Quaterniond JsonObject::quaternion(const Key& key, const Eigen::Quaterniond& fallback) {
  return quaternion(ask(key), fallback);
}

std::vector<double> JsonObject::numbers(const Key& key) {
  if (key.required) find(ask(key), true);
  return numbers(key, {key.numbers.begin(), key.numbers.begin() + static_cast<int>(key.number_count)});
}

std::vector<double> JsonObject::numbers(const Key& key, std::vector<double> fallback) {
  return numbers(ask(key), static_cast<std::size_t>(key.items.max), key.range, std::move(fallback));
}

std::filesystem::path JsonObject::file(const Key& key) {
  return file(ask(key));
}

std::optional<JsonObject> JsonObject::object(const Key& key) {
  std::optional<JsonObject> found = object(ask(key), key.required);
  if (!found) return found;
  if (key.type == KeyType::entries) {
    found->use(nullptr, key.table);
  } else {
    found->use(key.table);
  }
  return found;
}

std::vector<JsonObject> JsonObject::objects(const Key& key) {
  std::vector<JsonObject> found = objects(ask(key), key.required);
  for (JsonObject& object : found) object.use(key.table);
  return found;
}

const json* JsonObject::array(const Key& key) {
  return array(ask(key), key.required);
}

template <typename Found>
void JsonObject::each_unknown_key(Found&& found) const {
  if (value_ == nullptr) return;
  std::set<std::string> known = asked_;
  if (table_ != nullptr) {
    table_().each([&](const Key& key, std::string_view) { known.emplace(key.name); });
  }
  for (const auto& [name, value] : value_->items()) {
    if (known.contains(name)) continue;
    const std::string key = printable(name);
    const std::string close = nearest(key, known);
    found(key, close.empty() ? fmt::format("is not a known key; remove it (known: {})", fmt::join(known, ", "))
                             : fmt::format("is not a known key; did you mean \"{}\"?", close));
  }
}

std::vector<std::string> JsonObject::unknown_keys() const {
  std::vector<std::string> lines;
  each_unknown_key([&](const std::string& key, const std::string& what) {
    lines.push_back(file_->line(pointer_ + "/" + escaped(key), what));
  });
  return lines;
}

void JsonObject::finish() {
  each_unknown_key([&](const std::string& key, const std::string& what) { problem(key, what); });
}

}  // namespace stylet::files
