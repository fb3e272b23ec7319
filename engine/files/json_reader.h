// A strict reader of Stylet's JSON files: every problem is one line with its place, and what to do about it.
//
//   JsonFile file(path);
//   JsonObject root = file.root(needle_format());
//   needle.length = root.number(kNeedle.length) * 1e-3;
//   root.finish();                    // what no table has and was never asked for is an unknown key
//   file.throw_problems();
//
// Reading goes on after a problem (with a harmless value), so that one pass finds all of them; what must not be
// half-loaded calls throw_problems() before it uses anything. Files of ours have tables of keys (key.h); a reader of
// something else asks by name. The file remembers what was asked for (accepted_keys()): tables are tested against it.
#pragma once

#include "engine/files/error.h"
#include "engine/files/key.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::files {

struct JsonLimits {
  std::size_t bytes = 4u << 20;
  int depth = 64;
  std::size_t values = std::numeric_limits<std::size_t>::max();  ///< roughly: commas and brackets
  bool duplicate_keys = false;                                   ///< allowed
};

class JsonObject;

/// A parsed file and what was found wrong with it.
class JsonFile {
public:
  /// @throws ContentError  missing, not a regular file, too large, nested too deep, syntax, duplicate key, a number
  /// beyond double. These make reading on senseless.
  explicit JsonFile(const std::filesystem::path& path, const JsonLimits& limits = {});
  /// From memory; `path` stands for the file in messages.
  JsonFile(std::filesystem::path path, std::string_view text, const JsonLimits& limits = {});
  ~JsonFile();
  JsonFile(const JsonFile&) = delete;
  JsonFile& operator=(const JsonFile&) = delete;

  /// The root object, its "format" and "version" checked. @throws ContentError when either is wrong: nothing below
  /// could be understood.
  JsonObject root(const FileFormat& format);
  /// The same without a table.
  JsonObject root(std::string_view format, int version);
  /// The root object of a file without format and version (extras, glTF).
  JsonObject root();
  /// The object at a JSON pointer that is known to be there. Unknown pointers and other types abort.
  JsonObject object_at(const std::string& pointer);
  /// What its "format" key says; empty where it has none.
  std::string format() const;
  /// The parsed file itself, for formats with their own rules (glTF).
  const nlohmann::json& tree() const;

  const std::filesystem::path& path() const { return path_; }
  /// Adds "file:pointer: what".
  void add_problem(const std::string& pointer, const std::string& what);
  /// "file:pointer: what", noted nowhere.
  std::string line(const std::string& pointer, const std::string& what) const;
  const std::vector<std::string>& problems() const { return problems_; }
  /// @throws ContentError with the first problem, if there is one.
  void throw_problems() const;
  /// Keys asked for so far, by pointer with array indices and free names as '*': {"/bodies/*", {"name", ...}}.
  const std::map<std::string, std::set<std::string>>& accepted_keys() const { return accepted_; }

private:
  friend class JsonObject;
  std::filesystem::path path_;
  std::unique_ptr<nlohmann::json> json_;
  std::vector<std::string> problems_;
  std::map<std::string, std::set<std::string>> accepted_;
};

/// An object in a JsonFile. Getters with a fallback are for optional keys; without one the key must be there.
/// Every getter notes a problem and returns the fallback (or a value in range) instead of failing.
class JsonObject {
public:
  bool has(std::string_view key);
  double number(const std::string& key, Range range);
  double number(const std::string& key, Range range, double fallback);
  int integer(const std::string& key, int min, int max);
  int integer(const std::string& key, int min, int max, int fallback);
  bool boolean(const std::string& key, bool fallback);
  std::string text(const std::string& key);
  std::string text(const std::string& key, const std::string& fallback);
  /// A text out of a list; the message names the list.
  std::string choice(const std::string& key, const Names& choices, const std::string& fallback);
  std::vector<std::string> texts(const std::string& key, std::vector<std::string> fallback = {});
  /// [x, y, z], every component in range.
  Eigen::Vector3d vector3(const std::string& key, Range range);
  Eigen::Vector3d vector3(const std::string& key, Range range, const Eigen::Vector3d& fallback);
  /// [w, x, y, z], norm 1 within 1e-3; comes out normalised.
  Eigen::Quaterniond quaternion(const std::string& key, const Eigen::Quaterniond& fallback);
  /// `count` numbers.
  std::vector<double> numbers(const std::string& key, std::size_t count, Range range,
                              std::vector<double> fallback = {});
  /// An existing file, resolved against the folder of this file. Empty after a problem.
  std::filesystem::path file(const std::string& key);

  /// A nested object; nothing where it is absent (a problem if required).
  std::optional<JsonObject> object(const std::string& key, bool required = true);
  /// An array of objects.
  std::vector<JsonObject> objects(const std::string& key, bool required = true);
  /// Every value of this object as an object, by its free name (tissues.json).
  std::vector<std::pair<std::string, JsonObject>> entries();
  /// The raw array under `key`, for long tables read by hand; nullptr after a problem or where an optional one is
  /// absent.
  const nlohmann::json* array(const std::string& key, bool required = true);
  /// Accepts `alias` in place of `key`, from now on.
  void alias(const std::string& key, const std::string& alias);
  /// Accepts a key without reading it (comments, sources).
  void ignore(const std::string& key);

  // By a row of a table. Where an optional key is absent: what the row says, or the fallback; a number is NaN and a
  // text or a list empty where there is neither.
  bool has(const Key& key);
  double number(const Key& key);
  double number(const Key& key, double fallback);
  int integer(const Key& key);
  int integer(const Key& key, int fallback);
  bool boolean(const Key& key);
  std::string text(const Key& key);
  std::string text(const Key& key, const std::string& fallback);
  std::string choice(const Key& key);
  std::vector<std::string> texts(const Key& key);
  std::vector<std::string> texts(const Key& key, std::vector<std::string> fallback);
  Eigen::Vector3d vector3(const Key& key);
  Eigen::Vector3d vector3(const Key& key, const Eigen::Vector3d& fallback);
  Eigen::Quaterniond quaternion(const Key& key);
  Eigen::Quaterniond quaternion(const Key& key, const Eigen::Quaterniond& fallback);
  std::vector<double> numbers(const Key& key);
  std::vector<double> numbers(const Key& key, std::vector<double> fallback);
  std::filesystem::path file(const Key& key);
  std::optional<JsonObject> object(const Key& key);
  std::vector<JsonObject> objects(const Key& key);
  const nlohmann::json* array(const Key& key);

  /// Notes a problem at `key` of this object (or at the object, key empty).
  void problem(const std::string& key, const std::string& what);
  void problem(const Key& key, const std::string& what) { problem(std::string(key.name), what); }
  /// Notes every key that is in no table and was never asked for, with the nearest that is.
  void finish();
  /// The same as lines "file:pointer: what", noted nowhere: for readers that may only warn.
  std::vector<std::string> unknown_keys() const;

  const std::string& pointer() const { return pointer_; }

private:
  friend class JsonFile;
  JsonObject(JsonFile& file, const nlohmann::json* value, std::string pointer, std::string pattern);
  const nlohmann::json* find(const std::string& key, bool required);
  /// Its keys are those of `table`; those of the objects under free names those of `entry_table`.
  void use(TableOf table, TableOf entry_table = nullptr);
  /// The key's name, after noting its alias.
  std::string ask(const Key& key);
  std::optional<double> checked_number(const nlohmann::json& value, const std::string& key, Range range);
  /// Calls `found` with the key and what is wrong with it, for every key that was never asked for.
  template <typename Found>
  void each_unknown_key(Found&& found) const;

  JsonFile* file_;
  const nlohmann::json* value_;  ///< nullptr after a problem: every getter returns its fallback in silence
  std::string pointer_;
  std::string pattern_;
  TableOf table_ = nullptr;
  TableOf entry_table_ = nullptr;
  std::set<std::string> asked_;
  std::map<std::string, std::string> aliases_;
};

/// Reads a whole file. @throws ContentError missing, not a regular file, unreadable, larger than `limit` bytes
std::string read_file(const std::filesystem::path& path, std::size_t limit);

/// The name among `names` closest to `word` (one starts with the other, or edit distance at most a third of its
/// length, at least 2), or empty.
std::string nearest(const std::string& word, const std::set<std::string>& names);

}  // namespace stylet::files
