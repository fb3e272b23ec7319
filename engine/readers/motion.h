// Motion files: time-stamped tracks of the stylus and the probe (content/README.md, "stylet-motion").
#pragma once

#include "engine/content/scene.h"
#include "engine/files/error.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stylet::readers {

/// A report of a HID device, as it came in.
struct RawReport {
  double time_s = 0;
  std::vector<std::uint8_t> bytes;  ///< with its id first where the device numbers its reports
};

/// What the poses of a motion's stylus are.
enum class MotionFrame : std::uint8_t {
  kPatient,  ///< of the hub, patient frame
  kHand,     ///< how the hand went from where it began: right, up and towards the trainee; the hub is to go with it
  kTablet,   ///< the same of a pen: right, towards the trainee, along the needle
};

/// What the HID device sent that led the hand of a motion.
struct RawReports {
  MotionFrame frame = MotionFrame::kPatient;      ///< of the stylus track
  std::string device{};                           ///< its name
  std::vector<std::uint8_t> report_descriptor{};  ///< what the reports mean; empty: there was no such device
  std::vector<RawReport> reports{};               ///< times not decreasing
};

/// Reads a motion file. Quaternions come out normalised; times are finite and strictly increasing in each track, and
/// the stylus track has at least two samples.
/// @param[out] raw  the reports it holds; null: they are checked only, and the poses must be the patient frame's
/// @throws ContentError
content::Motion read_motion(const std::filesystem::path& path, RawReports* raw = nullptr);

/// Writes a motion file that read_motion() reads back to the same samples, as far as `decimals` go (s, m).
/// @param decimals  9 for a hand recorded at 1 kHz: a micrometre a millisecond would be a tremor
/// @throws ContentError when the file cannot be written
void write_motion(const content::Motion& motion, const std::string& name, const std::filesystem::path& path,
                  int decimals = 6, const RawReports& raw = {});

/// Pose of a track at a time: linear in position, spherical in rotation, held before its first and after its last
/// sample; buttons of the sample before. `track` is not empty.
content::MotionSample sample_motion(const std::vector<content::MotionSample>& track, double time_s);

}  // namespace stylet::readers
