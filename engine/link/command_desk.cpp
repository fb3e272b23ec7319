#include "engine/link/command_desk.h"

#include <utility>

namespace stylet::link {

void CommandDesk::hand_in(Request request, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == kMost) {
    answers_.push_back({request.number, false, "too many commands at a time"});
  } else {
    waiting_.push_back({std::move(request), now});
  }
}

std::vector<CommandDesk::Answer> CommandDesk::take_answers(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  while (!waiting_.empty() && now - waiting_.front().since > kPatience) {
    answers_.push_back({waiting_.front().request.number, false, "nobody is at the scanner"});
    waiting_.pop_front();
  }
  return std::exchange(answers_, {});
}

std::optional<CommandDesk::Request> CommandDesk::next() {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  Request request = std::move(waiting_.front().request);
  waiting_.pop_front();
  return request;
}

void CommandDesk::answer(Answer answer) {
  const std::lock_guard lock(mutex_);
  answers_.push_back(std::move(answer));
}

}  // namespace stylet::link
