// OpenIGTLink messages as bytes: what Stylet sends. Protocol version 1, which every client reads, but for the answer
// to a COMMAND, which is of version 2 itself.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace stylet::link {

using Bytes = std::vector<std::uint8_t>;

/// Device names as PLUS has them; the protocol has room for 20 bytes.
inline constexpr std::string_view kImageName = "Image_Reference";
inline constexpr std::string_view kProbeName = "ProbeToReference";
inline constexpr std::string_view kNeedleName = "NeedleToReference";
inline constexpr std::string_view kNeedleTipName = "NeedleTipToReference";
inline constexpr std::string_view kStylusName = "StylusToReference";
inline constexpr std::string_view kStatusName = "Stylet";

/// A grey picture and where it is.
struct GreyImage {
  int width = 0;  ///< up to 65535
  int height = 0;
  std::span<const std::uint8_t> pixels;  ///< row by row
  /// From pixel centres (column, row, 0) to the reference frame, mm.
  Eigen::Matrix4d reference_from_image = Eigen::Matrix4d::Identity();
};

/// Codes of STATUS.
enum class Status : std::uint16_t { ok = 1, shut_down = 19 };

// Each adds a message, header and all, to `out`. `utc_s`: seconds since 1970.
void append_transform(Bytes& out, std::string_view device, double utc_s, const Eigen::Matrix4d& matrix);
void append_image(Bytes& out, std::string_view device, double utc_s, const GreyImage& image);
void append_status(Bytes& out, std::string_view device, double utc_s, Status code, std::string_view text);
void append_string(Bytes& out, std::string_view device, double utc_s, std::string_view text);

/// What came of a COMMAND, in words without < and &.
struct CommandReply {
  std::uint32_t id = 0;   ///< of the command
  std::string_view name;  ///< of the command, up to 128 bytes
  bool done = false;
  std::string_view words;
};
/// RTS_COMMAND, of version 2 with "Status" as meta data, content as PLUS has it.
void append_command_reply(Bytes& out, std::string_view device, double utc_s, const CommandReply& reply);

}  // namespace stylet::link
