// The parts of `stylet bench ultrasound`: what the quality control of scanners measures, on the virtual phantom, over
// several seeds, on the linear envelope that the GPU computed before depth gain and compression. Preset raw.
#pragma once

#include "engine/gpu/device.h"
#include "tools/bench/report.h"

#include <filesystem>

namespace stylet::bench {

// Conditions, as the rows state them. The envelope is taken before the depth gain (TGC) and the compression.
inline constexpr const char* kWithNoise = "raw; receiver noise -69 dB, before TGC";
inline constexpr const char* kWithoutNoise = "raw; receiver noise off, before TGC";

struct QualityRun {
  gpu::Device& device;
  int seeds = 8;
  std::filesystem::path out{};  ///< folder of figures; empty: none
};

/// speckle.* (Rayleigh statistics, compounding, size against the set beam) and attenuation.*
Report speckle_quality(const QualityRun& run);
/// contrast.* (grey targets, stepped cylinders), shadow.*, enhancement.*
Report contrast_quality(const QualityRun& run);
/// geometry.*: wires in the scan-converted picture
Report geometry_quality(const QualityRun& run);
/// motion.*, strain.*: speckle that goes with the tissue
Report motion_quality(const QualityRun& run);
/// elevation.*: speckle that leaves the image plane
Report elevation_quality(const QualityRun& run);
/// needle.*: contrast by insertion angle; repeat.*: the same image twice
Report needle_quality(const QualityRun& run);
/// Pictures of the whole phantom, raw and clinical. Figures alone.
Report phantom_pictures(const QualityRun& run);

}  // namespace stylet::bench
