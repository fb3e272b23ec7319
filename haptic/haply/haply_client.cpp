#include "haptic/haply/haply_client.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace stylet::haptic::haply {
namespace {

constexpr double kClearForce = 0.3;    // N; a state must show one as large
constexpr double kHardlyForce = 0.02;  // N
constexpr double kOwnGain = 1.5;       // a user may have set the service stronger, but not more
constexpr std::int64_t kEcho = 200'000'000;
constexpr std::int64_t kWindow = 50'000'000;
constexpr int kMostLetGoes = 3;  // of one connection

std::string json_text(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

template <typename T>
void keep(std::optional<T>& known, const std::optional<T>& told) {
  if (told) known = told;
}

void keep(std::string& known, const std::string& told) {
  if (!told.empty()) known = told;
}

}  // namespace

std::optional<HaplyClient::Report> HaplyClient::receive(std::string_view text, std::int64_t now_ns) {
  const bool answer = outstanding_ > 0;
  // The service looked at its device after our question, whenever its answer comes.
  const std::int64_t made_ns = answer ? waiting_ns_ : now_ns;
  if (answer) {
    --outstanding_;
    waiting_ns_ = now_ns;
  }
  if (!answer && heard_ && ++unasked_ > kMostUnasked) failed_ = "the service sends what nobody asked for";
  heard_ = true;
  const auto message = parse_message(text);
  const Arm* arm = nullptr;
  if (message) {
    const auto& arms = message->arms;
    const auto found = pair_.arm.empty() ? arms.begin() : std::ranges::find(arms, pair_.arm, &Arm::id);
    if (found != arms.end()) arm = &*found;
  }
  if (arm == nullptr || !arm->position) {
    // One that was there and has gone is as one that is pulled out.
    if (state_ns_ != 0 && ++nonsense_ > kMostNonsense) {
      failed_ = message ? "the service has lost the device" : "the service answers what is no JSON";
    }
    if (arm == nullptr && message && state_ns_ == 0) problem_ = "the service knows no Inverse3: plug it in";
    // It forgets its force: back again it is to rise anew.
    if (arm == nullptr && message && state_ns_ != 0) return adapter_.input({}, made_ns);
    if (arm == nullptr) return {};
  }
  pair_.arm = arm->id;
  take(*arm, now_ns);
  if (!arm->position) return {};
  nonsense_ = 0;
  if (introduced_ && now_ns - made_ns > kOldAnswer) return {};
  const bool first = state_ns_ == 0;
  state_ns_ = made_ns;

  const Grip* grip = nullptr;
  if (first && pair_.grip.empty() && message->grips.size() == 1) pair_.grip = message->grips[0].id;
  const auto found = std::ranges::find(message->grips, pair_.grip, &Grip::id);
  if (!pair_.grip.empty() && found != message->grips.end()) grip = &*found;
  problem_ = what_is_wrong(grip);
  hid::AdaptedState state{.position = turned(*arm->position),
                          .in_range = arm_.calibrated.value_or(true),
                          .enabled = arm_.ready.value_or(false) && arm_.started.value_or(false),
                          .power = arm_.power.value_or(false)};
  // Without a grip the needle keeps its direction; one that is known and silent is a hand that cannot be followed.
  if (!pair_.grip.empty()) state.in_range = state.in_range && grip != nullptr && grip->there && grip->orientation;
  if (introduced_ && !arm_.basis.empty() && arm_.basis != "XYZ") state.in_range = false;
  if (grip != nullptr) {
    if (grip->orientation) state.orientation = turned(*grip->orientation);
    state.barrel = grip->barrel;
    state.secondary_barrel = grip->secondary;
  }
  return adapter_.input(state, made_ns);
}

void HaplyClient::take(const Arm& arm, std::int64_t now_ns) {
  keep(arm_.id, arm.id);
  keep(arm_.type, arm.type);
  // What the inventory says of it was so before we asked for ours.
  if (introduced_) keep(arm_.basis, arm.basis);
  keep(arm_.calibrated, arm.calibrated);
  keep(arm_.power, arm.power);
  keep(arm_.ready, arm.ready);
  keep(arm_.started, arm.started);
  if (arm.force) told_force_ = turned(*arm.force);
  check_echo(arm, now_ns);
  look_for_others(arm, now_ns);
}

void HaplyClient::look_for_others(const Arm& arm, std::int64_t now_ns) {
  if (!arm.force) return;
  if (now_ns - window_ns_ > kWindow) {
    sent_n_ = {0, sent_n_[0]};
    window_ns_ = now_ns;
  }
  const bool more = arm.force->norm() > kOwnGain * std::max(sent_n_[0], sent_n_[1]) + kClearForce;
  std::int64_t& since_ns = more ? more_ns_ : no_more_ns_;
  (more ? no_more_ns_ : more_ns_) = 0;
  if (since_ns == 0) since_ns = now_ns;
  if (now_ns - since_ns <= kEcho) return;
  if (more && !others_) ++let_goes_;
  // What comes back with our own force is the service's own strength: on and off for ever would be felt.
  others_ = more || let_goes_ >= kMostLetGoes;
}

void HaplyClient::check_echo(const Arm& arm, std::int64_t now_ns) {
  if (!arm.force || !pushed_ || arm.force->norm() > kHardlyForce || force(now_ns).norm() < kClearForce) {
    if (arm.force && arm.force->norm() > kHardlyForce) unanswered_ns_ = 0;
    if (!pushed_) unanswered_ns_ = 0;
    return;
  }
  if (unanswered_ns_ == 0) unanswered_ns_ = now_ns;
  if (now_ns - unanswered_ns_ < kEcho || form_ == Form::kNone) return;
  form_ = static_cast<Form>(static_cast<int>(form_) + 1);
  unanswered_ns_ = now_ns;
  let_go_ = true;
}

std::string HaplyClient::what_is_wrong(const Grip* grip) const {
  if (introduced_ && !arm_.basis.empty() && arm_.basis != "XYZ") {
    return fmt::format(
        "the service keeps the axes {} though XYZ was asked for: reset its profile for Stylet in the "
        "Haply Hub",
        arm_.basis);
  }
  if (!arm_.calibrated.value_or(true)) return "it is not calibrated: do that in the Haply Hub";
  if (!arm_.power.value_or(false)) return "its motors have no power: plug in its power supply";
  if (!arm_.ready.value_or(false) || !arm_.started.value_or(false))
    return "it is not ready: wait, or see the Haply Hub";
  if (!pair_.grip.empty() && (grip == nullptr || !grip->there)) return "its grip sleeps: press a button of the grip";
  if (others_)
    return "it pushes more than was asked: end other programs that push it, or set its strength back in the Haply "
           "Hub";
  if (form_ == Form::kNone) return "the service takes no forces: update the Haply Inverse Service";
  return {};
}

bool HaplyClient::able(std::int64_t now_ns) const {
  const bool on = arm_.power.value_or(false) && arm_.ready.value_or(false) && arm_.started.value_or(false);
  return on && !others_ && !ending_ && failed_.empty() && state_ns_ != 0 && now_ns - state_ns_ < kSilence;
}

Eigen::Vector3d HaplyClient::force(std::int64_t now_ns) const {
  return able(now_ns) ? adapter_.force(now_ns) : Eigen::Vector3d(0, 0, 0);
}

std::string HaplyClient::next(std::int64_t now_ns) {
  if (!failed_.empty()) return {};
  if (!able(now_ns) || let_go_) adapter_.interrupt();
  if (!heard_ && now_ns - connected_ns_ < kInventoryWait) return {};
  if (outstanding_ > 0) {
    const std::int64_t patience = heard_ && state_ns_ != 0 ? kAnswer : kFirstAnswer;
    if (now_ns - waiting_ns_ > patience) {
      failed_ = fmt::format("the service did not answer for {} ms", patience / 1'000'000);
      return {};
    }
    // The device may hold the force that went with the message.
    if (outstanding_ == 1 && pushed_ && force(now_ns).isZero(0)) {
      ++outstanding_;
      return force_message({0, 0, 0});
    }
    return {};
  }
  if (pair_.arm.empty()) {
    if (looked_ns_ != 0 && now_ns - looked_ns_ < kLookAgain) return {};
    looked_ns_ = now_ns;
    outstanding_ = 1;
    waiting_ns_ = now_ns;
    return R"({"session":{"force_render_full_state":{}}})";
  }
  outstanding_ = 1;
  waiting_ns_ = now_ns;
  if (!introduced_) {
    introduced_ = true;
    return first_message();
  }
  return force_message(turned(force(now_ns)));
}

std::string HaplyClient::last_word() {
  ending_ = true;
  return pushed_ ? force_message({0, 0, 0}) : std::string();
}

std::string HaplyClient::first_message() {
  return fmt::format(
      R"({{"session":{{"configure":{{"profile":{{"name":"org.stylet:simulator"}},"basis":{{"permutation":"XYZ"}}}},)"
      R"("force_render_full_state":{{}}}},"inverse3":[{{"device_id":{},"configure":{{"preset":"defaults"}}}}]}})",
      json_text(pair_.arm));
}

std::string HaplyClient::force_message(const Eigen::Vector3d& force) {
  sent_n_[0] = std::max(sent_n_[0], force.norm());
  const std::string xyz = fmt::format(R"({{"x":{},"y":{},"z":{}}})", force.x(), force.y(), force.z());
  // Whichever key the force that is under way went under, a zero takes it back; one that has both may be ignored by a
  // service that knows one, and so the next zero goes under that alone.
  const bool zero = force.isZero(0);
  const bool one_key = (form_ == Form::kVector || form_ == Form::kValues) && (!zero || zero_sent_);
  zero_sent_ = zero && !one_key;
  if (zero_sent_) let_go_ = false;
  pushed_ = !zero || (zero_sent_ && form_ != Form::kBoth && form_ != Form::kNone);
  std::string keys;
  if (!one_key || form_ == Form::kVector) keys = R"("vector":)" + xyz;
  if (!one_key || form_ == Form::kValues) keys += (keys.empty() ? "" : ",") + (R"("values":)" + xyz);
  return fmt::format(R"({{"inverse3":[{{"device_id":{},"commands":{{"set_cursor_force":{{{}}}}}}}]}})",
                     json_text(pair_.arm), keys);
}

bool HaplyClient::end() {
  ending_ = true;
  return !pushed_ && outstanding_ == 0;
}

}  // namespace stylet::haptic::haply
