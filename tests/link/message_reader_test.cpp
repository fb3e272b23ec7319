// Messages out of bytes, however they are cut.
#include "engine/link/message_reader.h"

#include "engine/link/message.h"
#include "engine/link/scanner_request.h"
#include "engine/link/tracked_pose.h"

#include <igtl_header.h>
#include <igtl_util.h>

#include <gtest/gtest.h>

#include <cstring>

namespace stylet::link {
namespace {

Eigen::Matrix4d numbered_matrix(int n) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) matrix(row, column) = 100 * n + 10 * row + column;
  }
  return matrix;
}

/// The same message with a header of version 2: an extended header before the content, meta data behind it.
Bytes as_version_2(const Bytes& message) {
  const Bytes meta{0, 1, 0, 1, 0, 3, 0, 0, 0, 1, 'k', 'v'};  // one key
  Bytes body{0, 12, 0, 10, 0, 0, 0, 2, 0, 0, 0, 9};
  body.insert(body.end(), message.begin() + IGTL_HEADER_SIZE, message.end());
  body.insert(body.end(), meta.begin(), meta.end());
  igtl_header header;
  std::memcpy(&header, message.data(), sizeof header);
  igtl_header_convert_byte_order(&header);
  header.version = 2;
  header.body_size = body.size();
  header.crc = crc64(body.data(), body.size(), 0);
  igtl_header_convert_byte_order(&header);
  Bytes bytes(sizeof header);
  std::memcpy(bytes.data(), &header, sizeof header);
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

TEST(MessageReader, FindsTheSameTransformsHoweverTheBytesAreCut) {
  Bytes stream;
  append_transform(stream, kProbeName, 1.25, numbered_matrix(1));
  const std::vector<std::uint8_t> pixels(200 * 100, 9);
  append_image(stream, kImageName, 2, {.width = 200, .height = 100, .pixels = pixels});
  append_status(stream, kStatusName, 3, Status::ok, "well");
  Bytes last;
  append_transform(last, kNeedleTipName, 4, numbered_matrix(2));
  const Bytes second = as_version_2(last);
  stream.insert(stream.end(), second.begin(), second.end());
  for (const std::size_t piece :
       {stream.size(), std::size_t(1), std::size_t(57), std::size_t(59), std::size_t(4096)}) {
    MessageReader reader;
    std::vector<ReceivedTransform> found;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      const auto part = std::span(stream).subspan(at, std::min(piece, stream.size() - at));
      ASSERT_TRUE(reader.take(part, found)) << reader.problem();
    }
    EXPECT_EQ(reader.messages(), 4U);
    EXPECT_FALSE(reader.in_message());
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[0].name, "ProbeToReference");
    EXPECT_EQ(found[0].matrix, numbered_matrix(1));
    EXPECT_EQ(found[1].name, "NeedleTipToReference");  // 20 bytes, no zero behind it
    EXPECT_EQ(found[1].matrix, numbered_matrix(2));
  }
}

/// Number, name of 128 bytes, encoding, length, text.
Bytes command_body(std::uint32_t id, const std::string& name, const std::string& text) {
  Bytes body;
  for (int shift = 24; shift >= 0; shift -= 8) body.push_back(static_cast<std::uint8_t>(id >> shift));
  body.insert(body.end(), name.begin(), name.end());
  body.resize(4 + 128);
  const Bytes encoding_and_length{0, 3, 0, 0, 0, static_cast<std::uint8_t>(text.size())};
  body.insert(body.end(), encoding_and_length.begin(), encoding_and_length.end());
  body.insert(body.end(), text.begin(), text.end());
  return body;
}

/// A message with the header of a transform, but for the type, and the right sum.
Bytes with_body(const char* type, const Bytes& body) {
  igtl_header header{};
  header.version = 1;
  std::strncpy(header.name, type, sizeof header.name);
  header.body_size = body.size();
  Bytes content = body;
  header.crc = crc64(content.data(), content.size(), 0);
  igtl_header_convert_byte_order(&header);
  Bytes bytes(sizeof header);
  std::memcpy(bytes.data(), &header, sizeof header);
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

TEST(MessageReader, FindsCommandsOfBothKindsHoweverTheBytesAreCut) {
  Bytes stream = as_version_2(with_body("COMMAND", command_body(70000, "SetUsParameter", "<Command/>")));
  append_string(stream, "CMD_12", 1, "scanner gain +2");
  append_string(stream, "Comment", 1, "nobody is asked for anything");
  for (const std::size_t piece : {stream.size(), std::size_t(1), std::size_t(57)}) {
    MessageReader reader;
    std::vector<ReceivedTransform> found;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      const auto part = std::span(stream).subspan(at, std::min(piece, stream.size() - at));
      ASSERT_TRUE(reader.take(part, found)) << reader.problem();
    }
    const std::vector<ReceivedCommand> commands = reader.take_commands();
    EXPECT_EQ(reader.messages(), 3U);
    ASSERT_EQ(commands.size(), 2U);
    EXPECT_TRUE(commands[0].numbered);
    EXPECT_EQ(commands[0].id, 70000U);
    EXPECT_EQ(commands[0].name, "SetUsParameter");
    EXPECT_EQ(commands[0].text, "<Command/>");
    EXPECT_FALSE(commands[1].numbered);
    EXPECT_EQ(commands[1].device, "CMD_12");
    EXPECT_EQ(commands[1].text, "scanner gain +2");
    EXPECT_TRUE(reader.take_commands().empty());
  }
}

TEST(MessageReader, ACommandShorterThanItSaysIsRefusedAndAFloodIsBounded) {
  Bytes body = command_body(1, "x", "12345");
  body.back() = 0;
  body.pop_back();
  MessageReader reader;
  std::vector<ReceivedTransform> found;
  EXPECT_FALSE(reader.take(with_body("COMMAND", body), found));
  EXPECT_NE(reader.problem().find("shorter than its text"), std::string::npos) << reader.problem();
  MessageReader flooded;
  Bytes message;
  append_string(message, "CMD_1", 1, "scanner freeze");
  for (int n = 0; n < 1000; ++n) ASSERT_TRUE(flooded.take(message, found));
  EXPECT_EQ(flooded.messages(), 1000U);
  EXPECT_EQ(flooded.take_commands().size(), MessageReader::kMostCommands);
}

TEST(ScannerRequest, ReadsWordsAndWhatPlusSends) {
  using Settings = std::vector<Setting>;
  EXPECT_EQ(read_scanner_request("  scanner gain +2\r\n").settings, (Settings{{"gain", "+2"}}));
  EXPECT_EQ(read_scanner_request("scanner freeze").settings, (Settings{{"freeze", ""}}));
  const ScannerRequest plus = read_scanner_request(
      "<Command Name=\"SetUsParameter\" UsDeviceId='VideoDevice'>\n <Parameter Name=\"DepthMm\" Value=\"150\"/>\n"
      " <Parameter Value = '40' Name = 'GainPercent' />\n</Command>");
  EXPECT_EQ(plus.problem, "");
  EXPECT_EQ(plus.settings, (Settings{{"DepthMm", "=150"}, {"GainPercent", "=40"}}));
  std::string many = "<Command Name=\"SetUsParameter\">";
  for (int n = 0; n < 100; ++n) many += "<Parameter Name=\"DepthMm\" Value=\"1\"/>";
  for (const std::string& text :
       {std::string(), std::string("gain +2"), std::string("scanner"), std::string("scanner gain + 2"),
        std::string("<Command Name=\"RequestDeviceIds\"/>"), std::string("<Command Name=\"SetUsParameter\"/>"),
        std::string("<Command Name=\"SetUsParameter\"><Parameter Name=\"DepthMm\"/></Command>"),
        std::string("<Parameter Name=\"DepthMm\" Value=\"1\"/>"), std::string("<Command Name=\"SetUsParameter\""),
        "scanner " + std::string(1000, 'x') + " 1", many}) {
    const ScannerRequest request = read_scanner_request(text);
    EXPECT_NE(request.problem, "") << text;
    EXPECT_EQ(request.problem.find('\n'), std::string::npos);
    EXPECT_TRUE(request.settings.empty() || !request.problem.empty());
  }
}

TEST(MessageReader, EveryBrokenBitIsRefused) {
  Bytes message;
  append_transform(message, kProbeName, 1, numbered_matrix(1));
  int refused = 0;
  for (std::size_t bit = 0; bit < 8 * message.size(); ++bit) {
    Bytes broken = message;
    broken[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    MessageReader reader;
    std::vector<ReceivedTransform> found;
    const bool taken = reader.take(broken, found);
    const std::size_t byte = bit / 8;
    // The check sum is of the body alone: names and time may say anything, a longer body is waited for.
    const bool unprotected = byte >= 2 && byte < 42;
    EXPECT_TRUE(unprotected || !taken || reader.in_message()) << "bit " << bit;
    refused += taken ? 0 : 1;
  }
  EXPECT_GT(refused, 8 * 48 + 8 * 8);  // body and sum at least
}

TEST(MessageReader, NothingIsTakenAfterAProblem) {
  MessageReader reader;
  std::vector<ReceivedTransform> found;
  EXPECT_FALSE(reader.take(Bytes(58, 0xFF), found));
  EXPECT_FALSE(reader.problem().empty());
  Bytes good;
  append_transform(good, kProbeName, 1, numbered_matrix(1));
  EXPECT_FALSE(reader.take(good, found));
  EXPECT_TRUE(found.empty());
}

TEST(TrackedPose, IsInThePatientFrame) {
  // +X of the tool is the patient's right, +Y anterior, +Z superior: RAS itself.
  Eigen::Matrix4d ras = Eigen::Matrix4d::Identity();
  ras(0, 3) = 10;
  ras(1, 3) = 20;
  ras(2, 3) = 30;
  const auto pose = patient_pose(ras);
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->position - Eigen::Vector3d(-0.010, 0.030, 0.020)).norm(), 1e-12);
  EXPECT_LT((pose->orientation * Eigen::Vector3d::UnitX() + Eigen::Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((pose->orientation * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((pose->orientation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

TEST(TrackedPose, IsARigidOneWithinReach) {
  Eigen::Matrix4d scaled = Eigen::Matrix4d::Identity();
  scaled(1, 1) = 1.1;
  Eigen::Matrix4d mirrored = Eigen::Matrix4d::Identity();
  mirrored(0, 0) = -1;
  Eigen::Matrix4d far = Eigen::Matrix4d::Identity();
  far(2, 3) = 1e5;
  Eigen::Matrix4d nowhere = Eigen::Matrix4d::Identity();
  nowhere(0, 3) = std::nan("");
  for (const Eigen::Matrix4d& matrix : {scaled, mirrored, far, nowhere}) EXPECT_FALSE(patient_pose(matrix)) << matrix;
}

}  // namespace
}  // namespace stylet::link
