// A HID device as stylus: which device, and how it lies to the patient.
#pragma once

#include "engine/content/scene.h"
#include "engine/readers/calibration_file.h"
#include "engine/readers/motion.h"
#include "engine/recording/recording.h"
#include "engine/session/live_session.h"
#include "haptic/hid/hid_stylus.h"

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stylet::app {

/// Which device the user means.
struct HidChoice {
  std::uint16_t vendor_id = 0;  ///< 0: whichever can do most
  std::uint16_t product_id = 0;
  const haptic::hid::DeviceSource* source = &haptic::hid::hid_source();
  std::string path{};   ///< of the source's, or how it begins; empty: any
  std::string taken{};  ///< path of one that is in use; empty: none
};

/// What `stylet devices` takes: "VID:PID", or NAME or NAME:ID of a source other than HID; empty: whichever HID device
/// can do most.
/// @throws files::ContentError  it is none of these
HidChoice parse_device(const std::string& text);

/// A place of devices other than HID.
struct NamedSource {
  const char* name;  ///< as in --device NAME; paths are NAME:ID
  const haptic::hid::DeviceSource& (*source)();
};
/// All of them, in the order in which they are listed.
std::span<const NamedSource> named_sources();

/// @param name  of named_sources() @param id  as its paths have it; empty: the first
HidChoice choice_of_source(const std::string& name, const std::string& id);

/// @param id     "VID:PID", hexadecimal; empty: whichever can do most
/// @param asked  what the user said, for messages
/// @throws files::ContentError  it is not that
HidChoice parse_hid_id(const std::string& id, const std::string& asked);

/// A device that can lead a needle, as its user has calibrated it.
struct HidDevice {
  haptic::hid::HidDeviceSummary summary;
  haptic::hid::DeviceProfile profile;  ///< with what was measured of its axes
  haptic::hid::DeviceKind kind = haptic::hid::DeviceKind::kUnusable;
  haptic::hid::Calibration calibration;  ///< the default where there is none
  const haptic::hid::DeviceSource* source = &haptic::hid::hid_source();
};

/// @param asked  what the user said, for messages
/// @throws files::ContentError  none is there, or none can be used; its calibration is wrong
HidDevice choose_hid_device(const HidChoice& choice, const std::string& asked);
/// The same as its profile has it, whatever its calibration says.
HidDevice choose_uncalibrated(const HidChoice& choice, const std::string& asked);
/// What choose_hid_device() would take; kUnusable: nothing is there that can lead a needle.
haptic::hid::DeviceKind connected_kind();
/// How it lies on the desk, in the frame of the hand's motion: right, up and near, of pens right, near and into the
/// tablet.
Eigen::Quaterniond turn_on_the_desk(const HidDevice& device);
/// For the file of its calibration.
readers::CalibratedDevice identity_of(const haptic::hid::HidDeviceSummary& device);

/// It held open, its reports read one by one; its motors stay off.
struct OpenHidDevice {
  /// @throws haptic::hid::HidError
  explicit OpenHidDevice(const HidDevice& device);

  std::vector<std::uint8_t> descriptor;
  haptic::hid::StylusMap map;
  std::unique_ptr<haptic::hid::ReportTransport> transport;
};

/// Opens it for the needle of `scene`, the hub where the tip touches the skin at `entry` and points to `target`. The
/// hand's right is the right of the scene's picture, up is up in the room.
/// @throws files::ContentError, haptic::hid::HidError  none is there, or none can be used: why, and what to do
std::unique_ptr<haptic::hid::HidStylus> open_hid_stylus(const HidChoice& choice, const content::Scene& scene,
                                                        const Eigen::Vector3d& entry, const Eigen::Vector3d& target,
                                                        haptic::hid::ReportLog* log = nullptr);

/// Opens it for the probe of `scene`, in the same axes: its hub is how far the hand has gone from where it began.
/// @param asked  what the user said, for messages
/// @throws files::ContentError, haptic::hid::HidError  as above; it is neither a stylus nor a space mouse
std::unique_ptr<haptic::hid::HidStylus> open_hid_probe(const HidChoice& choice, const std::string& asked,
                                                       const content::Scene& scene);

/// Lays a hand that was recorded by itself to the needle of `scene`, as open_hid_stylus() lays a live one.
/// @param frame  of its poses; those of the patient's stay
void place_hand(content::Motion& motion, readers::MotionFrame frame, const content::Scene& scene,
                const Eigen::Vector3d& entry, const Eigen::Vector3d& target);

/// Writes a session's hand as a motion file, with the raw reports of the HID device that led it.
/// @param device  which device, and what its reports mean; empty where it was none
/// @throws files::ContentError  it cannot be written
void write_hand(const session::LiveSession& live, const recording::Recording& recording, readers::RawReports device,
                haptic::hid::ReportLog& log, const std::filesystem::path& file);

}  // namespace stylet::app
