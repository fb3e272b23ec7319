// One peer on the network: what it is still to be sent, and what it says.
#pragma once

#include "engine/link/message.h"
#include "engine/link/message_reader.h"
#include "engine/link/tcp.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace stylet::link {

using Clock = std::chrono::steady_clock;

/// What is sent, the most urgent first.
enum class Topic : std::uint8_t { status, transforms, image };
inline constexpr std::size_t kTopics = 3;

/// The newest of a topic, as bytes on the wire.
struct Bulletin {
  std::uint64_t number = 0;  ///< counts up; 0: there is none yet
  Bytes bytes{};
};
using Board = std::array<Bulletin, kTopics>;

/// A peer is sent the newest of every topic that it has not got yet, one after the other: topics have no queue, so a
/// slow one gets fewer messages and never late ones, and takes no more memory than one message and some replies.
class Connection {
public:
  Connection(Socket socket, std::string name, Clock::time_point now);

  /// Sends what the kernel takes.
  void send(const Board& board, Clock::time_point now);
  /// Takes what the kernel has, up to a bound; what is found is added to `transforms`.
  void receive(std::vector<ReceivedTransform>& transforms, Clock::time_point now);
  /// What it asked for since this was called last.
  std::vector<ReceivedCommand> take_commands() { return reader_.take_commands(); }
  /// Sends an answer before anything else; beyond kMostReplies that wait it is dropped.
  void reply(Bytes bytes);
  static constexpr std::size_t kMostReplies = 64;
  /// Ends it where the peer stopped in the middle: took nothing, or sent half a message.
  void expire(Clock::time_point now, Clock::duration patience);

  /// Ends it where it has said nothing for so long: a newcomer wants its place.
  void make_room(Clock::time_point now);
  Clock::time_point last_received() const { return last_received_; }

  bool has_ended() const { return ended_; }
  /// Why, where it was not in order.
  const std::string& problem() const { return problem_; }
  const std::string& name() const { return name_; }
  int descriptor() const { return socket_.descriptor(); }
  /// Part of a message waits until the kernel has room.
  bool is_sending() const { return sent_ < in_flight_.size(); }

  /// Of each topic, those sent and those that were over before the peer was ready for them.
  struct Counts {
    std::uint64_t sent = 0;
    std::uint64_t dropped = 0;
  };
  const std::array<Counts, kTopics>& counts() const { return counts_; }

private:
  bool take_next(const Board& board);
  void end(std::string problem);

  Socket socket_;
  std::string name_;
  MessageReader reader_;
  std::array<std::uint64_t, kTopics> newest_taken_{};
  std::array<Counts, kTopics> counts_{};
  std::deque<Bytes> replies_;
  Bytes in_flight_;
  std::size_t sent_ = 0;
  Clock::time_point last_sent_;
  Clock::time_point last_received_;
  bool ended_ = false;
  std::string problem_;
};

}  // namespace stylet::link
