#include "haptic/haply/haply_message.h"

#include <nlohmann/json.hpp>

#include <cmath>

namespace stylet::haptic::haply {
namespace {

using nlohmann::json;

/// Null where there is none; never inserts, never throws.
const json* at(const json* object, const char* key) {
  if (object == nullptr || !object->is_object()) return nullptr;
  const auto found = object->find(key);
  return found != object->end() ? &*found : nullptr;
}

std::string text(const json* value) {
  return value != nullptr && value->is_string() ? value->get<std::string>() : "";
}

std::optional<bool> truth(const json* value) {
  if (value == nullptr || !value->is_boolean()) return {};
  return value->get<bool>();
}

std::optional<double> number(const json* value) {
  if (value == nullptr || !value->is_number()) return {};
  const double given = value->get<double>();
  if (!std::isfinite(given)) return {};
  return given;
}

std::optional<Eigen::Vector3d> vector(const json* value) {
  const auto x = number(at(value, "x")), y = number(at(value, "y")), z = number(at(value, "z"));
  if (!x || !y || !z) return {};
  return Eigen::Vector3d(*x, *y, *z);
}

std::optional<Eigen::Quaterniond> quaternion(const json* value) {
  const auto w = number(at(value, "w"));
  const auto axis = vector(value);
  if (!w || !axis) return {};
  const Eigen::Quaterniond q(*w, axis->x(), axis->y(), axis->z());
  if (std::abs(q.norm() - 1) > 1e-2) return {};
  return q.normalized();
}

Arm arm(const json& entry) {
  const json* config = at(&entry, "config");
  const json* state = at(&entry, "state");
  const json* status = at(&entry, "status");
  return {.id = text(at(&entry, "device_id")),
          .type = text(at(config, "type")),
          .handedness = text(at(config, "handedness")),
          .basis = text(at(at(config, "basis"), "permutation")),
          .position = vector(at(state, "cursor_position")),
          .force = vector(at(state, "current_cursor_force")),
          .calibrated = truth(at(status, "calibrated")),
          .power = truth(at(status, "power_supply")),
          .ready = truth(at(status, "ready")),
          .started = truth(at(status, "started"))};
}

Grip grip(const json& entry, bool wireless) {
  const json* state = at(&entry, "state");
  const json* status = at(&entry, "status");
  const json* buttons = at(state, "buttons");
  const auto is = [&](const char* key) { return truth(at(status, key)).value_or(true); };
  return {.id = text(at(&entry, "device_id")),
          .wireless = wireless,
          .orientation = quaternion(at(state, "orientation")),
          .barrel = truth(wireless ? at(buttons, "a") : at(state, "button")).value_or(false),
          .secondary = truth(at(buttons, "b")).value_or(false),
          .there = is("connected") && is("awake") && is("ready"),
          .battery = number(at(state, "battery_level"))};
}

}  // namespace

std::optional<Message> parse_message(std::string_view text_of_message) {
  const json root = json::parse(text_of_message, nullptr, false);
  if (!root.is_object()) return {};
  Message message;
  const auto each = [&](const char* key, const auto& add) {
    const json* list = at(&root, key);
    if (list == nullptr || !list->is_array()) return;
    for (const json& entry : *list) {
      if (!text(at(&entry, "device_id")).empty()) add(entry);
    }
  };
  each("inverse3", [&](const json& entry) { message.arms.push_back(arm(entry)); });
  each("verse_grip", [&](const json& entry) { message.grips.push_back(grip(entry, false)); });
  each("wireless_verse_grip", [&](const json& entry) { message.grips.push_back(grip(entry, true)); });
  return message;
}

}  // namespace stylet::haptic::haply
