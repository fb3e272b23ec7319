// The stylus of `--device hid`: which device, how it lies to the patient, and what to say when it comes and goes.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/recording.h"
#include "haptic/hid/hid_stylus.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace stylet::tools {

/// Which device the user means.
struct HidChoice {
  std::uint16_t vendor_id = 0;  ///< 0: whichever can do most
  std::uint16_t product_id = 0;
};

/// @param description  "hid" or "hid:VID:PID", hexadecimal. @return nothing: it begins otherwise
/// @throws content::ContentError  it begins so and goes on wrongly
std::optional<HidChoice> hid_choice(const std::string& description);

/// Opens it for the needle of `scene`, the hub where the tip touches the skin at `entry` and points to `target`. The
/// hand's right is the right of the scene's picture, up is up in the room.
/// @throws content::ContentError, haptic::hid::HidError  none is there, or none can be used: why, and what to do
std::unique_ptr<haptic::hid::HidStylus> open_hid_stylus(const HidChoice& choice, const content::Scene& scene,
                                                        const Eigen::Vector3d& entry, const Eigen::Vector3d& target,
                                                        haptic::hid::ReportLog* log = nullptr);

/// Tells on stderr when the stylus goes and when it is back; a null stylus never does.
class StylusWatch {
public:
  explicit StylusWatch(const haptic::hid::HidStylus* stylus) : stylus_(stylus) {}
  void look();

private:
  const haptic::hid::HidStylus* stylus_;
  bool connected_ = true;
};

/// Writes a session's hand as a motion file, with the raw reports where a HID device led it.
/// @param begin_ns  CLOCK_MONOTONIC at session time 0
/// @throws content::ContentError  it cannot be written
void write_hand(const session::Recording& recording, const haptic::hid::HidStylus* stylus,
                haptic::hid::ReportLog& log, std::int64_t begin_ns, const std::filesystem::path& file);

/// One line of counts of a session.
std::string hid_summary(const haptic::hid::HidStylus& stylus);

}  // namespace stylet::tools
