// `stylet bench ultrasound`: the quality control of ultrasound scanners on a virtual phantom, and the speed of the
// image.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// All parts (ultrasound_quality.h, ultrasound_speed.h), one after the other. Prints its progress to stderr.
/// @throws gpu::GpuError  no usable Vulkan device
/// @throws std::runtime_error  a file cannot be written
Report bench_ultrasound(const BenchOptions& options);

}  // namespace stylet::bench
