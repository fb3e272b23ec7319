#include "tests/support/haply/haply_service.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace stylet::support {

using nlohmann::json;

namespace {

json xyz(const Eigen::Vector3d& v) {
  return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}};
}

}  // namespace

std::string HaplyService::state(std::int64_t now_ns, bool whole) {
  if (began_ns_ < 0) began_ns_ = now_ns;
  if (other_schema) return R"({"version":"9.0","devices":[{"kind":"inverse","pose":[0,0,0,0,0,0,1]}]})";
  const HaplyHand hand = motion ? motion(static_cast<double>(now_ns - began_ns_) * 1e-9) : HaplyHand{};
  json root = {{"session_id", 1}, {"inverse3", json::array()}, {"wireless_verse_grip", json::array()}};
  if (!vanished) {
    json entry = {{"device_id", arm},
                  {"state",
                   {{"cursor_position", xyz(hand.position)},
                    {"cursor_velocity", xyz({0, 0, 0})},
                    {"control_domain", "cartesian"},
                    {"control_mode", "force"}}},
                  {"status",
                   {{"calibrated", calibrated},
                    {"in_use", true},
                    {"power_supply", powered},
                    {"ready", true},
                    {"started", true}}}};
    if (echoes)
      entry["state"]["current_cursor_force"] =
          xyz(echoes_zero ? Eigen::Vector3d(0, 0, 0)
                          : Eigen::Vector3d(gives * applied(now_ns) + Eigen::Vector3d(0, 0, other_force)));
    if (whole) {
      entry["config"] = {{"type", "inverse3"},
                         {"handedness", "right"},
                         {"basis", {{"permutation", configured_ && basis.empty() ? "XYZ" : basis}}},
                         {"extended_firmware_version", "synthetic"}};
    }
    root["inverse3"].push_back(entry);
  }
  const auto add_grip = [&](const std::string& id) {
    const Eigen::Quaterniond& q = hand.orientation;
    root["wireless_verse_grip"].push_back(
        {{"device_id", id},
         {"state",
          {{"orientation", {{"w", q.w()}, {"x", q.x()}, {"y", q.y()}, {"z", q.z()}}},
           {"buttons", {{"a", hand.a}, {"b", hand.b}, {"c", false}}},
           {"hall", 0},
           {"battery_level", 0.9}}},
         {"status", {{"connected", true}, {"awake", !grip_sleeps}, {"ready", !grip_sleeps}}}});
  };
  if (!grip.empty()) add_grip(grip);
  if (second_grip) add_grip("7A00");
  std::string text = root.dump();
  if (!position_x.empty() && !vanished) {
    // In the text: what is no JSON cannot be in a tree of it.
    const std::size_t at = text.find("\"x\":", text.find("cursor_position")) + 4;
    text.replace(at, text.find_first_of(",}", at) - at, position_x);
  }
  return text;
}

std::string HaplyService::answer(std::string_view text, std::int64_t now_ns) {
  ++messages_;
  const json root = json::parse(text, nullptr, false);
  bool whole = false;
  if (!root.is_object()) ++nonsense_;
  if (applied(now_ns).isZero(0)) force_.setZero();  // what was dropped stays dropped
  // As the service: what is not understood is passed over in silence.
  const auto at = [](const json& value, const char* key) -> json {
    return value.is_object() && value.contains(key) ? value[key] : json();
  };
  const json session = at(root, "session");
  if (session.is_object()) {
    whole = session.contains("force_render_full_state");
    if (at(at(at(session, "configure"), "basis"), "permutation") == "XYZ") configured_ = true;
  }
  for (const json& entry : at(root, "inverse3")) {
    if (vanished || at(entry, "device_id") != arm) continue;
    const json command = at(at(entry, "commands"), "set_cursor_force");
    json force = takes_vector ? at(command, "vector") : json();
    if (force.is_null() && takes_values) force = at(command, "values");
    if (!force.is_object()) continue;
    force_ = {force["x"].get<double>(), force["y"].get<double>(), force["z"].get<double>()};
    if (!powered) force_.setZero();
    force_ns_ = now_ns;
    forces_ += force_.isZero(0) ? 0 : 1;
    if (force_.norm() > strongest_.norm()) strongest_ = force_;
  }
  return state(now_ns, whole);
}

Eigen::Vector3d HaplyService::applied(std::int64_t now_ns) const {
  if (vanished || !powered || now_ns - force_ns_ >= idle_ns) return {0, 0, 0};
  return force_;
}

}  // namespace stylet::support
