// A session in one thread on a fixed schedule: the same inputs give the same bits.
#pragma once

#include "engine/session/coupled_loops.h"
#include "engine/session/run_statistics.h"
#include "haptic/device.h"

namespace stylet::session {

/// Simulation steps between the request of a factorisation and its swap: what the asynchronous thread typically
/// needs.
inline constexpr int kLockstepFactorisationSteps = 5;

/// N = haptic rate / simulation rate haptic steps to every simulation step, which comes first and consumes the latest
/// needle. The device gets its force through an OutputGuard.
RunStatistics run_lockstep(CoupledLoops& loops, haptic::Device& device, const content::Scene& scene,
                           double duration_s, const RunProgress& progress = {});

}  // namespace stylet::session
