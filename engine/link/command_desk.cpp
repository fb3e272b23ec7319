#include "engine/link/command_desk.h"

#include <utility>

namespace stylet::link {

void CommandDesk::hand_in(Request request) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == kMost) {
    answers_.push_back({request.number, false, "too many commands at a time"});
  } else {
    waiting_.push_back(std::move(request));
  }
}

std::vector<CommandDesk::Answer> CommandDesk::take_answers() {
  const std::lock_guard lock(mutex_);
  if (!attended_) {
    for (const Request& request : waiting_) answers_.push_back({request.number, false, "nobody is at the scanner"});
    waiting_.clear();
  }
  return std::exchange(answers_, {});
}

void CommandDesk::withdraw(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  std::erase_if(waiting_, [number](const Request& request) { return request.number == number; });
}

void CommandDesk::set_attended(bool attended) {
  const std::lock_guard lock(mutex_);
  attended_ = attended;
}

std::optional<CommandDesk::Request> CommandDesk::next() {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  Request request = std::move(waiting_.front());
  waiting_.pop_front();
  return request;
}

void CommandDesk::answer(Answer answer) {
  const std::lock_guard lock(mutex_);
  answers_.push_back(std::move(answer));
}

}  // namespace stylet::link
