// `stylet bench haptic`: a whole session with a mocked stylus under the real hidapi.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// Device in, physics of the default scenario, force out, for 60 s (quick: 2 s), in real time: reports counted both
/// ways, latency, limits, missed deadlines, and stalls while the device pushes. The mock has to be loaded before
/// libc, so the session is a program of its own, stylet_haptic_session, which is built with the tests; that of
/// devices that know no HID is stylet_adapted_session. BenchOptions::device_kind says which.
/// @throws std::runtime_error  it is not there, or could not run
Report bench_haptic(const BenchOptions& options);

}  // namespace stylet::bench
