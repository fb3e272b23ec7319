// `stylet bench view`: what a picture of a running session costs, in the window, in stereo, on the scanner.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// The liver biopsy of its recorded hand, the needle on its way, in lockstep and undisturbed by the loops. Needs no
/// display. view.<what>.cpu: processor time of a frame, all threads (on a software rasteriser they do the GPU's work
/// too); .gpu: sum of its passes, by time stamps, each as .gpu.<pass>; .fps: frames a second where nothing else runs.
/// .cpu and .fps are averages, the times of passes medians of the frames that have them. Prints its progress to
/// stderr.
/// @throws gpu::GpuError, files::ContentError
Report bench_view(const BenchOptions& options);

}  // namespace stylet::bench
