// OpenIGTLink messages out of a stream of bytes that anybody may have sent.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace stylet::link {

struct ReceivedTransform {
  std::string name;  ///< of the device, or of the tool of a TDATA message
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
};

/// Something asked for as text: a COMMAND, or a STRING to "CMD_..." as clients of version 1 send it.
struct ReceivedCommand {
  bool numbered = false;  ///< a COMMAND
  std::uint32_t id = 0;   ///< of a COMMAND
  std::string name;       ///< of a COMMAND
  std::string device;
  std::string text;
};

/// Takes TRANSFORM, TDATA and commands, of header version 1 and 2; other messages are passed over. Every check sum is
/// checked. What is no message ends the stream: there is no way to find the next one. Holds at most kLongestTaken
/// bytes.
class MessageReader {
public:
  static constexpr std::size_t kLongestTaken = 64 * 1024;        ///< body that is taken in
  static constexpr std::uint64_t kLongestPassedOver = 64 << 20;  ///< body that is not

  /// Takes in bytes as they come, in whatever pieces. Adds what it finds to `out`.
  /// @return false: this is no OpenIGTLink, see problem(); from then on nothing is taken
  bool take(std::span<const std::uint8_t> bytes, std::vector<ReceivedTransform>& out);

  /// The commands found since this was asked last, the first kMostCommands of them: more than may wait (CommandDesk),
  /// so that who asks for too many at a time is told so.
  std::vector<ReceivedCommand> take_commands() { return std::exchange(commands_, {}); }
  static constexpr std::size_t kMostCommands = 128;

  /// One line without the sender; empty: none.
  const std::string& problem() const { return problem_; }
  /// A message has begun and its end has not come yet.
  bool in_message() const { return !held_.empty() || passing_; }
  std::uint64_t messages() const { return messages_; }

private:
  bool begin();
  bool finish(std::vector<ReceivedTransform>& out);
  bool is_taken() const;
  bool read(std::vector<ReceivedTransform>& out);
  bool read_transforms(std::span<const std::uint8_t> content, std::vector<ReceivedTransform>& out);
  bool read_command(std::span<const std::uint8_t> content);
  bool refuse(std::string problem);

  // Of the message that is coming in.
  std::vector<std::uint8_t> held_;  ///< its header, then the body where that is taken
  bool passing_ = false;            ///< its header is known
  std::string type_;
  std::string device_;
  int version_ = 1;
  std::uint64_t body_size_ = 0;
  std::uint64_t expected_sum_ = 0;
  std::uint64_t sum_ = 0;
  std::uint64_t got_ = 0;  ///< bytes of its body

  std::vector<ReceivedCommand> commands_;
  std::uint64_t messages_ = 0;
  std::string problem_;
};

}  // namespace stylet::link
