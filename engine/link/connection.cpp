#include "engine/link/connection.h"

#include <fmt/format.h>

#include <utility>

namespace stylet::link {
namespace {

constexpr std::size_t kPiece = 16 * 1024;
constexpr int kPiecesAtOnce = 16;  // one that sends without end keeps nobody else waiting

}  // namespace

Connection::Connection(Socket socket, std::string name, Clock::time_point now)
    : socket_(std::move(socket)), name_(std::move(name)), last_sent_(now), last_received_(now) {}

void Connection::end(std::string problem) {
  ended_ = true;
  problem_ = std::move(problem);
}

void Connection::reply(Bytes bytes) {
  if (replies_.size() < kMostReplies) replies_.push_back(std::move(bytes));
}

bool Connection::take_next(const Board& board) {
  if (!replies_.empty()) {
    in_flight_ = std::move(replies_.front());
    replies_.pop_front();
    sent_ = 0;
    return true;
  }
  for (std::size_t topic = 0; topic < kTopics; ++topic) {
    const Bulletin& bulletin = board[topic];
    if (bulletin.number <= newest_taken_[topic]) continue;
    // A peer that is new has missed nothing.
    if (newest_taken_[topic] != 0) counts_[topic].dropped += bulletin.number - newest_taken_[topic] - 1;
    ++counts_[topic].sent;
    newest_taken_[topic] = bulletin.number;
    in_flight_.assign(bulletin.bytes.begin(), bulletin.bytes.end());
    sent_ = 0;
    return true;
  }
  return false;
}

void Connection::send(const Board& board, Clock::time_point now) {
  while (!ended_) {
    if (!is_sending()) {
      if (!take_next(board)) return;
      last_sent_ = now;
    }
    const Socket::Transfer transfer = socket_.send(std::span(in_flight_).subspan(sent_));
    if (transfer.ended) return end(transfer.problem);
    if (transfer.bytes == 0) return;
    sent_ += transfer.bytes;
    last_sent_ = now;
  }
}

void Connection::receive(std::vector<ReceivedTransform>& transforms, Clock::time_point now) {
  std::array<std::uint8_t, kPiece> piece;
  for (int n = 0; n < kPiecesAtOnce && !ended_; ++n) {
    const Socket::Transfer transfer = socket_.receive(piece);
    if (transfer.ended) {
      return end(transfer.problem.empty() && reader_.in_message() ? "it left in the middle of a message"
                                                                  : transfer.problem);
    }
    if (transfer.bytes == 0) return;
    last_received_ = now;
    if (!reader_.take(std::span(piece).first(transfer.bytes), transforms)) return end("it sent " + reader_.problem());
  }
}

void Connection::make_room(Clock::time_point now) {
  const std::chrono::duration<double> silence = now - last_received_;
  end(fmt::format("it said nothing for {:.0f} s, and its place was wanted", silence.count()));
}

void Connection::expire(Clock::time_point now, Clock::duration patience) {
  if (ended_) return;
  const double seconds = std::chrono::duration<double>(patience).count();
  if (is_sending() && now - last_sent_ > patience) end(fmt::format("it took nothing for {:g} s", seconds));
  if (reader_.in_message() && now - last_received_ > patience) {
    end(fmt::format("it sent half a message and then nothing for {:g} s", seconds));
  }
}

}  // namespace stylet::link
