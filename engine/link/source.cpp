#include "engine/link/source.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace stylet::link {

Source::Source(const Endpoint& endpoint) : name_(to_string(endpoint)), remote_(endpoint) {}

void Source::retry_later(Clock::time_point now) {
  connecting_ = Socket();
  next_try_ = now + wait_;
  wait_ = std::min(2 * wait_, kLastRetry);
}

void Source::attend(Clock::time_point now) {
  if (connection_) return;
  if (is_connecting()) {
    if (now - began_ > kConnectTimeout) retry_later(now);
    return;
  }
  if (now < next_try_) return;
  began_ = now;
  connecting_ = remote_.begin_connecting();
  if (!connecting_.is_open()) retry_later(now);
}

void Source::serve(std::vector<ReceivedTransform>& transforms, Clock::time_point now) {
  if (connection_) return connection_->receive(transforms, now);
  if (!is_connecting()) return;
  if (!Remote::connected(connecting_)) return retry_later(now);
  connection_.emplace(std::exchange(connecting_, Socket()), name_, now);
  ++connections_;
  wait_ = kFirstRetry;
}

std::string Source::take_leave(Clock::time_point now) {
  if (!connection_ || !connection_->has_ended()) return {};
  std::string line =
      connection_->problem().empty() ? "" : fmt::format("server {}: {}", name_, connection_->problem());
  connection_.reset();
  retry_later(now);
  return line;
}

int Source::descriptor() const {
  return connection_ ? connection_->descriptor() : connecting_.descriptor();
}

}  // namespace stylet::link
