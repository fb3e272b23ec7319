// Motion files: time-stamped tracks of the stylus and the probe (content/README.md, "stylet-motion").
#pragma once

#include "engine/content/error.h"
#include "engine/content/scene.h"

#include <filesystem>
#include <string>

namespace stylet::content {

/// Reads a motion file. Quaternions come out normalised; times are finite and strictly increasing in each track, and
/// the stylus track has at least two samples.
/// @throws ContentError
Motion read_motion(const std::filesystem::path& path);

/// Writes a motion file that read_motion() reads back to the same samples (positions to 1e-6 m, times to 1e-6 s,
/// orientations to 1e-6). @throws ContentError when the file cannot be written
void write_motion(const Motion& motion, const std::string& name, const std::filesystem::path& path);

/// Pose of a track at a time: linear in position, spherical in rotation, held before its first and after its last
/// sample; buttons of the sample before. `track` is not empty.
MotionSample sample_motion(const std::vector<MotionSample>& track, double time_s);

}  // namespace stylet::content
