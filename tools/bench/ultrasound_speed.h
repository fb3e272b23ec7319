// What an ultrasound image costs: time of the GPU and of all threads of this process.
#pragma once

#include "engine/gpu/device.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// speed.<what>.cpu: processor time of a frame, all threads (on a software rasteriser they do the GPU's work too);
/// .gpu: between the first and the last time stamp; .fps: frames a second, one after the other. Medians of `frames`,
/// the cases in turn, so that what else the machine does meets all alike.
Report ultrasound_speed(gpu::Device& device, int frames);

}  // namespace stylet::bench
