// Files that are wrong, or just odd, in the ways their table of keys allows: what an author's slip makes of a sound
// one.
#pragma once

#include "engine/files/key.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::support {

/// Changes JSON objects key by key: absent keys come, others go or get values from the ends of their ranges, the
/// wrong type, names that are not there, lists of none, one and many. Same seed, same changes.
class KeyMutation {
public:
  using Json = nlohmann::ordered_json;

  /// @param names  texts of the files, which one key may take from another
  KeyMutation(std::uint32_t seed, std::vector<std::string> names) : random_(seed), names_(std::move(names)) {}

  /// One key somewhere in `object`. @return what was done, for the log: "/probe/gel = 3"
  std::string change(Json& object, const files::KeyTable& table) {
    std::vector<Place> places;
    collect(object, table, "", places);
    const Place& place = places[pick(places.size())];
    const std::string name(place.key->name);
    if (place.object->contains(name) && one_in(5)) {
      place.object->erase(name);
      return place.pointer + " is gone";
    }
    Json made = other_value(*place.key, place.object->contains(name) ? (*place.object)[name] : Json());
    std::string what =
        place.pointer + " = " + made.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 200);
    (*place.object)[name] = std::move(made);
    return what;
  }

  /// Every key of `object` once, whatever lists it is in, with every odd value it can have: each as a change of its
  /// own.
  /// @param each  gets the changed object and what was done
  template <typename Each>
  static void sweep(const Json& object, const files::KeyTable& table, const Each& each) {
    Json whole = object;
    std::vector<Place> places;
    collect(whole, table, "", places);
    std::set<const files::Key*> seen;
    for (const Place& place : places) {
      if (!seen.insert(place.key).second) continue;
      const std::string name(place.key->name);
      const Json::json_pointer parent(place.pointer.substr(0, place.pointer.size() - name.size() - 1));
      const auto with = [&](const auto& edit, const std::string& what) {
        Json changed = object;
        edit(changed[parent]);
        each(changed, place.pointer + what);
      };
      if (place.object->contains(name)) with([&](Json& at) { at.erase(name); }, " is gone");
      for (const Json& value : odd_values(*place.key))
        with([&](Json& at) { at[name] = value; }, " = " + shown(value));
    }
  }

  std::size_t pick(std::size_t n) { return n == 0 ? 0 : random_() % n; }
  bool one_in(std::size_t n) { return pick(n) == 0; }

private:
  struct Place {
    Json* object;
    const files::Key* key;
    std::string pointer;
  };

  static std::string shown(const Json& value) {
    return value.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 200);
  }

  /// Where a slip is most likely to get through: what is empty, and the ends of what is accepted.
  static std::vector<Json> odd_values(const files::Key& key) {
    const double from = std::max(key.range.min, -1e9), to = std::min(key.range.max, 1e9);
    const auto ends = [&](int count) {
      std::vector<Json> out;
      for (const double end : {from, to, std::clamp(0.0, from, to)}) {
        out.emplace_back(std::vector<double>(static_cast<std::size_t>(std::max(1, count)), end));
      }
      return out;
    };
    switch (key.type) {
      case files::KeyType::number:
      case files::KeyType::integer:
        return {from, to, std::clamp(0.0, from, to)};
      case files::KeyType::boolean:
        return {true, false};
      case files::KeyType::choice: {
        std::vector<Json> out{""};
        for (const std::string_view choice : key.choices()) out.emplace_back(choice);
        return out;
      }
      case files::KeyType::numbers:
      case files::KeyType::vector:
      case files::KeyType::quaternion:
        return ends(key.items.min);
      case files::KeyType::rows: {
        std::vector<Json> out{Json::array()};
        for (const Json& row : ends(key.row.min)) out.push_back(Json::array({row}));
        return out;
      }
      case files::KeyType::texts:
        return {Json::array(), Json::array({""}), Json::array({"no_such_name", "no_such_name"})};
      case files::KeyType::objects:
        return {Json::array(), Json::array({Json::object()})};
      case files::KeyType::object:
      case files::KeyType::entries:
        return {Json::object()};
      case files::KeyType::text:
      case files::KeyType::file:
      case files::KeyType::note:
        break;
    }
    return {"", " ", "no_such_name", "\x1b[31m\nred"};
  }

  /// Every key that an object in there has or could have.
  static void collect(Json& object, const files::KeyTable& table, const std::string& at, std::vector<Place>& places) {
    if (!object.is_object()) return;
    const auto visit = [&](const files::Key& key) {
      const std::string name(key.name);
      const std::string pointer = at + "/" + name;
      places.push_back({&object, &key, pointer});
      if (key.table == nullptr || !object.contains(name)) return;
      Json& value = object[name];
      if (key.type == files::KeyType::object) collect(value, key.table(), pointer, places);
      if (!value.is_structured() || key.type == files::KeyType::object) return;
      for (auto& [item, inner] : value.items()) collect(inner, key.table(), pointer + "/" + item, places);
    };
    for (const files::Key& key : table.keys) visit(key);
    for (const auto& variant : table.variants) {
      for (const files::Key& key : variant.keys) visit(key);
    }
  }

  Json other_value(const files::Key& key, const Json& now) {
    if (one_in(12)) return wrong_type();
    switch (key.type) {
      case files::KeyType::number:
        return number(key.range);
      case files::KeyType::integer:
        return one_in(6) ? Json(number(key.range)) : Json(std::floor(number(key.range)));
      case files::KeyType::boolean:
        return one_in(2);
      case files::KeyType::choice: {
        const files::Names choices = key.choices();
        return one_in(6) || choices.empty() ? Json(text()) : Json(choices[pick(choices.size())]);
      }
      case files::KeyType::numbers:
      case files::KeyType::vector:
      case files::KeyType::quaternion:
        return numbers(key, now);
      case files::KeyType::rows:
        return rows(key, now);
      case files::KeyType::texts:
        return list(now, [&] { return Json(text()); });
      case files::KeyType::objects:
        return list(now, [&] { return object(key.table(), 0); });
      case files::KeyType::object:
        return one_in(8) ? Json::object() : object(key.table(), 0);
      case files::KeyType::entries: {
        Json made = now.is_object() ? now : Json::object();
        made[text()] = object(key.table(), 0);
        return made;
      }
      case files::KeyType::text:
      case files::KeyType::file:
      case files::KeyType::note:
        break;
    }
    return text();
  }

  /// As its table has it, with values of its own.
  Json object(const files::KeyTable& table, int depth) {
    Json made = Json::object();
    const auto add = [&](const files::Key& key) {
      if (depth > 3 || (!key.required && !one_in(3))) return;
      made[std::string(key.name)] = key.table != nullptr && key.type == files::KeyType::object
                                        ? object(key.table(), depth + 1)
                                        : other_value(key, {});
    };
    for (const files::Key& key : table.keys) add(key);
    if (!table.variants.empty()) {
      for (const files::Key& key : table.variants[pick(table.variants.size())].keys) add(key);
    }
    return made;
  }

  /// The ends of the range, what lies just beyond, the middle, and what is no use anywhere.
  double number(files::Range range) {
    const double from = std::max(range.min, -1e9), to = std::min(range.max, 1e9);
    switch (pick(10)) {
      case 0:
      case 1:
        return from;
      case 2:
      case 3:
        return to;
      case 4:
        return from - 1;
      case 5:
        return to + 1;
      case 6:
        return std::clamp(0.0, from, to);
      case 7:
        return std::clamp(1e-12, from, to);
      default:
        return from + (to - from) * static_cast<double>(pick(1001)) / 1000;
    }
  }

  Json numbers(const files::Key& key, const Json& now) {
    const int count = std::max(1, key.items.min);
    Json made = now.is_array() && !now.empty() ? now : Json::array();
    switch (pick(5)) {
      case 0:  // one of them
        if (!made.empty()) {
          made[pick(made.size())] = number(key.range);
          return made;
        }
        [[fallthrough]];
      case 1: {  // all the same
        const double value = number(key.range);
        return Json(std::vector<double>(static_cast<std::size_t>(count), value));
      }
      case 2:  // one too few or too many
        if (one_in(2) || made.empty()) {
          made.push_back(number(key.range));
        } else {
          made.erase(made.size() - 1);
        }
        return made;
      default: {
        Json all = Json::array();
        for (int i = 0; i < count; ++i) all.push_back(number(key.range));
        return all;
      }
    }
  }

  Json rows(const files::Key& key, const Json& now) {
    return list(now, [&] {
      Json row = Json::array();
      for (int i = 0; i < std::max(1, key.row.min); ++i) row.push_back(number(key.range));
      return row;
    });
  }

  /// None, one more, one twice, one less, all the other way round, or many.
  template <typename Make>
  Json list(const Json& now, const Make& make) {
    Json made = now.is_array() ? now : Json::array();
    switch (pick(6)) {
      case 0:
        return Json::array();
      case 1:
        if (!made.empty()) made.push_back(Json(made[pick(made.size())]));
        break;
      case 2:
        if (!made.empty()) made.erase(pick(made.size()));
        break;
      case 3:
        std::reverse(made.begin(), made.end());
        break;
      case 4:
        for (int i = 0; i < 70; ++i) made.push_back(made.empty() || one_in(2) ? make() : Json(made.front()));
        break;
      default:
        made.push_back(make());
    }
    return made;
  }

  std::string text() {
    static const std::vector<std::string> kOdd{"",
                                               " ",
                                               "no_such_name",
                                               "Leber\u2011\u00dcbung \u809d\u81d3 \U0001fa7a",
                                               "a/b",
                                               "..",
                                               ".",
                                               "two\nlines\t{}%s",
                                               std::string("nul\0inside", 10),
                                               "\x1b[31mred",
                                               std::string(3000, 'x')};
    if (!names_.empty() && !one_in(3)) return names_[pick(names_.size())];
    return kOdd[pick(kOdd.size())];
  }

  Json wrong_type() {
    switch (pick(7)) {
      case 0:
        return nullptr;
      case 1:
        return "1";
      case 2:
        return Json::array();
      case 3:
        return Json::object();
      case 4:
        return true;
      case 5:
        return 1e300;
      default:
        return Json::array({Json::array({Json::array()})});
    }
  }

  std::mt19937 random_;
  std::vector<std::string> names_;
};

/// Every text in there, for KeyMutation.
inline void collect_texts(const nlohmann::ordered_json& value, std::vector<std::string>& texts) {
  if (value.is_string() && value.get_ref<const std::string&>().size() < 60) texts.push_back(value.get<std::string>());
  if (!value.is_structured()) return;
  for (const auto& [key, inner] : value.items()) collect_texts(inner, texts);
}

}  // namespace stylet::support
