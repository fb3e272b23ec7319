// OpenIGTLink messages from the network: whatever is sent, and however it is cut, the same is found or refused.
#include "engine/link/message_reader.h"
#include "engine/link/scanner_request.h"
#include "engine/link/tracked_pose.h"
#include "tests/fuzz/claim.h"
#include "tests/fuzz/libfuzzer.h"

#include <igtl_header.h>
#include <igtl_util.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

namespace {

using namespace stylet;
using namespace stylet::link;
using fuzz::claim;

/// Gives every whole message its check sum: a random change would not find it.
void repair(std::vector<std::uint8_t>& stream) {
  for (std::size_t at = 0; at + IGTL_HEADER_SIZE <= stream.size();) {
    igtl_header header;
    std::memcpy(&header, stream.data() + at, sizeof header);
    igtl_header_convert_byte_order(&header);
    std::uint8_t* body = stream.data() + at + IGTL_HEADER_SIZE;
    const std::size_t rest = stream.size() - at - IGTL_HEADER_SIZE;
    if (header.body_size > rest) return;
    header.crc = crc64(body, header.body_size, 0);
    at += IGTL_HEADER_SIZE + header.body_size;
    igtl_header_convert_byte_order(&header);
    std::memcpy(body - IGTL_HEADER_SIZE, &header, sizeof header);
  }
}

struct Outcome {
  std::vector<ReceivedTransform> found;
  std::vector<ReceivedCommand> commands;
  std::string problem;
  bool in_message = false;
};

Outcome read(std::span<const std::uint8_t> stream, std::size_t piece) {
  MessageReader reader;
  Outcome outcome;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    const bool taken = reader.take(stream.subspan(at, std::min(piece, stream.size() - at)), outcome.found);
    claim(taken == reader.problem().empty(), "what is refused has a problem");
    if (!taken) break;
  }
  outcome.commands = reader.take_commands();
  outcome.problem = reader.problem();
  outcome.in_message = reader.in_message();
  return outcome;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  std::vector<std::uint8_t> stream(data + 1, data + size);
  if ((data[0] & 1) != 0) repair(stream);
  const Outcome whole = read(stream, stream.size());
  const Outcome pieces = read(stream, 1 + data[0] / 2);
  claim(whole.problem == pieces.problem && whole.found.size() == pieces.found.size() &&
            whole.commands.size() == pieces.commands.size() && whole.in_message == pieces.in_message,
        "it is the same however it is cut");
  claim(whole.commands.size() <= MessageReader::kMostCommands, "a flood of commands is bounded");
  for (std::size_t k = 0; k < whole.commands.size(); ++k) {
    const ReceivedCommand& command = whole.commands[k];
    claim(command.name.size() <= 128 && command.device.size() <= 20, "names are fields");
    claim(command.text == pieces.commands[k].text && command.id == pieces.commands[k].id, "a command is the same");
    const ScannerRequest request = read_scanner_request(command.text);
    claim(request.problem.empty() == !request.settings.empty() || !request.problem.empty(), "it is read or refused");
    claim(request.settings.size() <= kMostSettings, "settings are bounded");
    if (!request.problem.empty()) fuzz::claim_one_line(request.problem);
  }
  if (!whole.problem.empty()) fuzz::claim_one_line(whole.problem);
  for (std::size_t k = 0; k < whole.found.size(); ++k) {
    const ReceivedTransform& transform = whole.found[k];
    claim(transform.name.size() <= 20 && transform.name == pieces.found[k].name, "a name is a field");
    claim(std::memcmp(transform.matrix.data(), pieces.found[k].matrix.data(), sizeof(double) * 16) == 0,
          "a matrix is the same");
    if (const auto pose = patient_pose(transform.matrix)) {
      claim(pose->position.norm() <= 10.001 && std::abs(pose->orientation.norm() - 1) < 1e-9, "a pose is rigid");
    }
  }
  return 0;
}
