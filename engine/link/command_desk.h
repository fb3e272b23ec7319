// Where the commands of clients wait for whoever can do them, and what came of them waits for the clients.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace stylet::link {

/// The link's thread hands commands in and takes the answers; one other thread, which is no loop, takes the commands
/// and answers. Either holds the lock for no longer than it takes to move a string.
class CommandDesk {
public:
  struct Request {
    std::uint64_t number = 0;
    std::string text{};
  };
  struct Answer {
    std::uint64_t number = 0;
    bool done = false;
    std::string words{};  ///< one line without < and &
  };

  /// Link's thread. Where kMost wait, or nobody is at the scanner, the answer says so.
  void hand_in(Request request);
  /// Link's thread.
  std::vector<Answer> take_answers();
  /// Link's thread: who asked has gone. Nothing happens if it is being carried out already.
  void withdraw(std::uint64_t number);

  /// The other thread: whether there is a scanner, or one will be. At first there will be.
  void set_attended(bool attended);
  /// The other thread: the oldest that waits.
  std::optional<Request> next();
  void answer(Answer answer);

  static constexpr std::size_t kMost = 64;

private:
  std::mutex mutex_;
  bool attended_ = true;
  std::deque<Request> waiting_;
  std::vector<Answer> answers_;
};

}  // namespace stylet::link
